"""How much a figure or a section of the validation report computes."""

from enum import Enum
from typing import TypeVar

T = TypeVar("T")


class Size(Enum):
    """Three sizes of the same computation, with the same columns.

    FULL is what the claims are about. FAST (`--fast`) takes less of it, by the compiled engine: seconds to minutes.
    SMOKE shows that all parts work, in seconds; its claims decide nothing.
    """

    FULL = "full"
    FAST = "fast"
    SMOKE = "smoke"

    @property
    def reduced(self) -> bool:
        """Whether less is computed than the claims are about."""
        return self is not Size.FULL

    def of(self, full: T, fast: T, smoke: T | None = None) -> T:
        """What belongs to this size; the smallest takes what belongs to the fast one where nothing less is given."""
        if self is Size.FULL:
            return full
        return fast if self is Size.FAST or smoke is None else smoke
