"""GNSS: path of the antenna, noise, drift, latency, outages."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from railsim.sensors.gnss import Gnss
from railsim.truth import Truth
from tests.sensors.synthetic import times, write_truth

QUIET: dict[str, Any] = {"speed_std": 0, "position_std": 0, "height_std": 0, "drift_std": 0}
EAST, NORTH, UP = (f"gnss.position_{axis} [m]" for axis in ("east", "north", "up"))


def measure(truth: Truth, seed: int = 1, **settings: Any) -> pd.DataFrame:
    sensor = Gnss.build({"name": "gnss", "body": "body", "rate": 8.0} | settings)
    return sensor.measure(truth, np.random.default_rng(seed))


def circle(folder: Path, radius: float = 400.0, speed: float = 20.0) -> Truth:
    heading = speed / radius * times(20.0)
    path = {"position.east [m]": radius * np.sin(heading), "position.north [m]": radius * (1 - np.cos(heading))}
    return write_truth(folder, path, 20.0)


def test_antenna_runs_on_its_own_circle(tmp_path: Path) -> None:
    table = measure(circle(tmp_path / "truth"), position=(5, 1, 3.8), **QUIET)
    to_centre = np.hypot(table[EAST], table[NORTH] - 400)
    np.testing.assert_allclose(to_centre, np.hypot(399, 5), atol=1e-3)
    np.testing.assert_allclose(table[UP], 3.8)
    np.testing.assert_allclose(table["gnss.speed [m/s]"], 20)


def test_antenna_keeps_its_direction_at_a_standstill(tmp_path: Path) -> None:
    time = times(4.0)
    way = 20 * np.clip(time, 1, 3)
    path = {"position.east [m]": 0.6 * way, "position.north [m]": 0.8 * way}
    table = measure(write_truth(tmp_path / "truth", path, 4.0), position=(10, 0, 0), **QUIET)
    at = np.clip(table["time [s]"], 1, 3)
    np.testing.assert_allclose(table[EAST], 0.6 * (20 * at + 10), atol=1e-9)
    np.testing.assert_allclose(table[NORTH], 0.8 * (20 * at + 10), atol=1e-9)
    still = write_truth(tmp_path / "still", {"position.east [m]": 0 * time}, 4.0)
    np.testing.assert_array_equal(measure(still, position=(10, 0, 0), **QUIET)[EAST], 10.0)


def test_latency_delays_speed_and_position(tmp_path: Path) -> None:
    table = measure(write_truth(tmp_path / "truth", duration=10.0), errors={"latency": 0.3}, **QUIET)
    moving = table["time [s]"] > 0.5
    np.testing.assert_allclose(table[EAST][moving], 20 * (table["time [s]"][moving] - 0.3))


def test_noise_has_the_stated_deviation(tmp_path: Path) -> None:
    truth = write_truth(tmp_path / "truth", duration=200.0)
    table = measure(truth, drift_std=0, speed_std=0.2, position_std=0.5, height_std=2.0)
    for name, true, std in [("gnss.speed [m/s]", 20, 0.2), (NORTH, 0, 0.5), (UP, 0, 2.0)]:
        assert (table[name].to_numpy() - true).std() == pytest.approx(std, rel=5 / np.sqrt(2 * 1600))


def test_drift_is_slow(tmp_path: Path) -> None:
    settings: dict[str, Any] = {**QUIET, "drift_std": 1.5}
    north = measure(write_truth(tmp_path / "truth", duration=100.0), 1, **settings)[NORTH]
    steps = 1.5 * np.sqrt(2 / (8 * 60))
    assert np.diff(north.to_numpy()).std() == pytest.approx(steps, rel=5 / np.sqrt(2 * 800))


def test_outages_are_empty_and_change_nothing_else(tmp_path: Path) -> None:
    truth = write_truth(tmp_path / "truth", duration=10.0)
    whole, broken = measure(truth), measure(truth, outages=[(2, 3.5), (9, 99)])
    time = whole["time [s]"]
    lost = ((time >= 2) & (time < 3.5)) | (time >= 9)
    assert broken[lost].iloc[:, 1:].isna().all(axis=None)
    np.testing.assert_array_equal(broken[~lost], whole[~lost])
    with pytest.raises(ValueError, match="must end after it begins"):
        measure(truth, outages=[(3, 2)])
