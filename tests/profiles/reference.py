"""Where the reference data lies; tests that need it skip without it."""

from pathlib import Path

import pytest

REFERENCE = Path(__file__).parents[3] / "shared" / "reference"
PROFILES = REFERENCE / "profiles"
needs_reference = pytest.mark.skipif(not REFERENCE.is_dir(), reason="no reference data: ../shared/reference is absent")
