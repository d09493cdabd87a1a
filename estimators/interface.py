"""What an estimator is: measured channels and nominal parameters in, a table with its uncertainty out."""

import json
import os
import shutil
import uuid
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

import numpy as np
import pandas as pd

from railsim.errors import InputError
from railsim.spec import Spec


@runtime_checkable
class Measurements(Protocol):
    """The part of `railsim.recording.Measurements` that estimators use; it has no way to the truth."""

    @property
    def channels(self) -> list[str]:
        """Names of the measured channels, `"<sensor>.<quantity> [unit]"`."""
        ...

    @property
    def about(self) -> dict[str, Any]:
        """Contents of about.json."""
        ...

    @property
    def vehicle(self) -> dict[str, Any]:
        """Nominal vehicle parameters in SI units, by field name."""
        ...

    def __getitem__(self, name: str) -> np.ndarray:
        """Samples of a channel, shape (n,)."""
        ...

    def time(self, name: str) -> np.ndarray:
        """Time stamps of a channel in s, shape (n,)."""
        ...

    def rate(self, name: str) -> float:
        """Sample rate of a channel in Hz."""
        ...


@dataclass(frozen=True)
class Estimate:
    """Result of one estimator on one recording.

    Attributes
    ----------
    name : the estimator's name.
    series : first column `"time [s]"` or `"s [m]"`, then `"quantity [unit]"` and optionally `"quantity_std [unit]"`.
    about : settings of the estimator and whatever explains the result; must be JSON.
    """

    name: str
    series: pd.DataFrame
    about: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        first = str(self.series.columns[0]) if len(self.series.columns) else ""
        if first not in ("time [s]", "s [m]"):
            raise ValueError(f"first column of an estimate must be 'time [s]' or 's [m]', not '{first}'")

    def save(self, folder: Path | str) -> None:
        """Write estimate.parquet and about.json; the folder appears whole or not at all, an older estimate is replaced.

        Raises
        ------
        InputError : the folder cannot be written.
        """
        folder = Path(folder)
        aside = folder.with_name(f"{folder.name}.partial-{uuid.uuid4().hex[:8]}")
        try:
            aside.mkdir(parents=True)
            self.series.to_parquet(aside / "estimate.parquet", index=False)
            text = json.dumps({"name": self.name, "about": self.about}, indent=2, allow_nan=False)
            (aside / "about.json").write_text(text, encoding="utf-8")
            _replace(aside, folder)
        except OSError as error:
            raise InputError(f"{folder}: cannot write the estimate ({error.strerror}); choose another folder") from None
        finally:
            shutil.rmtree(aside, ignore_errors=True)

    @classmethod
    def open(cls, folder: Path | str) -> Self:
        """Read what `save` wrote.

        Raises
        ------
        InputError : no complete estimate in the folder.
        """
        folder = Path(folder)
        try:
            head = json.loads((folder / "about.json").read_text(encoding="utf-8"))
            return cls(str(head["name"]), pd.read_parquet(folder / "estimate.parquet"), dict(head["about"]))
        except (OSError, ValueError, KeyError, TypeError):
            raise InputError(f"{folder}: not a complete estimate; make one with 'railsim estimate'") from None


class Estimator(Spec):
    """Base of every estimator: its fields are its settings, its module's name is its name."""

    requires: ClassVar[tuple[str, ...]] = ()

    @property
    def name(self) -> str:
        """Name of the module that defines the estimator."""
        return type(self).__module__.rpartition(".")[2]

    def fits(self, measurements: Measurements) -> bool:
        """Whether the recording has every channel that the estimator needs."""
        return set(self.requires) <= set(measurements.channels)

    def need(self, measurements: Measurements) -> None:
        """Raise `InputError` that names the first required channel that is missing."""
        missing = [name for name in self.requires if name not in measurements.channels]
        if missing:
            raise InputError(f"{self.name} needs channel '{missing[0]}'; add that sensor to the recording")

    @abstractmethod
    def estimate(self, measurements: Measurements) -> Estimate:
        """Estimate from a whole record."""


class Online(Protocol):
    """A running estimation: the state lives here, so that the estimator itself stays a value."""

    def step(self, sample: Mapping[str, float]) -> dict[str, float]:
        """Take one sample (`"time [s]"` and the required channels, NaN where lost); return one row of the series."""
        ...


@runtime_checkable
class OnlineEstimator(Protocol):
    """An estimator that also runs sample by sample and gives the same numbers as on the whole record."""

    def online(self, about: Mapping[str, Any], rate: float) -> Online:
        """Start a run; `about` holds what a recording's about.json holds, `rate` is the channels' sample rate in Hz."""
        ...


def _replace(aside: Path, folder: Path) -> None:
    """Put `aside` in the place of `folder`, which may be an older estimate but nothing else."""
    if folder.exists():
        if not (folder / "estimate.parquet").exists() and any(folder.iterdir()):
            raise InputError(f"{folder}: holds something that is not an estimate; choose another folder")
        old = folder.with_name(f"{folder.name}.partial-{uuid.uuid4().hex[:8]}")
        os.rename(folder, old)
        shutil.rmtree(old)
    os.rename(aside, folder)
