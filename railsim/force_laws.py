"""Force laws of nonlinear elements: what each is given, checked, and the numbers that the compiled kernels read.

A law opposes the elongation [m, rad] of its element and the rate of it; `railsim.dynamics.laws` evaluates it.
"""

import math
from dataclasses import astuple, dataclass, fields
from typing import ClassVar

import numpy as np

from railsim.errors import InputError

MOST_NUMBERS = 8  # numbers of a law in a kernel's row


@dataclass(frozen=True)
class ForceLaw:
    """Base of the laws: fields are floats, in the order in which they stand in the row that a kernel reads.

    Raises
    ------
    InputError : a number that is not finite, or out of its bounds.
    """

    code: ClassVar[int] = 0
    """By which the kernels know the law."""
    has_state: ClassVar[bool] = False
    """Whether the law has a state of its own, which is integrated with the motion."""

    not_negative: ClassVar[tuple[str, ...]] = ()
    positive: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        """Check the numbers."""
        title, scalars = type(self).__name__, {k: v for k, v in vars(self).items() if np.ndim(v) == 0}
        for name, value in scalars.items():
            if not math.isfinite(value):
                raise InputError(f"{title}: {name} must be a finite number, not {value}")
        for name in self.not_negative:
            if scalars[name] < 0.0:
                raise InputError(f"{title}: {name} must not be negative, but is {scalars[name]:g}")
        for name in self.positive:
            if scalars[name] <= 0.0:
                raise InputError(f"{title}: {name} must be above 0, but is {scalars[name]:g}")

    @classmethod
    def positions(cls) -> range:
        """Places of the fields in a kernel's row."""
        return range(len(fields(cls)))

    def numbers(self) -> tuple[float, ...]:
        """What stands in a kernel's row."""
        return astuple(self)


@dataclass(frozen=True)
class BumpStop(ForceLaw):
    """Nothing inside the gap, then linear plus cubic in what lies beyond it.

    `gap` [m], `stiffness` [N/m], `cubic_stiffness` [N/m3], `middle`: elongation at the middle of the gap [m].
    """

    gap: float
    stiffness: float
    cubic_stiffness: float
    middle: float = 0.0

    code: ClassVar[int] = 1
    not_negative: ClassVar[tuple[str, ...]] = ("gap", "stiffness", "cubic_stiffness")


@dataclass(frozen=True)
class Scheduled(ForceLaw):
    """Spring, damper and constant force that fade in from `onset` [s] over `ramp` [s]; there from the start where the
    onset is 0.

    `stiffness` [N/m] and `damping` [N s/m] are negative where they take away from a linear element beside them; `force`
    [N].
    """

    stiffness: float = 0.0
    damping: float = 0.0
    onset: float = 0.0
    ramp: float = 0.0
    force: float = 0.0

    code: ClassVar[int] = 2
    not_negative: ClassVar[tuple[str, ...]] = ("onset", "ramp")

    def __post_init__(self) -> None:
        """Check the numbers."""
        super().__post_init__()
        if self.onset > 0.0 and self.ramp == 0.0:
            raise InputError(f"{type(self).__name__}: a law with an onset needs a ramp above 0")


@dataclass(frozen=True)
class Maxwell(ForceLaw):
    """Spring of `stiffness` [N/m] in series with a damper of `damping` [N s/m]; its state is the spring's stretch."""

    stiffness: float
    damping: float

    code: ClassVar[int] = 3
    has_state: ClassVar[bool] = True
    positive: ClassVar[tuple[str, ...]] = ("stiffness", "damping")


@dataclass(frozen=True)
class DryFriction(ForceLaw):
    """Friction `force` [N] against the rate: force tanh(rate / slip), with `slip` [m/s] the rate over which it turns
    round.
    """

    force: float
    slip: float

    code: ClassVar[int] = 4
    not_negative: ClassVar[tuple[str, ...]] = ("force",)
    positive: ClassVar[tuple[str, ...]] = ("slip",)


@dataclass(frozen=True)
class BlowOff(ForceLaw):
    """What a damper of `damping` [N s/m] gives less beyond its blow-off `velocity` [m/s], where `damping_beyond`
    [N s/m] is left of it; the damper itself is a linear element.
    """

    damping: float
    damping_beyond: float
    velocity: float

    code: ClassVar[int] = 5
    not_negative: ClassVar[tuple[str, ...]] = ("damping", "damping_beyond", "velocity")


@dataclass(frozen=True)
class Damper(ForceLaw):
    """Damper of `damping` [N s/m] up to its blow-off `velocity` [m/s], and of `damping_beyond` [N s/m] for what lies
    beyond it.
    """

    damping: float
    damping_beyond: float
    velocity: float

    code: ClassVar[int] = 7
    not_negative: ClassVar[tuple[str, ...]] = ("damping", "damping_beyond")
    positive: ClassVar[tuple[str, ...]] = ("velocity",)


@dataclass(frozen=True)
class SeriesDamper(ForceLaw):
    """`Damper` in series with a spring of `stiffness` [N/m]; its state is the spring's stretch."""

    stiffness: float
    damping: float
    damping_beyond: float
    velocity: float

    code: ClassVar[int] = 8
    has_state: ClassVar[bool] = True
    positive: ClassVar[tuple[str, ...]] = ("stiffness", "damping", "damping_beyond", "velocity")


@dataclass(frozen=True, eq=False)
class Tabulated(ForceLaw):
    """Bilinear in elongation and rate, held beyond the edges.

    `table` (elongations, rates) [N, N m], at equal steps [m] and [m/s] from the first elongation and the first rate.
    """

    first_elongation: float
    elongation_step: float
    first_rate: float
    rate_step: float
    table: np.ndarray

    code: ClassVar[int] = 6
    positive: ClassVar[tuple[str, ...]] = ("elongation_step", "rate_step")

    def __post_init__(self) -> None:
        """Check the numbers and the table."""
        super().__post_init__()
        if self.table.ndim != 2 or min(self.table.shape) < 2 or not np.isfinite(self.table).all():
            raise InputError(
                f"{type(self).__name__}: the table needs at least 2 x 2 finite forces, not {self.table.shape}"
            )

    @classmethod
    def positions(cls) -> range:
        """Places of the four grid numbers, of the table's place among all tables, its rows and its columns."""
        return range(len(fields(cls)) + 2)

    def numbers(self) -> tuple[float, ...]:
        """The four grid numbers; where the table stands is added where the plant is built."""
        return self.first_elongation, self.elongation_step, self.first_rate, self.rate_step
