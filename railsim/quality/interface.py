"""What a check of a recording is, and what it finds."""

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np

from railsim.measurements import Measurements
from railsim.quality._signals import kind_of
from railsim.quality.repairs import Repair
from railsim.registry import Kind
from railsim.spec import Spec

Severity = Literal["fault", "note"]


@dataclass(frozen=True)
class Finding:
    """Something wrong with a channel.

    Attributes
    ----------
    kind : "offset", "offset step", "gain change", "noise", "stuck", "null", "drop-out", "spikes", "saturation",
        "clock", "clock shift", "clock rate", "repeated", "reordered", "byte order",
        "swapped", "inverted", "tachometer", "unit", "no gravity", "upside down",
        "tilted", "turned", "held", "rounded" or "too short".
    channel : name of the channel; "time [s] at 256 Hz" for a table's times.
    start, end : s, first and last sample that is concerned.
    extent : how large it is, in words.
    advice : what to do about it.
    severity : "note" for what belongs to service (a receiver's outage, a sliding wheel): nothing is wrong.
    repair : what is done about it; None for nothing.
    other : the other channel of an exchange, the channel from which samples come, the table beside which one is moved.
    samples : numbers of the samples that are changed, where not all from `start` to `end` are; shape (n,).
    """

    kind: str
    channel: str
    start: float
    end: float
    extent: str
    advice: str
    severity: Severity = "fault"
    repair: Repair | None = None
    other: str | None = None
    samples: np.ndarray | None = field(default=None, compare=False, repr=False)

    def stated(self) -> dict[str, Any]:
        """For JSON: all but the numbers of the samples, of which only their count."""
        values = {name: getattr(self, name) for name in ("kind", "channel", "extent", "advice", "severity")}
        values |= {"repair": self.repair.name if self.repair else "none"}
        values |= {"amount": self.repair.amount if self.repair else 0.0, "other": self.other}
        values |= {"start [s]": self.start, "end [s]": self.end}
        return values | ({} if self.samples is None else {"samples": int(self.samples.size)})

    def done(self) -> str:
        """The repair in words."""
        return self.repair.words(self) if self.repair and self.severity == "fault" else "nothing"

    def text(self, more: Sequence[str] = ()) -> str:
        """One line for people; `more`: other channels of which the same is found."""
        where = f"t = {self.start:.2f} s" if self.end <= self.start else f"t = {self.start:.2f} to {self.end:.2f} s"
        name = self.channel if self.other is None else f"{self.channel}, {self.other}"
        return f"{', '.join([name, *more])}: {self.kind}, {where}: {self.extent}; {self.advice}"


def texts(findings: Iterable[Finding]) -> list[str]:
    """Lines for people; what is found of several channels at the same time and alike is one line."""
    alike: dict[tuple[str, ...], list[Finding]] = {}
    for one in findings:
        same = one.kind, f"{one.start:.6f}", f"{one.end:.6f}", one.extent, one.advice, str(one.other)
        alike.setdefault(same, []).append(one)
    return [first.text([one.channel for one in others]) for first, *others in alike.values()]


class Check(Spec, frozen=True):
    """Base of every check; its fields are its limits, each with its reason as source."""

    stage: ClassVar[int]
    """Checks run in this order, each on what the repairs of those before it have left."""

    @abstractmethod
    def find(self, measurements: Measurements) -> list[Finding]:
        """Everything of its kinds that is wrong with a recording."""


CHECKS = Kind("checks", "railsim.quality", Check)


class ChannelCheck(Check, frozen=True):
    """Base of checks that look at one channel at a time, at most one finding each."""

    apart: ClassVar[tuple[str, ...]] = ("tachometer", "gnss")
    """Kinds of sensor that are not looked at."""

    def find(self, measurements: Measurements) -> list[Finding]:
        """The findings of all channels."""
        looked = (name for name in measurements if kind_of(measurements, name) not in self.apart)
        return [one for name in looked if (one := self.channel(measurements, name)) is not None]

    @abstractmethod
    def channel(self, measured: Measurements, name: str) -> Finding | None:
        """What is wrong with a channel; None where nothing is."""
