"""Repairs: what is done to a recording about a finding, a class each."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from railsim.measurements import TIME
from railsim.quality._axes import AXES, TURNS, Axes
from railsim.quality._grid import regridded, shifted, stretched
from railsim.quality._restore import restored
from railsim.quality._signals import filled
from railsim.quality.companions import predicted
from railsim.quality.draft import Columns, Draft
from railsim.sensors.logger import reversed_bytes

if TYPE_CHECKING:
    from railsim.quality.interface import Finding


@dataclass(frozen=True)
class Repair(ABC):
    """What is done about a finding.

    Attributes
    ----------
    amount : its size, in the unit that the repair states; 0 where it has none.
    name : in about.json and in the command's JSON.
    stage : repairs of samples (0) come before those that move a table (1) and those of its grid of times (2).
    lasting : False for what only keeps samples from later checks.
    log : what was done, with {amount} and {other}, the finding's other channel.
    """

    amount: float = 0.0

    name: ClassVar[str]
    log: ClassVar[str]
    stage: ClassVar[int] = 0
    lasting: ClassVar[bool] = True

    @abstractmethod
    def apply(self, draft: Draft, finding: "Finding") -> None:
        """Change the draft."""

    def words(self, finding: "Finding") -> str:
        """What was done, for the log."""
        return self.log.format(amount=self.amount, other=finding.other)


class SampleRepair(Repair):
    """Repair of samples of a channel, and of its twin: a tachometer's two channels are one measurement."""

    def apply(self, draft: Draft, finding: "Finding") -> None:
        """Change the channel's samples that are concerned."""
        table, at = draft.table(finding), draft.samples(finding)
        for name in twins(table, finding.channel):
            self.change(table[name], at)

    @abstractmethod
    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Change samples `at` of the values in place."""


@dataclass(frozen=True)
class Mask(SampleRepair):
    """Samples count as lost in the checks that follow; the cleaned recording keeps them."""

    name: ClassVar[str] = "mask"
    log: ClassVar[str] = "nothing"
    lasting: ClassVar[bool] = False

    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Take the samples out."""
        values[at] = math.nan


@dataclass(frozen=True)
class Blank(Mask):
    """Samples are left out."""

    name: ClassVar[str] = "blank"
    log: ClassVar[str] = "samples left out"
    lasting: ClassVar[bool] = True


@dataclass(frozen=True)
class Fill(SampleRepair):
    """Samples are interpolated between their neighbours; what was lost before stays lost."""

    name: ClassVar[str] = "fill"
    log: ClassVar[str] = "samples interpolated"

    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Interpolate."""
        lost = np.isnan(values)
        values[at] = math.nan
        values[:] = np.where(lost, math.nan, filled(values))


@dataclass(frozen=True)
class Subtract(SampleRepair):
    """`amount` (unit of the channel) is subtracted."""

    name: ClassVar[str] = "subtract"
    log: ClassVar[str] = "{amount:.6g} subtracted"

    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Subtract."""
        values[at] -= self.amount


@dataclass(frozen=True)
class Scale(SampleRepair):
    """The samples are divided by the factor `amount`."""

    name: ClassVar[str] = "scale"
    log: ClassVar[str] = "divided by {amount:.6g}"

    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Divide."""
        values[at] /= self.amount


@dataclass(frozen=True)
class Negate(SampleRepair):
    """The sign of the whole channel is turned round."""

    name: ClassVar[str] = "negate"
    log: ClassVar[str] = "sign turned round"

    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Turn round, all samples."""
        del at
        values *= -1.0


@dataclass(frozen=True)
class Put(Repair):
    """`values` (unit of the channel, one a sample that is concerned) take the samples' place."""

    values: np.ndarray = field(compare=False, repr=False, kw_only=True)

    name: ClassVar[str] = "put"
    log: ClassVar[str] = "samples put back from {other}"

    def apply(self, draft: Draft, finding: "Finding") -> None:
        """Put them in; in the twin in its own unit, by the ratio of the two where the wheel turns."""
        table, at = draft.table(finding), draft.samples(finding)
        read = table[finding.channel].copy()
        moving = np.abs(read) > 0.1 * np.nanmax(np.abs(read))
        for name in twins(table, finding.channel):
            unit = 1.0 if name == finding.channel else float(np.nanmedian(table[name][moving] / read[moving]))
            table[name][at] = unit * self.values


@dataclass(frozen=True)
class Restore(Repair):
    """Limited samples come back by the channel's own model and by what the other channels say."""

    name: ClassVar[str] = "restore"
    log: ClassVar[str] = (
        "samples put back by the channel's autoregressive model and the other channels, long runs left out"
    )

    def apply(self, draft: Draft, finding: "Finding") -> None:
        """See `restored`."""
        name, at = finding.channel, draft.samples(finding)
        values = draft.table(finding)[name]
        sound = np.isfinite(values)
        sound[at] = False
        prediction = predicted(draft.measured, name, values, sound)
        draft.table(finding)[name] = restored(values, at, draft.rate(finding), prediction)


