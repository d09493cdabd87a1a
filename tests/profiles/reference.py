"""Where the reference data lies; tests that need it skip without it."""

import pytest

from experiments.validation.reference import folder

REFERENCE = folder()
PROFILES = REFERENCE / "profiles"
needs_reference = pytest.mark.skipif(not REFERENCE.is_dir(), reason="no reference data: ../shared/reference is absent")
