"""Settings shared by all tests."""

import matplotlib
from hypothesis import settings

matplotlib.use("Agg")  # no test needs a display
settings.register_profile("railsim", deadline=None, print_blob=True)  # the first call of a kernel compiles it
settings.load_profile("railsim")
