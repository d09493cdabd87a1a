"""Accelerometers and gyros on a moving rigid body, against derivatives of its analytic path."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from railsim.constants import GRAVITY
from railsim.sensors.accelerometer import Accelerometer
from railsim.sensors.errors import SensorErrors
from railsim.sensors.gyro import Gyro
from tests.sensors.synthetic import times, write_truth

PLACE = (1.25, -0.7, 0.4)
STENCIL = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
H = 2e-3


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def turn(time: np.ndarray) -> np.ndarray:
    """Orientation of a body that yaws, pitches and rolls by large angles, shape (n, 3, 3)."""
    angles = np.column_stack([0.8 * time, 0.3 * np.sin(2 * time), 0.4 * np.cos(3 * time)])
    return Rotation.from_euler("ZYX", angles).as_matrix()


def centre(time: np.ndarray) -> np.ndarray:
    return np.column_stack([20 * time + 0.1 * time**2, np.sin(2.1 * time), 0.2 * np.cos(5 * time)])


def derivative(path, time: np.ndarray) -> np.ndarray:
    """First derivative by the central difference of eighth order."""
    return np.sum([w * path(time + k * H) for w, k in zip(STENCIL, range(-4, 5), strict=True)], axis=0) / H


def spin(time: np.ndarray) -> np.ndarray:
    """Angular velocity in body axes, from R' = R [omega x]."""
    skew = np.einsum("nji,njk->nik", turn(time), derivative(turn, time))
    return np.column_stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]])


def felt(path, time: np.ndarray) -> np.ndarray:
    """Specific force of a point on `path` in body axes."""
    acceleration = derivative(lambda at: derivative(path, at), time)
    return np.einsum("nji,nj->ni", turn(time), acceleration + np.array([0, 0, GRAVITY]))


@pytest.fixture
def moving(tmp_path: Path):
    time = times(2.0)
    columns = {}
    for stem, unit, values in [
        ("specific_force", "m/s2", felt(centre, time)),
        ("angular_velocity", "rad/s", spin(time)),
        ("angular_acceleration", "rad/s2", derivative(spin, time)),
    ]:
        columns |= {f"bogie.{stem}_{axis} [{unit}]": values[:, k] for k, axis in enumerate("xyz")}
    return write_truth(tmp_path / "truth", columns)


@pytest.mark.parametrize("place", [PLACE, (1.25, 0, 0), (0, 0.9, 0), (0, 0, -0.3), (0, 0, 0)])
def test_accelerometer_feels_the_acceleration_of_its_own_place(moving, place: tuple[float, float, float]) -> None:
    sensor = Accelerometer(name="bogie", body="bogie", position=place, rate=128)
    table = sensor.measure(moving, rng())
    time = table["time [s]"].to_numpy()

    def path(at: np.ndarray) -> np.ndarray:
        return centre(at) + turn(at) @ np.array(place)

    np.testing.assert_allclose(table[sensor.channels()], felt(path, time), atol=2e-6)


def test_gyro_shows_the_body_rates(moving) -> None:
    sensor = Gyro(name="bogie", body="bogie", position=PLACE, rate=256)
    table = sensor.measure(moving, rng())
    assert sensor.channels() == [f"bogie.rate_{axis} [rad/s]" for axis in ("roll", "pitch", "yaw")]
    np.testing.assert_allclose(table[sensor.channels()], spin(table["time [s]"].to_numpy()), atol=1e-12)


def test_centripetal_term_of_a_steady_turn(tmp_path: Path) -> None:
    steady = np.full(2049, 3.0)
    truth = write_truth(tmp_path / "truth", {"bogie.angular_velocity_z [rad/s]": steady})
    table = Accelerometer(name="bogie", body="bogie", position=(2, 0, 0), rate=256).measure(truth, rng())
    np.testing.assert_allclose(table["bogie.acceleration_x [m/s2]"], -9.0 * 2)
    np.testing.assert_allclose(table["bogie.acceleration_y [m/s2]"], 0)
    np.testing.assert_allclose(table["bogie.acceleration_z [m/s2]"], GRAVITY)


def test_euler_term_of_a_pitch_acceleration(tmp_path: Path) -> None:
    truth = write_truth(tmp_path / "truth", {"bogie.angular_acceleration_y [rad/s2]": np.full(2049, 0.5)})
    table = Accelerometer(name="lead", body="bogie", position=(1.3, 0, 0), axes=("z",), rate=256).measure(truth, rng())
    np.testing.assert_allclose(table["lead.acceleration_z [m/s2]"], GRAVITY - 0.5 * 1.3)


def test_tilted_accelerometer_feels_gravity(tmp_path: Path) -> None:
    truth = write_truth(tmp_path / "truth")
    rolled = Accelerometer(name="a", body="body", rate=256, errors=SensorErrors(misalignment=(0.1, 0, 0)))
    table = rolled.measure(truth, rng())
    np.testing.assert_allclose(table["a.acceleration_x [m/s2]"], 0, atol=1e-12)
    np.testing.assert_allclose(table["a.acceleration_y [m/s2]"], GRAVITY * np.sin(0.1))
    np.testing.assert_allclose(table["a.acceleration_z [m/s2]"], GRAVITY * np.cos(0.1))


def test_cross_talk_adds_a_share_of_the_next_axis(moving) -> None:
    table = Gyro(name="a", body="bogie", rate=256, errors=SensorErrors(cross_talk=0.05)).measure(moving, rng())
    rates = spin(table["time [s]"].to_numpy())
    np.testing.assert_allclose(table.iloc[:, 1:], rates + 0.05 * rates[:, [1, 2, 0]], atol=1e-12)


def test_an_axis_does_not_depend_on_which_others_are_measured(tmp_path: Path) -> None:
    truth = write_truth(tmp_path / "truth")
    errors = SensorErrors(noise_density=0.01, bias_std=0.1, misalignment_std=0.01)
    everything = Accelerometer(name="a", body="body", rate=256, errors=errors).measure(truth, rng())
    only = Accelerometer(name="a", body="body", rate=256, axes=("z",), errors=errors).measure(truth, rng())
    np.testing.assert_array_equal(only["a.acceleration_z [m/s2]"], everything["a.acceleration_z [m/s2]"])
    assert len(np.unique(np.round(everything.iloc[:, 1:].std(), 9))) == 3


def test_axes_come_in_order_and_once() -> None:
    settings = {"name": "a", "body": "body", "rate": 1}
    assert Accelerometer.build(settings | {"axes": "zx"}).axes == ("x", "z")
    assert Gyro.build(settings | {"axes": "pitch"}).axes == ("pitch",)
    for wrong in ["zz", "q", [], 3]:
        with pytest.raises(ValueError, match="each once"):
            Accelerometer.build(settings | {"axes": wrong})
