"""Settings shared by all tests."""

import os

import matplotlib
from hypothesis import settings

os.environ.pop("RAILSIM_PLUGINS", None)  # tests of all plug-ins run over those that ship
matplotlib.use("Agg")  # no test needs a display
settings.register_profile("railsim", deadline=None, print_blob=True)  # the first call of a kernel compiles it
settings.load_profile("railsim")
