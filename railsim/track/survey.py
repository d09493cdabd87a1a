"""The track as a measuring train finds it: true geometry with that measurement's own errors."""

import numpy as np
import pandas as pd

from railsim.spec import Spec, quantity
from railsim.track.files import DISTANCE
from railsim.track.track import UNITS, Track

_SCENARIO = "scenario; 0 = measured without error"


class TrackErrors(Spec, frozen=True):
    """White errors of a track measurement, standard deviation of each row; columns that the track lacks stay away."""

    vertical_std: float = quantity(0.0, unit="m, vertical columns", source=_SCENARIO, ge=0.0)
    lateral_std: float = quantity(0.0, unit="m, lateral columns", source=_SCENARIO, ge=0.0)
    cross_level_std: float = quantity(0.0, unit="m, cant and cross level", source=_SCENARIO, ge=0.0)
    gauge_std: float = quantity(0.0, unit="m, gauge deviation", source=_SCENARIO, ge=0.0)
    curvature_std: float = quantity(0.0, unit="1/m, curvature", source=_SCENARIO, ge=0.0)


_ERROR_OF = {
    "curvature": "curvature_std",
    "cant": "cross_level_std",
    "cross_level": "cross_level_std",
    "gauge_deviation": "gauge_std",
    "vertical": "vertical_std",
    "left_vertical": "vertical_std",
    "right_vertical": "vertical_std",
    "lateral": "lateral_std",
    "left_lateral": "lateral_std",
    "right_lateral": "lateral_std",
}


def error_of(errors: TrackErrors, column: str) -> float:
    """Standard deviation of a column's rows, in its unit; 0 for one that is measured without error."""
    return float(getattr(errors, _ERROR_OF.get(column, ""), 0.0))


def survey(track: Track, errors: TrackErrors, rng: np.random.Generator) -> pd.DataFrame:
    """What a measuring train hands over: the geometry's columns with errors; friction and stiffness it cannot see."""
    table = {DISTANCE: track.s}
    for key, column in track.columns().items():
        if key in _ERROR_OF or key == "gradient":
            noise = rng.standard_normal(column.size)
            table[f"{key} [{UNITS[key]}]"] = column + noise * error_of(errors, key)
    return pd.DataFrame(table)
