"""The railway as a system of the inference: noise, survey, linear answers, predictions and library."""

import dataclasses

import numpy as np
import pytest

from experiments.discrepancy.core.levels import middles
from experiments.discrepancy.core.model import Hypothesis
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.railway.answers import Answers, opening
from experiments.discrepancy.railway.cases import ALL, nominal, recorded
from experiments.discrepancy.railway.creep_law import with_fastsim
from experiments.discrepancy.railway.library import found_library
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.survey import HIDDEN, Surveyed, sources, spectrum
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.engines.interface import LONGEST_STEP
from railsim.errors import InputError
from railsim.model import Load
from railsim.track.survey import TrackErrors
from railsim.track.track import Track


@pytest.fixture(scope="module")
def system() -> Railway:
    """Of a healthy vehicle as its data sheet says, but for tolerances."""
    return Railway(Record(evidence_of(recorded(np.random.default_rng(3), "home", ()), nominal())))


@pytest.fixture(scope="module")
def whole() -> Railway:
    """With all axes."""
    return Railway(Record(evidence_of(recorded(np.random.default_rng(4), "home", (), ALL), nominal("home", ALL))))


def test_frames_of_white_noise_have_its_density_at_any_rate(system: Railway) -> None:
    rng = np.random.default_rng(1)
    for rate in (256.0, 1024.0):
        noise = 3.0 * np.sqrt(rate) * rng.standard_normal(round(system.record.duration * rate))
        seen = system.record.framed(noise, rate)
        assert len(seen) == len(system.record.frequencies)
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
    shares = {one: surveyed.shares(one, 1.0, waves)["vertical"] for one in sources(surveyed.kinds())}
    ideal = 4e-6 * shape**2 / (4e-6 * shape**2 + 1e-8)  # share of the true spectra, not of the file's
    assert left < 0.6e-4
    assert left == pytest.approx(1e-4 * np.sqrt(ideal.mean()), rel=0.15)
    assert 1e-4 * np.sqrt(np.sum(list(shares.values()), axis=0).mean()) == pytest.approx(left, rel=0.2)
    assert list(shares) == ["vertical", "vertical" + HIDDEN]
    assert 0.0 < shares["vertical" + HIDDEN].mean() < 0.25 * shares["vertical"].mean()


@pytest.mark.parametrize("stiffness", [1.0, 0.5])  # of the primary springs, over the sheet's
def test_what_the_file_leaves_open_passes_to_the_channels_as_runs_over_such_tracks_say(
    system: Railway, stiffness: float
) -> None:
    """Errors drawn with their share as a filter along the track, simulated; no spectrum of answers. They pass through
    the vehicle as it is: with soft springs what they do to the nominal one would not do.
    """
    file, rng = system.record.surveyed, np.random.default_rng(5)
    track, (name,) = file.expected(dict.fromkeys(file.kinds(), 1.0)), file.columns("vertical")
    step = float(np.mean(np.diff(track.s)))
    share = file.shares("vertical", 1.0, np.fft.rfftfreq(len(track.s), step))[name]
    x, runs = system.middle, []
    x[[one.name for one in system.coordinates].index("log primary_vertical_stiffness")] = np.log(stiffness)
    setup, ahead = system.at(x, ())
    for _ in range(12):
        white = file.shaken(track, "vertical", name, system.record.registration.start + 12.0, rng).columns()[name]
        error = np.fft.irfft(np.fft.rfft(white - track.columns()[name]) * np.sqrt(share), len(track.s))
        runs.append(setup.but(track=Track(track.s, {**track.columns(), name: track.columns()[name] + error})))
    parts = system.shown([(one, ahead) for one in (setup, *runs)])
    seen = np.concatenate([np.abs(one[1:] - one[0]) ** 2 for one in parts], axis=2).mean(axis=(0, 2))
    level = [one.name for one in system.levels].index("survey vertical")
    said, nominal = (
        np.real(np.einsum("fcc->fc", system.covariances(at, ())[0][level])).mean(axis=0) for at in (x, system.middle)
    )
    loud = seen.mean(axis=0) > 10.0 * system.record.densities
    off, without = (np.abs(np.log(seen.mean(axis=0)[loud] / one[loud])).max() for one in (said, nominal))
    assert loud.any() and off < np.log(1.3)
    assert (without > np.log(1.5)) == (stiffness < 1.0)


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
    answers = Answers(told.model, 20.0, system.record.channels, f)
    vehicle, s = told.vehicle, 2j * np.pi * f
    of = {one.name: one for one in told.model.elements}
    secondary = of["secondary"].stiffness[2, 2] + s * of["secondary"].damping[2, 2]
    primary = sum(of[name].stiffness[2, 2] + s * of[name].damping[2, 2] for name in ("primary1", "primary2"))
    body, bogie = float(getattr(vehicle, "body_mass")), float(getattr(vehicle, "bogie_mass"))  # noqa: B009
    upper, lower = s**2 * body + secondary, s**2 * bogie + secondary + primary
    moved = (lower - secondary) / (upper * lower - secondary**2)
    place = [one.name for one in answers.places].index("secondary z")
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
    found = found_library(system, ("weak_vertical_damper", "sensor_gain", "payload", "gauge_variation"))
    faults = {effect.name: effect.faults for effect in found.library.effects}
    (damper,) = faults["weak_vertical_damper (bogie 1)"]
    assert damper.name == "log secondary_vertical_damping"
    logs = np.log(np.random.default_rng(1).uniform(size=100_000))
    assert (damper.mean, damper.spread) == pytest.approx((logs.mean(), logs.std()), abs=0.02)
    (gain,) = faults["sensor_gain (channel body.acceleration_z)"]
    assert gain.name == "gain body.acceleration_z [m/s2]"
    assert {one.split(":")[0] for one in found.left_out} >= {"payload", "gauge_variation"}


