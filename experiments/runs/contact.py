"""Runs of the single wheelset that figures of section 4.3 share: for each seed another track, vehicle and wear.

What is true differs from what is known: the vehicle's parameters by a few per cent, the friction, the track by its
seed, the wheels by their wear. The recording's about.json holds the nominal vehicle with new wheels.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from railsim import load_scenario, measure, simulate
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.scratch import scratch_folder
from railsim.track.featured import main_line
from railsim.track.files import write_track
from railsim.track.track import Track
from railsim.truth import Truth

SPREAD = 0.03
"""Standard deviation of the true parameters about the nominal ones (-)."""
FRICTION = 0.05
"""Standard deviation of the true friction (-)."""
RADIUS = 0.003
"""Standard deviation of the wheel's radius error (-)."""
PARAMETERS = (
    "wheelset_mass",
    "wheelset_yaw_inertia",
    "suspended_mass",
    "lateral_stiffness",
    "lateral_damping",
    "yaw_stiffness",
)
SHORTEST = 100.0  # m more than the run needs


@dataclass(frozen=True)
class Case:
    """One run.

    Attributes
    ----------
    seed : of track, vehicle and sensors. speed : m/s, or knots (time s, speed m/s). duration : s.
    wear : severity. gauge : nominal gauge of the track, m: conicity falls as it grows.
    gauge_variation, lateral_variation : factors of the track's 2 mm. stretch : factor of its wavelengths, which moves
    the corners of its spectrum. spread : of the parameters (-). ideal : sensors without errors. cone : conicity of
    cones in the place of profiles, true and stated; wear and gauge do not change them.
    """

    seed: int
    speed: float = 30.0
    duration: float = 60.0
    wear: float = 0.0
    gauge: float = 1.435
    gauge_variation: float = 1.0
    spread: float = SPREAD
    ideal: bool = False
    lateral_variation: float = 1.0
    stretch: float = 1.0
    cone: float | None = None


def run(case: Case, engine: str = "exudyn") -> tuple[Truth, Measurements]:
    """Simulate and measure."""
    with scratch_folder() as folder:
        path = Path(folder) / "track.csv"
        write_track(_track(case.seed, case.gauge_variation, case.lateral_variation, case.stretch), path)
        true, known = _scenario(case, path, True), _scenario(case, path, False)
        truth = simulate(true, engine)
        return truth, measure(truth, known, case.seed).measurements


def _scenario(case: Case, track: Path, true: bool) -> Scenario:
    rng = np.random.default_rng([case.seed, 643])
    pair: dict[str, Any] = {"kind": "profiles", "wheel": "s1002", "rail": "uic60_40"}
    changes: dict[str, Any] = {
        "name": "contact",
        "track": str(track),
        "speed": {"kind": "constant", "speed": case.speed},
        "duration": case.duration,
    }
    factors = 1.0 + case.spread * rng.standard_normal(len(PARAMETERS))
    friction = 0.4 + FRICTION * rng.standard_normal() * (case.spread > 0.0)
    changes["sensors.2.radius_error"] = 0.0 if case.ideal else float(RADIUS * rng.standard_normal())
    plain = load_scenario("wheelset_new")
    if true:
        nominal = plain.vehicle.model_dump()
        changes |= {f"vehicle.{name}": nominal[name] * f for name, f in zip(PARAMETERS, factors, strict=True)}
        changes["vehicle.adhesion.friction"] = float(friction)
        pair |= {"wear": case.wear, "gauge": case.gauge}
    if case.cone is not None:
        pair = {"kind": "conical", "conicity": case.cone}
    if case.ideal:
        changes |= {f"sensors.{number}.errors": {} for number in (0, 1, 3, 4)}
    return load_scenario("wheelset_new", {**changes, "vehicle.pair": pair})


@lru_cache(maxsize=64)
def _track(seed: int, gauge_variation: float, lateral_variation: float, stretch: float) -> Track:
    """A realisation of the shipped track's spectrum that nothing was tuned on."""
    track = main_line(f"main_line_{seed}", 643_000 + seed)
    columns = dict(track.columns())
    columns["gauge_deviation"] = gauge_variation * columns["gauge_deviation"]
    columns["lateral"] = lateral_variation * columns["lateral"]
    return Track(stretch * track.s, columns, track.name, ["Another realisation of paddington_bristol_like."])


def ensemble(count: int, wears: tuple[float, float], gauges: tuple[float, float], first: int = 1) -> list[Case]:
    """Cases with seeds from `first` on, speeds from 20 to 45 m/s in turn, wear and gauge (m) spread over ranges."""
    speeds = (30.0, 20.0, 45.0, 25.0, 38.0)
    shares = np.linspace(0.0, 1.0, count)
    order = np.random.default_rng(643).permutation(count)
    return [
        Case(
            seed=first + number,
            speed=speeds[number % len(speeds)],
            wear=float(wears[0] + shares[number] * (wears[1] - wears[0])),
            gauge=float(gauges[0] + shares[order[number]] * (gauges[1] - gauges[0])),
        )
        for number in range(count)
    ]
