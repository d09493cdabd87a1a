"""Running stability against closed forms of sine waves."""

import numpy as np
import pytest

from estimators.ride.running_stability import CHANNEL, RunningStability, dominant_frequency, stability_limit
from railsim import InputError
from railsim.measurements import TIME, Measurements

RATE, SPEED = 256.0, 40.0
VEHICLE = {"bogie_mass": 3000.0, "wheelset_mass": 1500.0}


def record(size: float, frequency: float = 5.0, vehicle: dict[str, float] | None = None) -> Measurements:
    """A bogie that swings sideways at one frequency, m/s2, at 40 m/s for 20 s, with a curve's pull underneath."""
    time = np.arange(round(20.0 * RATE)) / RATE
    values = size * np.sin(2.0 * np.pi * frequency * time) + 0.5 * np.tanh(time - 10.0)
    sheet = {
        "kind": "accelerometer",
        "name": "bogie",
        "body": "bogie",
        "channels": [CHANNEL],
        "errors": {"noise_density": 0.01},
    }
    about = {"origin": "test", "vehicle": VEHICLE if vehicle is None else vehicle, "sensors": [sheet]}
    return Measurements(
        about, {RATE: {TIME: time, CHANNEL: values, "wheelset1.speed [m/s]": np.full(len(time), SPEED)}}
    )


def test_limit_is_that_of_the_standard() -> None:
    """EN 14363:2016, simplified method: (12 - 6 / 5) / 2 for a bogie of 6 t."""
    assert stability_limit(VEHICLE) == pytest.approx(5.4)


@pytest.mark.parametrize("frequency", [2.5, 5.0, 9.0])
def test_rms_of_a_sine(frequency: float) -> None:
    found = RunningStability().estimate(record(2.0, frequency))
    assert found.about["dominant frequency [Hz]"] == pytest.approx(frequency, abs=0.13)
    inner = found.series.iloc[2:-2]["instability [m/s2]"].to_numpy()
    assert inner == pytest.approx(2.0 / np.sqrt(2.0), rel=0.02)
    assert np.diff(found.series["s [m]"]) == pytest.approx(10.0)


@pytest.mark.parametrize(("size", "steady"), [(1.0, 1.0), (9.0, 0.0)])
def test_verdict(size: float, steady: float) -> None:
    assert (RunningStability().estimate(record(size)).series.iloc[2:-2]["steady [-]"] == steady).all()


def test_near_the_limit_nothing_is_said() -> None:
    at_limit = RunningStability().estimate(record(5.4 * np.sqrt(2.0)))
    sheet_error = at_limit.series["instability_std [m/s2]"].iloc[5]
    assert sheet_error > 0.0
    table = at_limit.series.iloc[5:-5]
    near = np.abs(table["instability [m/s2]"] - 5.4) < 2.0 * table["instability_std [m/s2]"]
    assert table["steady [-]"][near].isna().all()


def test_slow_motion_is_no_instability() -> None:
    found = RunningStability().estimate(record(0.0, vehicle=VEHICLE))
    assert found.series["instability [m/s2]"].to_numpy().max() < 0.2


def test_masses_are_needed() -> None:
    with pytest.raises(InputError, match="'bogie_mass', 'wheelset_mass'"):
        RunningStability().estimate(record(1.0, vehicle={}))


def test_dominant_frequency_of_nothing() -> None:
    assert dominant_frequency(np.zeros(2560), RATE, 2.0) == 2.0
