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
    brake: np.ndarray  # (k, w) N m of friction brakes, against the wheelset's rotation
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
    """What acts on one wheelset over time, one of three: a `torque` [N m] whatever the wheelset does, driving +; a
    friction `brake` [N m] against its rotation, which holds a wheelset that stands; a slide held at `slip` by the
    brake, as a slide control does.
    """

    wheelset: int = pydantic.Field(ge=1)
    time: tuple[float, ...]
    torque: tuple[float, ...] | None = None
    brake: tuple[Annotated[float, pydantic.Field(ge=0.0)], ...] | None = None
    slip: tuple[Annotated[float, pydantic.Field(ge=-0.9, le=0.9)], ...] | None = None

    @pydantic.model_validator(mode="after")
    def _consistent(self) -> Self:
        given = [values for values in (self.torque, self.brake, self.slip) if values is not None]
        if len(given) != 1:
            raise ValueError("give one of torque, brake and slip")
        _check_knots(self.time, given[0], "torque, brake or slip")
        return self


def speed_tables(
    speed: Constant | Profile | Driven, traction: tuple[Traction, ...], wheelsets: int, duration: float
) -> SpeedTables:
    """Everything on one common set of knots."""
    time, values = speed.knots(duration)
    knots = np.unique(np.concatenate([time, *(t.time for t in traction), [0.0]]))
    torque, slip, brake = np.zeros((3, len(knots), wheelsets))
    for entry in traction:
        for total, given in ((torque, entry.torque), (slip, entry.slip), (brake, entry.brake)):
            if given is not None:
                total[:, entry.wheelset - 1] += np.interp(knots, entry.time, given)
    resistance = np.array(speed.resistance if isinstance(speed, Driven) else (0.0, 0.0, 0.0))
    return SpeedTables(
        knots, np.interp(knots, time, values), torque, slip, brake, isinstance(speed, Driven), resistance
    )


def _check_knots(time: tuple[float, ...], values: tuple[float, ...], what: str) -> None:
    if len(time) != len(values) or len(time) < 1:
        raise ValueError(f"time and {what} need the same number of values, one or more")
    if any(b <= a for a, b in zip(time, time[1:], strict=False)):
        raise ValueError("time must increase")
