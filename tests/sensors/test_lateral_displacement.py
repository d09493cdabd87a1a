"""Lateral displacement transducer: difference of two bodies' positions."""

from pathlib import Path

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.sensors.lateral_displacement import LateralDisplacement
from tests.sensors.synthetic import times, write_truth


def test_body_to_the_left_counts_positive_and_yaw_counts_at_the_arm(tmp_path: Path) -> None:
    time = times(2.0)
    channels = {
        "body.y [m]": 3e-3 * np.sin(time),
        "wheelset1.y [m]": 1e-3 * np.cos(time),
        "body.yaw [rad]": 1e-3 * time,
    }
    truth = write_truth(tmp_path / "truth", channels)
    sensor = LateralDisplacement(name="side", rate=256.0)
    rng = np.random.default_rng(1)
    found = sensor.measure(truth, rng)["side.displacement [m]"].to_numpy()
    at = time[::4]
    np.testing.assert_allclose(found, 3e-3 * np.sin(at) - 1e-3 * np.cos(at), atol=1e-15)
    ahead = sensor.but(arm=1.5).measure(truth, rng)["side.displacement [m]"].to_numpy()
    np.testing.assert_allclose(ahead - found, 1.5e-3 * at, atol=1e-15)


def test_missing_body_is_named(tmp_path: Path) -> None:
    truth = write_truth(tmp_path / "truth")
    with pytest.raises(InputError, match="wheelset2.y"):
        LateralDisplacement(name="side", other="wheelset2", rate=256.0).measure(truth, np.random.default_rng(1))
