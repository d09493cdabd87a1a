"""The railway as a system of the inference: noise, survey, linear answers, predictions and library."""

import numpy as np
import pytest

from experiments.inference.levels import middles
from experiments.inference.railway.answers import Answers
from experiments.inference.railway.cases import nominal, recorded
from experiments.inference.railway.library import found_library
from experiments.inference.railway.record import Record, frames
from experiments.inference.railway.survey import HIDDEN, Surveyed, spectrum
from experiments.inference.railway.system import Railway
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.track.survey import TrackErrors
from railsim.track.track import Track


@pytest.fixture(scope="module")
def system() -> Railway:
    """Of a healthy vehicle as its data sheet says, but for tolerances."""
    return Railway(Record(recorded(np.random.default_rng(3), "home", ()), nominal()))


def test_frames_of_white_noise_have_its_density_at_any_rate(system: Railway) -> None:
    rng = np.random.default_rng(1)
    for rate in (256.0, 1024.0):
        noise = 3.0 * np.sqrt(rate) * rng.standard_normal(round(system.record.duration * rate))
        seen = system.record.framed("a", noise, rate)
        assert len(seen) == len(frames(256.0, system.record.duration).frequencies)
        assert np.mean(np.abs(seen) ** 2) == pytest.approx(9.0, rel=0.15)


def test_expected_track_is_nearer_than_its_file_and_draws_are_as_far_off_as_it() -> None:
    rng, step, count = np.random.default_rng(2), 0.2, 8192
    waves = np.fft.rfftfreq(count, step)
    shape = 1.0 / (1.0 + (waves / 0.05) ** 2)
    true = 2e-3 * np.fft.irfft(np.fft.rfft(rng.standard_normal(count)) * shape, count)
    file = Track(step * np.arange(count), {"vertical": true + 1e-4 * rng.standard_normal(count)}, "line")
    surveyed = Surveyed(file, TrackErrors(vertical_std=1e-4))
    inner = slice(250, -250)
    left = (surveyed.expected({"vertical": 1.0}).columns()["vertical"][inner] - true).std()
    expected = surveyed.expected({"vertical": 1.0}).columns()["vertical"]
    parts = [surveyed.drawn(kind, 1.0, rng).columns()["vertical"] - expected for kind in surveyed.sources()]
    drawn = np.sum(parts, axis=0)[inner].std()
    ideal = 4e-6 * shape**2 / (4e-6 * shape**2 + 1e-8)  # share of the true spectra, not of the file's
    assert left < 0.6e-4
    assert left == pytest.approx(1e-4 * np.sqrt(ideal.mean()), rel=0.15)
    assert drawn == pytest.approx(left, rel=0.2)
    assert surveyed.sources() == ("vertical", "vertical" + HIDDEN) and 0.0 < parts[1].std() < 0.5 * parts[0].std()


def test_a_track_s_spectrum_is_found_above_and_below_the_errors_of_its_file() -> None:
    """Of a power law of two bends, seen as independent lines: clear, and down to a hundredth of the errors."""
    rng = np.random.default_rng(4)
    waves = np.arange(1, 4097) / 1638.4
    true = 4e-6 / ((1.0 + (waves / 0.05) ** 2) * (1.0 + (waves / 0.2) ** 2))
    power = (true + 1e-8) * rng.exponential(size=(12, len(waves)))
    apart = np.array([np.log(spectrum(one, 1e-8) / true) for one in power])
    clear, faint = true > 1e-9, (true > 1e-10) & (true < 1e-9)
    assert clear.sum() > 500 and faint.sum() > 500
    assert np.sqrt(np.mean(apart[:, clear] ** 2)) < 0.25
    assert abs(apart[:, faint].mean()) < 0.5 and apart[:, faint].mean(axis=1).std() < 1.5


