"""Limits of track geometry by line speed: levels of isolated defects (EN 13848-5), quality classes (EN 13848-6)."""

from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Self

import numpy as np
import pydantic

from experiments.reporting.units import MM
from railsim.errors import InputError
from railsim.settings import load_yaml
from railsim.spec import Spec

LEVELS = ("", "alert", "intervention", "immediate action")
"""Names of the levels by the number of limits that are exceeded."""
CLASSES = "ABCDE"
CLASS_SECTION = 200.0
"""m; the standard deviation by which a class is told is that of such a section."""
_RAILS = ("left_", "right_")


class BandLimits(Spec, frozen=True):
    """Limits of one band of a quantity, mm or mm/m, each list rising.

    Attributes
    ----------
    peaks : alert, intervention and immediate action limit of an isolated defect, from the mean to the peak.
    classes : largest standard deviation of the classes A, B, C and D; None where the band has no classes.
    """

    peaks: tuple[float, float, float]
    classes: tuple[float, float, float, float] | None = None

    @pydantic.model_validator(mode="after")
    def _rising(self) -> Self:
        for limits in (self.peaks, self.classes or ()):
            if any(np.diff([0.0, *limits]) <= 0.0):
                raise InputError(f"limits must be positive and rise, not {', '.join(f'{one:g}' for one in limits)}")
        return self


class QuantityLimits(Spec, frozen=True):
    """Limits by band; None where there are none."""

    d1: BandLimits | None = None
    d2: BandLimits | None = None
    d3: BandLimits | None = None


class SpeedLimits(Spec, frozen=True):
    """Limits up to a line speed.

    Attributes
    ----------
    up_to : km/h.
    vertical, lateral : longitudinal level and alignment.
    twist : over the base of the estimate (3 m).
    """

    up_to: float = pydantic.Field(gt=0.0)
    vertical: QuantityLimits = QuantityLimits()
    lateral: QuantityLimits = QuantityLimits()
    twist: BandLimits | None = None


class Limits(Spec, frozen=True):
    """Limits of all speeds; those of the highest go on beyond it.

    Attributes
    ----------
    source : where they come from.
    speeds : by rising line speed.
    """

    source: str
    speeds: tuple[SpeedLimits, ...] = pydantic.Field(min_length=1)

    @pydantic.model_validator(mode="after")
    def _rising(self) -> Self:
        if any(np.diff([one.up_to for one in self.speeds]) <= 0.0):
            raise InputError("speeds: 'up_to' must rise from entry to entry")
        return self

    def peaks(self, name: str, speed: np.ndarray) -> np.ndarray | None:
        """Alert, intervention and immediate action limit of a column, m or m/m, at speeds in km/h, shape (n, 3); NaN
        where a speed has none, None where no speed has one.
        """
        found = [self._of(one, name) for one in self.speeds]
        table = np.array([one.peaks if one else (np.nan,) * 3 for one in found]) / MM
        return None if np.isnan(table).all() else table[self._row(speed)]

    def quality(self, name: str, deviation: float, speed: float) -> str:
        """Class of a standard deviation in mm; "" where there are no classes or no number."""
        found = self._of(self.speeds[int(self._row(np.array([speed]))[0])], name)
        if found is None or found.classes is None or not np.isfinite(deviation):
            return ""
        return CLASSES[int(np.searchsorted(found.classes, deviation))]

    def _row(self, speed: np.ndarray) -> np.ndarray:
        """Entry of each speed; one that is not known counts as the fastest, whose limits are the tightest."""
        known = np.where(np.isfinite(speed), speed, np.inf)
        return np.minimum(np.searchsorted([one.up_to for one in self.speeds], known), len(self.speeds) - 1)

    @staticmethod
    def _of(one: SpeedLimits, name: str) -> BandLimits | None:
        quantity, band = split(name)
        for rail in _RAILS:
            quantity = quantity.removeprefix(rail)
        if quantity == "twist":
            return one.twist
        limits = {"vertical": one.vertical, "lateral": one.lateral}.get(quantity)
        return None if limits is None or not band else getattr(limits, band.lower())


def split(name: str) -> tuple[str, str]:
    """(quantity, band) of a column: "left_vertical_d1 [m]" gives ("left_vertical", "D1"), "twist [m/m]" ("twist",
    "").
    """
    short = name.split(" ")[0]
    head, _, band = short.rpartition("_")
    return (head, band.upper()) if head and band in ("d1", "d2", "d3") else (short, "")


def read_limits(path: Path) -> Limits:
    """Limits of a YAML file.

    Raises
    ------
    InputError : it cannot be read or is not whole.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"--limits: cannot read '{path}': {reason}; give a YAML file") from None
    return Limits.build(load_yaml(text, f"'{path}'"), f"'{path}'")


@cache
def shipped() -> Limits:
    """The limits that come with railsim."""
    return Limits.build(load_yaml((files("experiments.maintenance") / "limits.yaml").read_text("utf-8"), "limits.yaml"))
