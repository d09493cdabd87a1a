"""Recordings of the single wheelset for figure 13 and `conicity_blind`: profiles, hidden parameters, many tracks.

The truth is the multibody model with Polach's creep forces on the profiles' tables. Its masses and stiffnesses differ
from the nominal ones of about.json by 3 % (standard deviation, by the seed), and about.json knows the wheels as they
were new.
"""

from pathlib import Path
from typing import Any

import numpy as np

from experiments.runs.rolling_radii import PAIR, START, track
from experiments.scoring.wheel_rail_truth import ContactTruth, contact_truth
from railsim import load_scenario, measure, simulate
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.scratch import scratch_folder
from railsim.track.files import write_track

HIDDEN = (
    "wheelset_mass",
    "wheelset_yaw_inertia",
    "suspended_mass",
    "lateral_stiffness",
    "lateral_damping",
    "yaw_stiffness",
)
SPREAD = 0.03  # standard deviation of the true parameters about the nominal ones


def record(
    wear: float, speed: float, duration: float, seed: int, gauge: bool, ideal: bool = False, engine: str = "compiled"
) -> tuple[ContactTruth, Measurements]:
    """One run over a track of its own seed.

    Parameters
    ----------
    wear : severity, 0 to 1. gauge : whether the gauge varies by 2 mm. ideal : sensors and survey without error.
    """
    shipped = load_scenario("wheelset_new").values()
    sensors = [{**sensor, "errors": {}} if ideal else sensor for sensor in shipped["sensors"]]
    with scratch_folder() as folder:
        path = Path(folder) / f"line_{seed}_{int(gauge)}.csv"
        write_track(track(seed, gauge), path)
        vehicle: dict[str, Any] = {"name": "wheelset", "pair": PAIR | {"wear": wear}}
        base = {
            "track": str(path),
            "track_errors": {} if ideal else shipped["track_errors"],
            "vehicle": vehicle,
            "speed": {"kind": "constant", "speed": speed},
            "start": START,
            "duration": duration,
            "sensors": sensors,
            "seed": seed,
        }
        nominal = Scenario.build(base)
        rng = np.random.default_rng([seed, 6])
        hidden = {name: getattr(nominal.vehicle, name) * (1 + SPREAD * rng.standard_normal()) for name in HIDDEN}
        truth = simulate(Scenario.build({**base, "vehicle": vehicle | hidden}), engine, f"{folder}/truth")
        measured = measure(truth, nominal).measurements
        return contact_truth(truth), measured
