"""The fused estimate on runs of the compiled engine: accuracy, honesty, mirror image, gaps and stops."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimators.track.track_smoother import TrackSmoother
from experiments.scoring.track import band_errors
from railsim import measure, simulate
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.truth import Truth

MIRRORED = ("acceleration_y", "rate_roll", "rate_yaw")


@pytest.fixture(scope="module")
def run() -> tuple[Truth, Measurements]:
    """20 s at 30 m/s with consumer-grade sensors."""
    common: dict[str, Any] = {"name": "bogie", "body": "bogie", "rate": 256, "errors": "mems"}
    sensors = [
        {"kind": "accelerometer", **common},
        {"kind": "gyro", **common},
        {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64},
    ]
    scenario = Scenario.build(
        {
            "track": "straight_erri_low",
            "vehicle": "manchester",
            "speed": {"kind": "constant", "speed": 30},
            "start": 25,
            "duration": 20,
            "seed": 7,
            "sensors": sensors,
        }
    )
    truth = simulate(scenario, "compiled")
    return truth, measure(truth, scenario).measurements


def _changed(measurements: Measurements, change: Any) -> Measurements:
    """The same recording with every channel passed through `change(name, values)`."""
    tables: dict[float, Any] = {}
    for name in measurements.channels:
        rate = measurements.rate(name)
        table = tables.setdefault(rate, {"time [s]": measurements.time(name)})
        table[name] = change(name, np.array(measurements[name]))
    return Measurements(measurements.about, {rate: pd.DataFrame(table) for rate, table in tables.items()})


def test_bands_are_as_accurate_as_stated(run: tuple[Truth, Measurements]):
    truth, measured = run
    estimate = TrackSmoother().estimate(measured)
    for quantity, band, limit in (
        ("vertical", "d1", 0.1),
        ("vertical", "d2", 0.2),
        ("cross_level", "d1", 0.3),
        ("left_vertical", "d1", 0.3),
        ("right_vertical", "d1", 0.3),
    ):
        rows = band_errors(estimate, truth, quantity, band)
        error = 1e3 * (rows["estimated [m]"] - rows["true [m]"])
        assert len(rows) > 1000
        assert np.sqrt(np.mean(error**2)) < limit, (quantity, band)
        assert np.mean(np.abs(error) < 2e3 * rows["std [m]"]) > 0.85, (quantity, band)
        assert np.mean(1e3 * rows["std [m]"]) < limit, (quantity, band)


def test_mirrored_recording_gives_the_mirror_image(run: tuple[Truth, Measurements]):
    _, measured = run
    plain = TrackSmoother().estimate(measured).series
    mirrored = _changed(measured, lambda name, v: -v if any(part in name for part in MIRRORED) else v)
    image = TrackSmoother().estimate(mirrored).series
    inside = slice(400, -400)
    for name, other, sign in (
        ("vertical", "vertical", 1.0),
        ("cross_level", "cross_level", -1.0),
        ("left_vertical", "right_vertical", 1.0),
    ):
        np.testing.assert_allclose(image[f"{other}_d1 [m]"][inside], sign * plain[f"{name}_d1 [m]"][inside], atol=1e-9)


def test_lost_samples_are_marked_and_uncertain(run: tuple[Truth, Measurements]):
    _, measured = run

    def lose(name: str, values: np.ndarray) -> np.ndarray:
        time = measured.time(name)
        lost = (time > 9.0) & (time < 10.0) & name.startswith("bogie")
        return np.where(lost, np.nan, values)

    whole = TrackSmoother().estimate(measured).series
    series = TrackSmoother().estimate(_changed(measured, lose)).series
    time = series["time [s]"].to_numpy()
    gap = (time > 9.1) & (time < 9.9)
    far = np.abs(time - 9.5) > 5.0
    assert not series["valid [-]"].to_numpy()[gap].any()
    assert np.isfinite(series["vertical [m]"].to_numpy()).all()
    spread, before = (one["vertical_d1_std [m]"].to_numpy() for one in (series, whole))
    assert spread[gap].max() > 5.0 * before[gap].max()
    np.testing.assert_allclose(spread[far], before[far], rtol=0.3)  # what is found of the vehicle changes a little


def test_missing_parameter_is_named(run: tuple[Truth, Measurements]):
    _, measured = run
    about = measured.about | {"vehicle": {k: v for k, v in measured.vehicle.items() if k != "bogie_mass"}}
    tables = {
        measured.rate(name): pd.DataFrame(
            {"time [s]": measured.time(name)}
            | {other: measured[other] for other in measured.channels if measured.rate(other) == measured.rate(name)}
        )
        for name in measured.channels
    }
    with pytest.raises(InputError, match="bogie_mass"):
        TrackSmoother().estimate(Measurements(about, tables))
