"""What an estimator is: measured channels and nominal parameters in, a table with its uncertainty out."""

import os
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self, runtime_checkable

import pandas as pd

from railsim.digests import check_as_written
from railsim.errors import InputError
from railsim.files import read_json, write_folder_atomically, write_json
from railsim.measurements import Measurements
from railsim.parquet import read_columns, read_names, write_frame
from railsim.registry import Kind
from railsim.shown import html
from railsim.spec import Spec

if TYPE_CHECKING:
    from railsim.plots.style import Picture


@dataclass(frozen=True, repr=False)
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

    def __repr__(self) -> str:
        """Name, number of rows and columns in one line."""
        return f"<Estimate of {self.name}: {len(self.series)} rows of {', '.join(map(str, self.series.columns))}>"

    def _repr_html_(self) -> str:
        """A table of the quantities, for notebooks."""
        rows = [
            (name, f"{values.min():.5g}", f"{values.mean():.5g}", f"{values.max():.5g}", int(values.isna().sum()))
            for name, values in self.series.items()
        ]
        title = f"Estimate of {self.name}: {len(self.series)} rows"
        return html(title, ("quantity", "least", "mean", "most", "withheld"), rows)

    def plot(self) -> "Picture":
        """A picture of every quantity with two stated deviations, what is not valid, events and warnings."""
        from railsim.plots.estimate import estimate_picture

        return estimate_picture(self)

    def save(
        self,
        folder: Path | str,
        tables: Mapping[str, pd.DataFrame] = MappingProxyType({}),
        recording: Path | str | None = None,
        files: Mapping[str, Callable[[Path], object]] = MappingProxyType({}),
    ) -> None:
        """Write estimate.parquet and about.json; the folder appears whole or not at all, an older estimate is replaced.

        Parameters
        ----------
        tables : what else shall stand in the folder, by file name, as CSV.
        recording : folder of the recording that it was made of, of which the way from here is kept.
        files : what else, by file name, each as what writes it to a path.

        Raises
        ------
        InputError : the folder cannot be written or is somebody else's.
        """
        with write_folder_atomically(folder) as aside:
            write_frame(aside / "estimate.parquet", self.series)
            head: dict[str, Any] = {"name": self.name, "about": self.about}
            if recording is not None:
                head["recording"] = os.path.relpath(Path(recording).resolve(), Path(folder).resolve())
            write_json(aside / "about.json", head)
            for name, table in tables.items():
                table.to_csv(aside / name, index=False, float_format="%.6g")
            for name, write in files.items():
                write(aside / name)

    @classmethod
    def open(cls, folder: Path | str) -> Self:
        """Read what `save` wrote.

        Raises
        ------
        InputError : no complete estimate in the folder.
        """
        folder = Path(folder)
        head = read_json(folder / "about.json", "an estimate")
        check_as_written(folder, "about.json", "estimate.parquet")
        if not isinstance(head.get("name"), str) or not isinstance(head.get("about"), dict):
            raise InputError(
                f'\'{folder}\' is not an estimate: its about.json has no "name" or "about"; name another folder'
            )
        table = folder / "estimate.parquet"
        names, _ = read_names(table)
        series = pd.DataFrame(read_columns(table, names), copy=False)
        return cls(head["name"], series, head["about"])


@dataclass(frozen=True)
class Missing:
    """What an estimator needs and a recording does not have.

    Attributes
    ----------
    channels : by their full names.
    parameters : of the vehicle, nominal, by field name.
    others : what else, in words that also say how to give it.
    """

    channels: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    others: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        """Whether anything is missing."""
        return bool(self.channels or self.parameters or self.others)

    def __add__(self, other: "Missing") -> "Missing":
        """Both, nothing twice."""
        return Missing(
            *(
                tuple(dict.fromkeys((*mine, *theirs)))
                for mine, theirs in (
                    (self.channels, other.channels),
                    (self.parameters, other.parameters),
                    (self.others, other.others),
                )
            )
        )

    def text(self) -> str:
        """All of it in one line, with what mends it."""
        parts = []
        if self.channels:
            what, which = ("channels", "these sensors") if len(self.channels) > 1 else ("channel", "that sensor")
            parts.append(f"{what} {_quoted(self.channels)}; add {which} to the recording")
        if self.parameters:
            what, which = ("parameters", "them") if len(self.parameters) > 1 else ("parameter", "it")
            give = f"under 'vehicle' in the map, or by --set vehicle.{next(iter(self.parameters))}=NUMBER"
            parts.append(f"vehicle {what} {_quoted(self.parameters)} in SI units; give {which} {give}")
        return "; and ".join([*parts, *self.others])


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


class Estimator(Spec, frozen=True):
    """Base of every estimator: its fields are its settings, its module's name is its name.

    Attributes
    ----------
    requires : channels without which it gives nothing.
    adds : channels that it can do without, and what each of them brings.
    nearby : whether what it gives at a place depends on the record nearby alone, so that it may work on a long record
        section by section: its series has rows of one spacing over "s [m]", or rows over "time [s]".
    """

    requires: ClassVar[tuple[str, ...]] = ()
    nearby: ClassVar[bool] = False
    adds: ClassVar[Mapping[str, str]] = MappingProxyType({})

    @property
    def name(self) -> str:
        """Name of the module that defines the estimator."""
        return type(self).__module__.rpartition(".")[2]

    def needed(self) -> tuple[str, ...]:
        """The channels that the estimator needs with these settings."""
        return self.requires

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """Nominal parameters of the vehicle that the estimator needs for such a recording."""
        return ()

    def missing(self, measurements: Measurements) -> Missing:
        """Everything that is needed and not there."""
        channels = tuple(name for name in self.needed() if name not in measurements)
        vehicle = measurements.vehicle
        unknown = (one for one in self.parameters(measurements) if not isinstance(vehicle.get(one), int | float))
        return Missing(channels, tuple(dict.fromkeys(unknown)))

    def fits(self, measurements: Measurements) -> bool:
        """Whether the recording has everything that the estimator needs."""
        return not self.missing(measurements)

    def need(self, measurements: Measurements) -> None:
        """Raise `InputError` that names everything that is needed and missing."""
        if missing := self.missing(measurements):
            raise InputError(f"{self.name} needs {missing.text()}")

    @abstractmethod
    def estimate(self, measurements: Measurements) -> Estimate:
        """Estimate from a whole record."""


ESTIMATORS = Kind("estimators", "estimators", Estimator)


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