def test_answers_are_what_a_small_force_does_to_the_model(whole: Railway) -> None:
    """Random force across the secondary suspension, as loads on both bodies of the nonlinear model; 20 N move a wheel
    so little that twice the usual step would show.
    """
    fine = dataclasses.replace(whole.simulated, step=LONGEST_STEP)
    record, model = whole.record, whole.nominal.model
    rate, rng = record.scenario.output_rate, np.random.default_rng(5)
    count = round(record.duration * rate)
    spectrum = np.fft.rfft(rng.standard_normal(count)) * (np.fft.rfftfreq(count, 1.0 / rate) < 25.0)
    force = 20.0 * np.fft.irfft(spectrum, count)
    f, channels = record.frequencies, list(record.channels)
    band = (f > 2.0) & (f < 15.0)  # the body bounces at 1 Hz, and rings longer than a frame
    answers = Answers(model, 20.0, record.channels, f)
    for name, seen in (
        ("secondary y", ("body.acceleration_y [m/s2]", "bogie.acceleration_y [m/s2]")),
        ("secondary z", ("body.acceleration_z [m/s2]", "axlebox1_left.acceleration_z [m/s2]")),
    ):
        number = [one.name for one in answers.places].index(name)
        row = opening(model, answers.places[number])
        loads = tuple(
            Load(body, axis, "time", 0.0, 1.0 / rate, factor * force)
            for key, factor in row.items()
            for body, _, axis in [key.partition(".")]
        )
        moved = whole.nominal.modelled(lambda model, loads=loads: dataclasses.replace(model, loads=loads))
        (still,), (pushed,) = (fine.channels([(one, 0.0)]) for one in (whole.nominal, moved))
        expected = answers.forces[:, :, number][:, None] * record.framed(force, rate)[..., None]
        for channel in (channels.index(one) for one in seen):
            error, size = ((part[band][..., channel]) for part in (pushed - still - expected, expected))
            ratio = np.mean(np.abs(error) ** 2) / np.mean(np.abs(size) ** 2)
            assert np.sqrt(ratio) < 0.15, channels[channel]


def test_a_turned_sensor_shows_what_its_coordinates_say(whole: Railway) -> None:
    truth = whole.simulated.nominal_truth
    assert truth is not None
    (sensor,) = [one for one in whole.record.ideal if one.name == "bogie" and one.kind == "accelerometer"]
    turned = sensor.but(errors=sensor.errors.but(misalignment=(0.01, -0.02, 0.015)))
    shown = turned.measure(truth, np.random.default_rng(0))
    names = [one.name for one in whole.coordinates]
    x = np.zeros((1, len(names)))
    for axis, angle in zip("xyz", (0.01, -0.02, 0.015), strict=True):
        x[0, names.index(f"turn accelerometer bogie {axis}")] = angle
    (predicted,) = whole.predict(x, ())
    for name in ("bogie.acceleration_y [m/s2]", "bogie.acceleration_z [m/s2]"):
        seen = whole.record.framed(shown[name].to_numpy(), sensor.rate)
        mine = predicted[0, ..., list(whole.record.channels).index(name)]
        assert np.sqrt(np.mean(np.abs(seen - mine) ** 2) / np.mean(np.abs(seen) ** 2)) < 1e-3


