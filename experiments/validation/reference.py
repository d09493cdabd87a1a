"""Where the reference data lie: numbers that this project did not make and does not ship."""

import os
from collections.abc import Iterable
from pathlib import Path

import pandas as pd

VARIABLE = "RAILSIM_REFERENCE"
_BESIDE = Path(__file__).parents[2].parent / "shared" / "reference"


def folder() -> Path:
    """$RAILSIM_REFERENCE, or ../shared/reference beside the project; it need not exist."""
    return Path(os.environ.get(VARIABLE) or _BESIDE)


def lacking(names: Iterable[str]) -> list[str]:
    """Those of the files `names` (relative to the folder) that are not there."""
    return [name for name in names if not (folder() / name).is_file()]


def read(name: str) -> pd.DataFrame:
    """A CSV file of the reference data."""
    return pd.read_csv(folder() / name)
