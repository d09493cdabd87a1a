"""Recordings for the tests of the suspension estimators."""

from functools import lru_cache

import numpy as np
import pandas as pd

from railsim import load_scenario, measure, simulate
from railsim.measurements import Measurements
from railsim.recording import Recording


@lru_cache(maxsize=4)
def recording(seconds: float = 20.0, lateral_damping: float = 20e3, seed: int = 1) -> Recording:
    """The shipped scenario, shorter, by the compiled engine; the nominal damper stays 20 kN s/m in about.json."""
    changes = {"duration": seconds, "vehicle.secondary_lateral_damping": lateral_damping}
    scenario = load_scenario("suspension", changes)
    found = measure(simulate(scenario, engine="compiled"), scenario, seed=seed)
    about = found.measurements.about
    vehicle = {**about["vehicle"], "secondary_lateral_damping": 20e3}
    nominal = changed(found.measurements, about={**about, "vehicle": vehicle})
    return Recording(found.folder, nominal, found.truth)


def changed(
    measurements: Measurements,
    values: dict[str, np.ndarray] | None = None,
    without: tuple[str, ...] = (),
    about: dict | None = None,
    track: pd.DataFrame | None = None,
) -> Measurements:
    """The same with other values of some channels, or without them, or with another track."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in measurements:
        if name in without:
            continue
        table = tables.setdefault(measurements.rate(name), {"time [s]": measurements.time(name)})
        table[name] = (values or {}).get(name, measurements[name])
    return Measurements(about or measurements.about, tables, measurements.track if track is None else track)
