"""Line speed by place: stated as a number or a table, or, where nobody states it, the speed that was travelled."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from experiments.maintenance.kilometre import Kilometre
from experiments.reporting.units import KMH
from railsim.errors import InputError

FROM, FROM_KM, SPEED = "from [m]", "from [km]", "line speed [km/h]"


@dataclass(frozen=True)
class LineSpeed:
    """Line speed over the estimate's distance.

    Attributes
    ----------
    source : where it comes from, in words.
    starts : places from which the speeds hold, rising, m, or kilometres of the line where `along` is given; None: the
        speed travelled counts.
    speeds : km/h, shape of `starts`.
    along : kilometrage in which the places are; None: in m of the estimate.
    """

    source: str
    starts: np.ndarray | None = None
    speeds: np.ndarray | None = None
    along: Kilometre | None = None

    def at(self, distance: np.ndarray, time: np.ndarray) -> np.ndarray:
        """km/h at places that were passed at times, shape (n,); NaN before the first stated place."""
        if self.starts is None or self.speeds is None:
            if len(distance) < 2:
                return np.zeros(len(distance))
            return KMH * np.gradient(distance, time)
        places = distance if self.along is None else np.round(self.along.of(distance), 9)
        row = np.searchsorted(self.starts, places, side="right") - 1
        return np.where(row >= 0, self.speeds[np.maximum(row, 0)], np.nan)


TRAVELLED = LineSpeed("no line speed is stated: limits go by the speed travelled")


def line_speed(given: str | None, along: Kilometre | None = None) -> LineSpeed:
    """What an option states: nothing, km/h everywhere, or a CSV file with `FROM` or `FROM_KM`, and `SPEED`.

    Parameters
    ----------
    along : kilometrage of the line, for places in kilometres.

    Raises
    ------
    InputError : the file cannot be read, or places do not rise, or a speed is no speed.
    """
    if given is None:
        return TRAVELLED
    try:
        speed = float(given)
    except ValueError:
        return _table(Path(given), along or Kilometre())
    _check(np.array([speed]), "--line-speed")
    return LineSpeed(f"line speed {speed:g} km/h everywhere, as stated", np.array([-np.inf]), np.array([speed]))


def _table(path: Path, along: Kilometre) -> LineSpeed:
    try:
        table = pd.read_csv(path, comment="#")
        place = FROM_KM if FROM_KM in table.columns else FROM
        starts, speeds = (table[name].to_numpy(dtype=float) for name in (place, SPEED))
    except OSError as error:
        raise InputError(
            f"--line-speed: cannot read '{path}': {error.strerror}; give km/h or the path of a CSV file"
        ) from None
    except (KeyError, ValueError):
        raise InputError(
            f"--line-speed: '{path}' must be a CSV file with the columns '{FROM}' or '{FROM_KM}', and '{SPEED}'"
        ) from None
    if not starts.size or not np.isfinite(starts).all() or (np.diff(starts) <= 0.0).any():
        raise InputError(f"--line-speed: '{place}' in '{path}' must rise from row to row; sort or mend the rows")
    _check(speeds, f"--line-speed: '{path}'")
    if place == FROM_KM and not along.known:
        raise InputError(
            f"--line-speed: '{path}' has places in kilometres of the line; add --kilometre KM, that at s = 0"
        )
    return LineSpeed(f"line speed by place from '{path.name}'", starts, speeds, along if place == FROM_KM else None)


def _check(speeds: np.ndarray, where: str) -> None:
    if not ((speeds > 0.0) & (speeds < 1000.0)).all():
        raise InputError(f"{where}: a line speed is between 0 and 1000 km/h; correct it")