@dataclass(frozen=True)
class Reread(SampleRepair):
    """Whole numbers of `step` (unit of the channel) in words of `amount` bits are read in the other byte order."""

    step: float = 1.0

    name: ClassVar[str] = "reread"
    log: ClassVar[str] = "bytes of {amount:.0f}-bit words reversed"

    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Reverse the bytes of all samples."""
        del at
        values[:] = reversed_bytes(values, self.step, round(self.amount))


@dataclass(frozen=True)
class Close(SampleRepair):
    """Rows that were put in are taken out, those after them move up, and as many at the end are lost."""

    name: ClassVar[str] = "close"
    log: ClassVar[str] = "rows taken out, later ones moved up"

    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Take them out."""
        kept = np.delete(values, at)
        values[: kept.size] = kept
        values[kept.size :] = math.nan


@dataclass(frozen=True)
class Reorder(SampleRepair):
    """The samples are taken from the rows `order`, one a sample that is concerned."""

    order: np.ndarray = field(compare=False, repr=False, kw_only=True)

    name: ClassVar[str] = "reorder"
    log: ClassVar[str] = "put back in their order"

    def change(self, values: np.ndarray, at: np.ndarray) -> None:
        """Put them back."""
        values[at] = values[self.order]


@dataclass(frozen=True)
class Swap(Repair):
    """The channel and the finding's other one are exchanged."""

    name: ClassVar[str] = "swap"
    log: ClassVar[str] = "exchanged with {other}"

    def apply(self, draft: Draft, finding: "Finding") -> None:
        """Exchange them."""
        table, name, other = draft.table(finding), finding.channel, str(finding.other)
        table[name], table[other] = table[other], table[name]


@dataclass(frozen=True)
class Rotate(Repair):
    """A sensor's axes are turned to those of its body, its gyro's with them; `amount` is the angle in deg."""

    rotation: Rotation = field(compare=False, repr=False, kw_only=True)
    axes: Axes = field(compare=False, repr=False, kw_only=True)

    name: ClassVar[str] = "rotate"
    log: ClassVar[str] = "axes turned by {amount:.4g} deg"

    def apply(self, draft: Draft, finding: "Finding") -> None:
        """Turn all samples; where one axis is lost, all are."""
        del finding
        for channels, order in ((self.axes.accelerations, AXES), (self.axes.rates, TURNS)):
            if not set(order) <= set(channels):
                continue
            names = [channels[axis] for axis in order]
            tables = [draft.tables[draft.measured.rate(name)] for name in names]
            turned = self.rotation.apply(np.array([t[n] for t, n in zip(tables, names, strict=True)]).T).T
            for table, name, values in zip(tables, names, turned, strict=True):
                table[name] = np.ascontiguousarray(values)


@dataclass(frozen=True)
class Shift(Repair):
    """The table's values are moved to stamps that are `amount` s later."""

    name: ClassVar[str] = "shift"
    log: ClassVar[str] = "moved by {amount:+.6g} s"
    stage: ClassVar[int] = 1

    def apply(self, draft: Draft, finding: "Finding") -> None:
        """Move them; the table reaches no further than the longest one."""
        latest = max(float(table[TIME][-1]) + 1.0 / rate for rate, table in draft.tables.items())
        draft.tables[draft.rate(finding)] = shifted(draft.table(finding), self.amount, latest)


@dataclass(frozen=True)
class Stretch(Repair):
    """The table's samples were taken at (1 + `amount`) times their stamps and `first` s later; they are resampled."""

    first: float = 0.0

    name: ClassVar[str] = "stretch"
    log: ClassVar[str] = "stamps stretched by {amount:+.6g}, resampled"
    stage: ClassVar[int] = 1

    def apply(self, draft: Draft, finding: "Finding") -> None:
        """Resample it; the table reaches no further than the longest one."""
        latest = max(float(table[TIME][-1]) + 1.0 / rate for rate, table in draft.tables.items())
        draft.tables[draft.rate(finding)] = stretched(draft.table(finding), self.amount, self.first, latest)


@dataclass(frozen=True)
class Regrid(Repair):
    """The table's rows come to even times, rows that are missing are empty."""

    name: ClassVar[str] = "regrid"
    log: ClassVar[str] = "even times, missing rows left empty"
    stage: ClassVar[int] = 2

    def apply(self, draft: Draft, finding: "Finding") -> None:
        """Make the times even, once however many findings ask for it."""
        rate = draft.rate(finding)
        if rate not in draft.even:
            draft.tables[rate] = regridded(draft.tables[rate], rate)
            draft.even.add(rate)


def twins(table: Columns, name: str) -> list[str]:
    """The channel, and a tachometer's other one."""
    for ending, other in ((".speed [m/s]", ".wheel_speed [rad/s]"), (".wheel_speed [rad/s]", ".speed [m/s]")):
        twin = name.removesuffix(ending) + other
        if name.endswith(ending) and twin in table:
            return [name, twin]
    return [name]