def test_answer_of_the_body_to_its_suspension_is_that_of_two_masses(system: Railway) -> None:
    """Bounce by hand: body and bogie on stiff wheels; the force acts upwards on the body, downwards on the bogie."""
    told, f = system.record.scenario, np.array([1.0, 3.0, 6.0, 10.0])
    answers = Answers.of(told.model, 20.0, system.record.channels, f)
    vehicle, s = told.vehicle, 2j * np.pi * f
    of = {one.name: one for one in told.model.elements}
    secondary = of["secondary"].stiffness[2, 2] + s * of["secondary"].damping[2, 2]
    primary = sum(of[name].stiffness[2, 2] + s * of[name].damping[2, 2] for name in ("primary1", "primary2"))
    body, bogie = float(getattr(vehicle, "body_mass")), float(getattr(vehicle, "bogie_mass"))  # noqa: B009
    upper, lower = s**2 * body + secondary, s**2 * bogie + secondary + primary
    moved = (lower - secondary) / (upper * lower - secondary**2)
    place = [one.name for one in answers.places].index("secondary")
    channel = list(system.record.channels).index("body.acceleration_z [m/s2]")
    errors = list(system.record.channels.values())[channel].errors
    assert errors.bandwidth is not None
    assert errors.bandwidth > 60.0
    assert np.abs(answers.forces[:, channel, place]) == pytest.approx(np.abs(s**2 * moved), rel=0.03)


def test_a_grid_finds_the_place_of_a_healthy_record(system: Railway) -> None:
    x = np.zeros(len(system.coordinates))
    (parts,) = system.covariances(x, ())
    assert parts.shape[0] == len(system.levels)
    starts = system.starts()[::3]
    (predicted,) = system.predict(starts, ())
    root = np.linalg.inv(np.linalg.cholesky(np.tensordot(np.exp(2.0 * middles(system.levels)), parts, 1)))
    white = np.einsum("fcd,rftd->rftc", root, system.record.seen - predicted)
    power = np.mean(np.abs(white) ** 2, axis=(1, 2, 3))
    names = [one.name for one in system.coordinates]
    best = starts[np.argmin(power)]
    assert abs(best[names.index("offset")]) < 0.6
    assert power.min() < 0.5 * np.median(power)


def test_gains_and_delays_take_no_runs(system: Railway) -> None:
    names = [one.name for one in system.coordinates]
    points = np.zeros((2, len(names)))
    points[1, names.index("gain body.acceleration_z [m/s2]")] = np.log(1.1)
    points[1, names.index("delay bogie.acceleration_z [m/s2]")] = 1e-3
    (seen,) = system.predict(points, ())
    channels = list(system.record.channels)
    body, bogie = channels.index("body.acceleration_z [m/s2]"), channels.index("bogie.acceleration_z [m/s2]")
    assert np.allclose(seen[1, ..., body], 1.1 * seen[0, ..., body])
    turned = np.exp(-2j * np.pi * 1e-3 * system.record.frequencies)[:, None]
    assert np.allclose(seen[1, ..., bogie], turned * seen[0, ..., bogie])


def test_a_damper_s_fault_is_its_tolerance_with_another_prior(system: Railway) -> None:
    found = found_library(system, ("weak_vertical_damper", "sensor_gain", "payload", "rail_joints"))
    faults = {effect.name: effect.faults for effect in found.library.effects}
    (damper,) = faults["weak_vertical_damper (bogie 1)"]
    assert damper.name == "log secondary_vertical_damping"
    assert damper.mean == pytest.approx(np.log(0.5))
    (gain,) = faults["sensor_gain (channel body.acceleration_z)"]
    assert gain.name == "gain body.acceleration_z [m/s2]"
    assert {one.split(":")[0] for one in found.left_out} >= {"payload", "rail_joints"}


def test_a_recording_without_vertical_channels_is_refused(system: Railway) -> None:
    measured = system.record.measured
    table = {"time [s]": np.arange(3000) / 256.0, "a.rate_yaw [rad/s]": np.zeros(3000)}
    with pytest.raises(InputError, match="record one of these"):
        _ = Record(Measurements(dict(measured.about), {256.0: table}, measured.track), nominal()).channels
