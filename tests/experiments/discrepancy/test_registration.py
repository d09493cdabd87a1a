"""Lag over distance gives start and scale; neither a few wrong windows nor channels that do not follow matter."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from experiments.discrepancy.railway.build import along_coordinates, recorded_speed
from experiments.discrepancy.railway.cases import ALL, as_measured, nominal
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.registration import register, robust_line
from experiments.discrepancy.railway.settings import settings
from experiments.discrepancy.railway.specimens import build_specimen
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.scenario import Scenario


def test_offset_and_slope_despite_wrong_windows():
    rng = np.random.default_rng(4)
    x = np.linspace(0.0, 1500.0, 40)
    y = 0.7 + 0.004 * x + 0.01 * rng.standard_normal(40)
    y[[5, 20, 33]] += 6.0
    offset, slope = robust_line(x, y, np.ones(40))
    assert abs(offset - 0.7) < 0.05
    assert abs(slope - 0.004) < 1e-4


def test_vertical_channels_that_show_joints_alone_leave_it_to_the_lateral_ones():
    told = nominal(sensors=ALL)
    joints = {"kind": "rail_joints", "depth": 8e-3, "spacing": 18.8, "first": told.start}
    true = Scenario.build(told.values() | {"effects": [joints], "start": told.start + 1.5})
    found = register(evidence_of(as_measured(true, told, "compiled"), told))
    assert abs(found.start - true.start) < 0.1


def _places(setting: str, build: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far a vehicle within its tolerances is misplaced [m] by its tachometer, as registered, and by one spread of
    how its wheel rolls more; start and scale of the speed are open, as they are to the inference.
    """
    told = settings()[setting].nominal
    true = build_specimen(told, (), np.random.default_rng([99, build]))
    record = Record(evidence_of(as_measured(true, told, "compiled"), told))
    time = np.arange(0.0, record.evidence.duration, 0.01)
    gone = true.start + time * float(true.speed.knots(1.0)[1][0])

    def misplaced(at: np.ndarray, speed: np.ndarray) -> np.ndarray:
        way = cumulative_trapezoid(np.interp(time, at, speed), time, initial=0.0)
        return way - gone - np.polyval(np.polyfit(way, way - gone, 1), way)

    spread = next(one.spread for one in along_coordinates(record) if one.name == "rolling")
    more = recorded_speed(record, {"rolling": spread})
    registered = misplaced(*record.speed)
    by_spread = misplaced(np.array(more.time), np.array(more.speed)) - registered
    return misplaced(*record.evidence.speed[:2]), registered, by_spread


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("build", [3, 4])  # by FASTSIM and by Polach's law
def test_how_the_wheel_rolls_in_a_curve_is_no_speed_of_the_vehicle(build: int):
    by_wheel, registered, by_spread = _places("curve", build)
    left = registered - by_spread * (registered @ by_spread) / (by_spread @ by_spread)
    assert _rms(by_wheel) > 15e-3
    assert _rms(registered) < _rms(by_wheel) / 3.0
    assert _rms(left) < 2e-3


def test_on_straight_track_the_wheel_tells_the_speed():
    by_wheel, registered, by_spread = _places("home", 2)
    assert _rms(registered) < _rms(by_wheel) < 0.4e-3
    assert _rms(by_spread) < 0.1e-3
