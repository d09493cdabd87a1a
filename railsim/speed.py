"""Speed of a run: prescribed over time, or free with traction, brakes and running resistance."""

from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
import pydantic

from railsim.spec import Spec, quantity

FASTEST = 120.0  # m/s


class SpeedTables(NamedTuple):
    """Piecewise linear over `time`; w wheelsets."""

    time: np.ndarray  # (k,) s
    speed: np.ndarray  # (k,) m/s; prescribed speed, or the first value to start with
    torque: np.ndarray  # (k, w) N m on each wheelset, driving +
    slip: np.ndarray  # (k, w) target (V - r0 omega) / V of the slide control, 0 = off
    driven: bool
    resistance: np.ndarray  # (3,) N, N s/m, N s2/m2


class Constant(Spec, frozen=True):
    """The same speed all the time."""

    kind: Literal["constant"] = "constant"
    speed: float = quantity(unit="m/s", source="scenario", gt=0.0, le=FASTEST)

    def knots(self, duration: float) -> tuple[list[float], list[float]]:
        """Times [s] and speeds [m/s]."""
        return [0.0, duration], [self.speed, self.speed]


class Profile(Spec, frozen=True):
    """Speed piecewise linear over time, held after the last point."""

    kind: Literal["profile"]
    time: tuple[float, ...]
    speed: tuple[Annotated[float, pydantic.Field(ge=0.0, le=FASTEST)], ...]

    @pydantic.model_validator(mode="after")
    def _consistent(self) -> Self:
        _check_knots(self.time, self.speed, "speed")
        if self.speed[0] <= 0.0:
            raise ValueError("speed must start above 0 m/s")
        return self

    def knots(self, duration: float) -> tuple[list[float], list[float]]:
        """Times [s] and speeds [m/s]."""
        return list(self.time), list(self.speed)


class Driven(Spec, frozen=True):
    """Speed follows from the forces: wheelset torques (`traction`), gradient and running resistance A + B V + C V^2."""

    kind: Literal["driven"]
    speed: float = quantity(unit="m/s", source="scenario: at the start", gt=0.0, le=FASTEST)
    resistance: tuple[float, float, float] = quantity((0.0, 0.0, 0.0), unit="N, N s/m, N s2/m2", source="scenario")

    def knots(self, duration: float) -> tuple[list[float], list[float]]:
        """Times [s] and the speed to start with [m/s]."""
        return [0.0, duration], [self.speed, self.speed]


Speed = Annotated[Constant | Profile | Driven, pydantic.Field(discriminator="kind")]


class Traction(Spec, frozen=True):
    """Torque of drive or brake on one wheelset over time, or a slide held at `slip` by the brake, as a slide control
    does.
    """

    wheelset: int = pydantic.Field(ge=1)
    time: tuple[float, ...]
    torque: tuple[float, ...] | None = None
    slip: tuple[Annotated[float, pydantic.Field(ge=-0.9, le=0.9)], ...] | None = None

    @pydantic.model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.torque is None) == (self.slip is None):
            raise ValueError("give either torque or slip")
        _check_knots(self.time, self.torque or self.slip or (), "torque or slip")
        return self


def speed_tables(
    speed: Constant | Profile | Driven, traction: tuple[Traction, ...], wheelsets: int, duration: float
) -> SpeedTables:
    """Everything on one common set of knots."""
    time, values = speed.knots(duration)
    knots = np.unique(np.concatenate([time, *(t.time for t in traction), [0.0]]))
    torque, slip = np.zeros((len(knots), wheelsets)), np.zeros((len(knots), wheelsets))
    for entry in traction:
        column = entry.wheelset - 1
        if entry.torque is not None:
            torque[:, column] += np.interp(knots, entry.time, entry.torque)
        if entry.slip is not None:
            slip[:, column] += np.interp(knots, entry.time, entry.slip)
    resistance = np.array(speed.resistance if isinstance(speed, Driven) else (0.0, 0.0, 0.0))
    return SpeedTables(knots, np.interp(knots, time, values), torque, slip, isinstance(speed, Driven), resistance)


def _check_knots(time: tuple[float, ...], values: tuple[float, ...], what: str) -> None:
    if len(time) != len(values) or len(time) < 1:
        raise ValueError(f"time and {what} need the same number of values, one or more")
    if any(b <= a for a, b in zip(time, time[1:], strict=False)):
        raise ValueError("time must increase")
