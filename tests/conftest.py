"""Settings shared by all tests."""

import gc
import os
from pathlib import Path

import matplotlib
import pytest
from hypothesis import settings

os.environ.pop("RAILSIM_PLUGINS", None)  # tests of all plug-ins run over those that ship
matplotlib.use("Agg")  # no test needs a display
settings.register_profile("railsim", deadline=None, print_blob=True)  # the first call of a kernel compiles it
settings.load_profile("railsim")

gc.set_threshold(20_000)
"""New objects between two looks for garbage: at Python's 700 these looks took 5 % of the time of the tests of
`field`, `formats` and `track`."""

LONGEST = (
    "golden/test_golden.py", "engines/test_corunning_track.py", "experiments/discrepancy/test_half_car.py",
    "test_conformance.py", "engines/test_two_contacts.py", "experiments/figures/test_every_figure.py",
    "engines/test_static.py", "experiments/validation/test_validation.py", "effects/test_all.py",
    "quality/test_blocks.py", "experiments/discrepancy/test_laboratory.py",
    "experiments/test_day.py", "test_contributing.py",
    "experiments/test_cli.py", "estimators/suspension/test_suspension_spectral.py", "estimators/test_bad_channels.py",
    "estimators/wheel_rail/test_gauge_likelihood.py", "experiments/sweep/test_run.py", "analysis/test_curving.py",
    "estimators/suspension/test_suspension.py",
    "engines/test_whole_vehicle.py", "engines/test_large_models.py", "experiments/runs/test_long_record.py",
    "engines/test_agreement.py",
    "experiments/discrepancy/test_railway.py", "experiments/maintenance/test_retention.py",
    "experiments/reproduction/test_reproduce.py",
)  # fmt: skip
"""Files whose tests take longest, in this order: begun first, so that no worker ends with one of them. Those that
compile the same right-hand sides of engines do not stand side by side.
"""


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Where workers share the tests, the longest files first."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        here = Path(__file__).parent
        ranks = {here / name: rank for rank, name in enumerate(LONGEST)}
        items.sort(key=lambda item: ranks.get(item.path, len(ranks)))


def pytest_collection_finish() -> None:
    """Modules and collected tests stay to the end: nobody looks through them for garbage again."""
    gc.collect()
    gc.freeze()
