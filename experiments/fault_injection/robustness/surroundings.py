"""Whether an estimator gives the same bytes whatever the order of sets, threads of linear algebra and kernel cache."""

import subprocess
import sys
from pathlib import Path

import numpy as np

from estimators.interface import ESTIMATORS, Estimate
from experiments.fault_injection.robustness.attempt import Attempt, ended
from experiments.fault_injection.robustness.workshop import WIDE, contents
from railsim.recording import Recording

LONGEST = 900.0  # s of a processor, as every kernel may have to be compiled
SETTINGS: tuple[dict[str, str], ...] = (
    {"PYTHONHASHSEED": "1", "OPENBLAS_NUM_THREADS": "1"},
    {"PYTHONHASHSEED": "2", "OPENBLAS_NUM_THREADS": "2", "NUMBA_NUM_THREADS": "1"},
    {"PYTHONHASHSEED": "3", "OPENBLAS_NUM_THREADS": "8", "NUMBA_CACHE_DIR": "fresh"},
)
"""The last one compiles every kernel anew."""


def names() -> list[str]:
    """All estimators."""
    return list(ESTIMATORS.classes())


def compared(name: str, workshop: Path, place: Path) -> tuple[str, list[str], float, int]:
    """An estimator in each of `SETTINGS`.

    Returns
    -------
    The ending in a word, what differs (with the largest relative difference of a column), s and bytes of memory.
    """
    folder = _recording(name, workshop)
    if folder is None:
        return "fits none of the recordings", [], 0.0, 0
    results, seconds, memory = [], 0.0, 0
    for number, setting in enumerate(SETTINGS):
        out = place / f"estimate{number}"
        fresh = {key: str(place / "kernels") if value == "fresh" else value for key, value in setting.items()}
        words = [sys.executable, "-m", "railsim", "estimate", name, str(folder), "--out", str(out)]
        environment = {"PYTHONPATH": str(Path(__file__).parents[3]), **fresh}
        done = ended(
            Attempt(lambda at=words: subprocess.call(at), place / "said", environment=environment, longest=LONGEST)
        )
        if not (out / "about.json").is_file():
            refused = "refused" if done.code == 2 else f"exit code {done.code}"
            return refused, list(done.faults), done.seconds, done.memory
        results.append(out)
        seconds, memory = max(seconds, done.seconds), max(memory, done.memory)
    wanted = contents(results[0])
    differing = sorted({n for one in results[1:] for n, digest in contents(one).items() if wanted.get(n) != digest})
    return "same bytes" if not differing else "differs", [_said(n, results) for n in differing], seconds, memory


def _recording(name: str, workshop: Path) -> Path | None:
    estimator = ESTIMATORS.pick(name).build({})
    places = (workshop / f"wide_{scenario}" for scenario in WIDE)
    return next((place for place in places if estimator.fits(Recording.open(place).measurements)), None)


def _said(name: str, results: list[Path]) -> str:
    if name != "estimate.parquet":
        return f"other {name}"
    first = Estimate.open(results[0]).series
    largest = 0.0
    for other in results[1:]:
        series = Estimate.open(other).series
        for column in first:
            scale = float(np.nanmax(np.abs(first[column]))) or 1.0
            largest = max(largest, float(np.nanmax(np.abs(series[column] - first[column]))) / scale)
    return f"other estimate.parquet ({largest:.1g} of the largest value)"
