"""Runs of the figure `axlebox_range`: what each error of a ±100 g axlebox accelerometer leaves of long waves.

The simulated wheelset moves below some 300 Hz on a smooth rail. What shakes a real axlebox beyond that is added to its
specific force: vibration of service, and an impact at every rail joint. Both move the axlebox by next to nothing in the
band of long waves, so that all error there is the sensor's.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.signal import butter, sosfilt

from estimators.track.axlebox_profile import AxleboxProfile
from experiments.reporting.units import MM
from experiments.runs.track_accuracy import START
from experiments.scoring.track import band_errors
from railsim import measure, simulate
from railsim.analysis.statistics import root_mean_square
from railsim.constants import GRAVITY
from railsim.scenario import Scenario
from railsim.track.joints import RAIL_LENGTH
from railsim.truth import Truth

VEHICLE, TRACK, RATE = "manchester", "straight_erri_low", 2048
RANGE = 100.0 * GRAVITY
SPAN = 2.0 * RANGE
FASTEST = 45.0  # m/s at which the levels of vibration and impacts are stated; both go with the speed (illustrative)
SERVICE = 38.0
"""Vibration of an axle in service, m/s2 rms: illustrative, of the size of IEC 61373's functional level for what is
mounted on an axle; the standard's own table was not at hand.
"""
LOW, HIGH = 100.0, 500.0  # Hz, band of the vibration (illustrative)
UNEVEN, PATCH = 0.3, 30.0
"""How much, and over how many metres, the vibration changes along the rail: share of its level (illustrative)."""
PULSE = 1e-3  # s, standard deviation of the bump that a joint is (illustrative)
FORCE = "wheelset1.specific_force_z [m/s2]"


@dataclass(frozen=True)
class Case:
    """One error of the sensor.

    Attributes
    ----------
    errors : of `SensorErrors`, besides range and anti-aliasing filter. source : where its numbers come from.
    vibration, impacts : rms and peak at 45 m/s of what is added, m/s2.
    """

    errors: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""
    vibration: float = 0.0
    impacts: float = 0.0


def converter(bits: int) -> float:
    """Step of a converter over the range, m/s2."""
    return SPAN / 2.0**bits


IDEAL, ADDED = "ideal", "vibration and impacts, no range"
MODERN = "Silicon Designs 1521-100, data sheet (2025): 1 mg/sqrt(Hz)"
OLD = "Motorola XMMA1000P, data sheet: 3.5 mV rms at 40 mV/g, 10 to 400 Hz (a sensor of 50 g)"
SAFRAN = "Colibrys MS1100 (100 g), data sheet 2016: nonlinearity 0.3 % of full scale, taken as quadratic"
CASES: Mapping[str, Case] = {
    IDEAL: Case(),
    "noise, today": Case({"noise_density": 1e-3 * GRAVITY}, MODERN),
    "noise, of its day": Case({"noise_density": 4.4e-3 * GRAVITY}, OLD),
    "16 bit, quiet": Case({"resolution": converter(16)}, "over the range"),
    "12 bit, quiet": Case({"resolution": converter(12)}, "usual when the article was written (illustrative)"),
    "12 bit, vibration": Case({"resolution": converter(12)}, "the same, and vibration of service", SERVICE),
    "rectification": Case({"rectification": 0.003 / RANGE}, SAFRAN, SERVICE),
    "rectification, of its day": Case({"rectification": 0.01 / RANGE}, "XMMA1000P: nonlinearity 1 %", SERVICE),
    "thermal drift": Case(
        {"temperature_bias": 200e-6 * SPAN, "warming": 30.0, "warming_time": 600.0},
        "Silicon Designs 1521: 200 ppm of span a kelvin at most; 30 K in 10 minutes, as by brakes (illustrative)",
    ),
    "impacts of half the range": Case({"overload": RANGE}, "every 18.3 m (illustrative)", 0.0, 0.5 * RANGE),
    "impacts of the range": Case({"overload": RANGE}, "the same (illustrative)", 0.0, RANGE),
    "impacts of twice the range": Case({"overload": RANGE}, "the same (illustrative)", 0.0, 2.0 * RANGE),
    ADDED: Case({"range": None}, "what is added, by a sensor without a range", SERVICE, 2.0 * RANGE),
}
"""Each error on its own, on a sensor that has the range and nothing else."""


class Shaken(Truth):
    """A run whose leading wheelset is shaken besides."""

    def __init__(self, truth: Truth, added: np.ndarray) -> None:
        super().__init__(truth.folder, truth.rate, len(truth), truth.columns, truth.about)
        self._added = added

    def __getitem__(self, name: str) -> np.ndarray:
        """A channel; see `Truth`."""
        values = super().__getitem__(name)
        return values + self._added if name == FORCE else values


def rows(speed: float, length: float, engine: str, names: list[str], seeds: int) -> Iterator[dict[str, Any]]:
    """Errors of the long waves (D2) by every case at one speed, m/s, a row a specimen of the sensors."""
    duration = float(np.floor(length / speed))
    truth = simulate(_scenario(speed, duration, {}), engine=engine)
    for name in names:
        case = CASES[name]
        for seed in range(1, seeds + 1):
            shaken = Shaken(truth, added(truth, case, speed, np.random.default_rng([seed, 100])))
            measured = measure(shaken, _scenario(speed, duration, dict(case.errors)), seed).measurements
            estimate = AxleboxProfile(cut=70.0).estimate(measured)
            found = band_errors(estimate, truth, "vertical", "d2")
            error = (found["estimated [m]"] - found["true [m]"]).to_numpy()
            yield {
                "case": name,
                "speed [m/s]": speed,
                "seed": seed,
                "rms error [mm]": MM * root_mean_square(error),
                "true rms [mm]": MM * root_mean_square(found["true [m]"]),
            }


def added(truth: Truth, case: Case, speed: float, rng: np.random.Generator) -> np.ndarray:
    """What shakes the axlebox besides, m/s2, shape (n,): vibration that changes along the rail, impacts at joints."""
    time = truth.time
    distance = speed * (time - time[0])
    total = np.zeros_like(time)
    if case.vibration:
        sections = butter(2, (LOW, HIGH), "bandpass", fs=truth.rate, output="sos")
        white = sosfilt(sections, rng.standard_normal(time.size))
        knots = np.arange(0.0, distance[-1] + 2.0 * PATCH, PATCH)
        level = np.interp(distance, knots, np.exp(UNEVEN * rng.standard_normal(knots.size)))
        total += case.vibration * speed / FASTEST * level * white / root_mean_square(white)
    if case.impacts:
        for place in np.arange(RAIL_LENGTH, distance[-1], RAIL_LENGTH):
            late = ((distance - place) / speed / PULSE) ** 2
            total += case.impacts * speed / FASTEST * (1.0 - late) * np.exp(-0.5 * late)
    return total


def _scenario(speed: float, duration: float, errors: dict[str, Any]) -> Scenario:
    """Two axlebox accelerometers of the leading wheelset, and a tachometer without error."""
    suite: list[dict[str, Any]] = [
        {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.0}
    ]
    every = {"range": RANGE, "bandwidth": 400.0} | errors
    for side, y in (("left", 1.0), ("right", -1.0)):
        place = {"name": f"axlebox1_{side}", "body": "wheelset1", "position": [0, y, 0], "axes": ["z"]}
        suite.append({"kind": "accelerometer", **place, "rate": 1024, "errors": every})
    head = {"vehicle": VEHICLE, "speed": {"kind": "constant", "speed": speed}, "start": START, "seed": 3}
    return Scenario.build({**head, "track": TRACK, "duration": duration, "output_rate": RATE, "sensors": suite})