def test_what_may_not_grow_is_varied_downwards(whole: Railway) -> None:
    place = [one.name for one in whole.coordinates].index("log adhesion.k_adhesion")  # 1 by the sheet, and 1 at most
    x, problem = np.zeros(len(whole.coordinates)), Problem(whole, Hypothesis(), Policy())
    (slope,) = problem.slopes(x, problem.groups(x, whole.covariances(x, ())))
    less = x.copy()
    less[place] = -0.02
    (changed,) = whole.predict(np.stack([x, less]), ())
    change = changed[1] - changed[0]
    off = np.abs(-0.02 * slope[place] - change) ** 2 / whole.record.densities
    assert np.sum(off) < 0.1 * np.sum(np.abs(change) ** 2 / whole.record.densities)


def test_frames_are_sorted_by_speed(system: Railway) -> None:
    evidence = system.record.evidence
    time = np.arange(0.0, 13.0, 0.5)
    speed = np.where(time < 7.0, 1.0, 0.0) * 12.0 + np.where(time < 7.0, 0.0, 1.0) * 24.0
    record = Record(dataclasses.replace(evidence, speed=(time, speed, 0.01)))
    slow, fast = record.sections
    assert record.speed_of(0) == pytest.approx(12.0) and record.speed_of(1) == pytest.approx(24.0)
    assert len(slow) + len(fast) == len(record.kept)
    still = Record(dataclasses.replace(evidence, speed=(time, np.where(time < 5.0, 0.0, 20.0), 0.01)))
    assert len(still.kept) < len(record.kept) and len(still.sections) == 1
    late = Record(dataclasses.replace(evidence, speed=(time, np.where(time < 4.0, 0.0, 20.0), 0.01)))
    assert late.kept.tolist() == [4, 5, 6, 7, 8]  # the model comes from another state until 6 s
    braking = Record(dataclasses.replace(evidence, speed=(time, np.interp(time, [2.0, 12.0], [24.0, 12.0]), 0.01)))
    speeds = [braking._speeds[braking.kept][part] for part in braking.sections]
    assert len(speeds) == 2 and min(len(one) for one in speeds) >= 4 and speeds[0].max() < speeds[1].min()
    assert np.array_equal(np.sort(np.concatenate(braking.sections)), np.arange(len(braking.kept)))


def test_runs_of_many_hypotheses_are_those_of_each(system: Railway) -> None:
    found = found_library(system, ("secondary_asymmetry", "weak_vertical_damper"))
    here = Railway(system.record, {}, found.makers, kept=system.kept)
    x, parts = np.zeros(len(here.coordinates)), []
    for effect in found.library.effects:
        parts.append((np.stack(effect.begins(x, here.coordinates)), (effect,)))
    together = here.predict_each(parts)
    for (points, effects), shown in zip(parts, together, strict=True):
        for row, point in enumerate(points):
            assert np.allclose(shown[0][row], here.predict(point[None], effects)[0][0], rtol=1e-6, atol=1e-9)


def test_a_recording_without_a_channel_to_compare_is_refused(system: Railway) -> None:
    evidence = dataclasses.replace(system.record.evidence, channels=("bogie.acceleration_x [m/s2]",))
    with pytest.raises(InputError, match="record a vertical or lateral"):
        _ = Record(evidence).channels


def test_a_long_record_is_compared_until_it_tells_enough(system: Railway, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = system.record.duration
    monkeypatch.setattr("experiments.discrepancy.railway.record.VALUES", 0)
    monkeypatch.setattr("experiments.discrepancy.railway.record.FRAMES", 4)
    evidence = system.record.evidence
    short = Record(evidence)
    assert (short.duration, short.whole) == (7.0, whole)
    assert short.seen == pytest.approx(system.record.seen[:, :4], rel=0.2, abs=1e-3 * np.abs(short.seen).max())
    time = np.array([0.0, 4.0, 4.1, 13.0])
    late = Record(dataclasses.replace(evidence, speed=(time, np.array([0.0, 0.0, 20.0, 20.0]), 0.01)))
    assert len(late.kept) == 4
    assert late.duration > 7.0


def test_the_track_is_cut_to_what_the_vehicle_passes(system: Railway) -> None:
    cut, file = system.simulated, system.record.surveyed
    whole = dataclasses.replace(cut, track=file.expected(dict.fromkeys(file.kinds(), 1.0)))
    assert cut.track.s[-1] - cut.track.s[0] < whole.track.s[-1] - whole.track.s[0]
    runs = [one.outputs([(one.setup({"body_mass": 0.1}, ()), 0.0)])[0] for one in (cut, whole)]
    assert runs[0] == pytest.approx(runs[1], rel=1e-4, abs=1e-4 * np.abs(runs[1]).max())


def test_runs_take_twice_the_step_where_the_channels_hardly_tell(
    whole: Railway, monkeypatch: pytest.MonkeyPatch
) -> None:
    """This record tells it by more than a hundred nats; where so many count as few, the longer step is taken."""
    usual = Railway(whole.record).simulated
    monkeypatch.setattr("experiments.discrepancy.railway.simulated.SLIGHT", 1e3)
    longer = Railway(whole.record).simulated
    assert usual.step == LONGEST_STEP and longer.step == 2.0 * LONGEST_STEP
    fine, coarse = (one.channels([(whole.nominal, 0.0)])[0] for one in (usual, longer))
    assert 0.0 < np.linalg.norm(coarse - fine) < 0.05 * np.linalg.norm(fine)


def test_a_sheet_with_fastsim_is_run_with_polachs_law_and_predicts_as_fastsim_does() -> None:
    told = nominal("home", ALL)
    sheet = told.but(vehicle=with_fastsim(told.vehicle))
    found = Railway(Record(evidence_of(recorded(np.random.default_rng(4), "home", (), ALL), sheet)))
    names = [one.name for one in found.coordinates]
    assert found.middle[names.index("creep law")] == 1.0
    assert found.nominal.vehicle == told.vehicle
    (predicted,) = found.predict(found.middle[None], ())
    (real,) = found.shown([(found.nominal.but(vehicle=sheet.vehicle), 0.0)])
    assert np.abs(predicted - real).max() < 1e-9 * np.abs(real).max()
    (polach,) = found.shown([(found.nominal, 0.0)])
    assert np.abs(polach - real).max() > 1e-3 * np.abs(real).max()
    twin = found_library(found, ["secondary_lateral_stiffness"]).library.effects[0]
    assert [one.name for one in twin.faults] == ["log secondary_lateral_stiffness"]
    elsewhere = found.middle.copy()
    elsewhere[names.index("log pair.conicity")] = 0.3
    before = _off_fastsim(found, elsewhere)
    assert found.settle(elsewhere)
    assert _off_fastsim(found, elsewhere) < 1e-9 < 0.02 < before
    about = found.kept["law change"]
    for name in ("pair.conicity", "adhesion.k_slip", "adhesion.friction", "primary_longitudinal_stiffness"):
        beside, place = elsewhere.copy(), names.index(f"log {name}")
        beside[place] += 0.5 * found.coordinates[place].spread
        found.kept["law change"] = dataclasses.replace(about, slopes={})
        alike = _off_fastsim(found, beside)
        found.kept["law change"] = about
        assert _off_fastsim(found, beside) < 0.5 * alike, name
    beyond = elsewhere.copy()
    beyond[names.index("log adhesion.k_adhesion")] = 0.1  # a factor that may be no larger
    assert _off_fastsim(found, beyond) < 1e-9


def _off_fastsim(system: Railway, x: np.ndarray) -> float:
    """Of what FASTSIM changes at x: how far the prediction there is from a run with FASTSIM."""
    over = system.about(x, (), None)
    assert isinstance(over, Railway)
    setup, ahead = over.at(x, ())
    (predicted,) = over.predict(x[None], ())
    (real,) = over.shown([(setup.but(vehicle=with_fastsim(setup.vehicle)), ahead)])
    (polach,) = over.shown([(setup, ahead)])
    return float(np.abs(predicted - real).max() / np.abs(polach - real).max())
