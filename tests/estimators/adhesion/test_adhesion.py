"""Creep forces and adhesion level: against the contacts' own forces, against closed forms, with channels that fail."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.signal import csd

from estimators.adhesion.adhesion_creep_forces import AdhesionCreepForces
from estimators.adhesion.adhesion_creep_forces_profile import AdhesionCreepForcesProfile
from estimators.adhesion.adhesion_level import COLUMNS, AdhesionLevel
from estimators.adhesion.change_points import find_changes
from estimators.adhesion.channels import high_pass
from estimators.adhesion.classifier import LEVELS, classifier
from estimators.adhesion.creep_forces import RATE, SIGNALS, Segments
from estimators.adhesion.creep_law import LawShaping, with_law
from estimators.adhesion.creep_model import COUNT, Shaping, floating, parameters
from estimators.adhesion.features import SETS, features, features_of, names, windows
from experiments.runs.adhesion import run, scenario, sensors, spliced
from experiments.scoring.score import score
from railsim import InputError
from railsim.measurements import Measurements
from railsim.truth import Truth
from railsim.vehicles.class175 import Class175

P = parameters(Class175().nominal())
SPEED = 30.0
Runs = dict[str, tuple[Truth, Measurements]]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Runs:
    """Twenty-four seconds on dry rails and on very low adhesion, all sensors, no braking."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        found = {}
        for level in ("dry", "very low"):
            settings = {"track": "straight_erri_low", "vehicle": {"name": "class175", "adhesion": level}}
            found[level] = run(scenario(settings, SPEED, 24.0, sensors()), 3)
        return found


def changed(measured: Measurements, channel: str, values: np.ndarray | None) -> Measurements:
    """The same recording with other samples of one channel, or without it."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in measured.channels:
        table = tables.setdefault(measured.rate(name), {"time [s]": measured.time(name)})
        if name != channel:
            table[name] = measured[name]
        elif values is not None:
            table[name] = values
    return Measurements(measured.about, tables)


@pytest.mark.parametrize("level", ["dry", "very low"])
def test_forces_are_those_of_the_contacts(runs: Runs, level: str):
    truth, measured = runs[level]
    found = score(AdhesionCreepForces().estimate(measured), truth)
    for number in (1, 2):
        with_gravity = found[f"wheelset{number} lateral force rms error, gravity's included [N]"]
        moment = found[f"wheelset{number} yaw moment rms error [N m]"]
        assert with_gravity < 0.02 * P["design_wheel_load"]
        assert moment < 0.03 * P["design_wheel_load"]
    if level == "dry":
        assert moment < 0.5 * found["wheelset2 yaw moment true rms [N m]"]


def test_the_profile_takes_gravity_out(runs: Runs):
    truth, measured = runs["very low"]
    key = "wheelset1 lateral force rms error, creep alone [N]"
    floating_only = score(AdhesionCreepForces().estimate(measured), truth)[key]
    assert score(AdhesionCreepForcesProfile().estimate(measured), truth)[key] < 0.7 * floating_only


@pytest.mark.parametrize("wheelsets", [True, False])
@pytest.mark.parametrize("level", ["dry", "very low"])
def test_level_is_named_without_braking(runs: Runs, level: str, wheelsets: bool):
    measured = runs[level][1]
    for name in (
        [] if wheelsets else [name for name in measured.channels if name.startswith("wheelset") and "speed" not in name]
    ):
        measured = changed(measured, name, None)
    found = AdhesionLevel(hop=1.0).estimate(measured)
    assert set(found.series["wheelset_sensors [-]"].to_numpy(float)) == {float(wheelsets)}
    given = found.series[list(COLUMNS)].to_numpy(float)
    assert given.sum(axis=1) == pytest.approx(1.0)
    assert (given.argmax(axis=1) == LEVELS.index(level)).all()
    slope = found.series["creep_slope [-]"].to_numpy(float)
    assert np.median(slope) == pytest.approx({"dry": 0.7, "very low": 0.05}[level], rel=0.5)


def test_a_change_is_found_where_it_is(runs: Runs):
    before, after = runs["dry"][1], runs["very low"][1]
    changes = AdhesionLevel().estimate(spliced(before, after, 14.0)).about["changes"]
    assert [(one["before"], one["after"]) for one in changes] == [("dry", "very low")]
    assert changes[0]["time"] == pytest.approx(14.0, abs=5.0)


@pytest.mark.parametrize("fault", ["stuck", "lost", "saturated"])
def test_a_channel_that_is_bad_counts_as_absent(runs: Runs, fault: str):
    measured, channel = runs["dry"][1], "wheelset2.acceleration_y [m/s2]"
    limit = measured.sensor(channel)["errors"]["range"]
    values = np.full(len(measured[channel]), {"stuck": 0.2, "lost": np.nan, "saturated": limit}[fault])
    if fault == "saturated":
        values = values - 1e-9 * np.arange(len(values))  # at its limit, but not two samples alike
    for estimator in (AdhesionCreepForces(), AdhesionLevel(hop=2.0)):
        bad = estimator.estimate(changed(measured, channel, values))
        absent = estimator.estimate(changed(measured, channel, None))
        assert bad.series.equals(absent.series)
        assert any(channel in line for line in bad.about["warnings"])
        assert {entry["channel"] for entry in bad.about["left_out"]} == {channel}


def test_a_gap_is_bridged_by_the_other_channels(runs: Runs):
    truth, measured = runs["dry"]
    channel = "wheelset1.acceleration_y [m/s2]"
    time = measured.time(channel)
    values = np.where((time > 8.0) & (time < 9.0), np.nan, measured[channel])
    found = AdhesionCreepForces().estimate(changed(measured, channel, values))
    whole = AdhesionCreepForces().estimate(measured)
    std = "wheelset1.lateral_creep_force_std [N]"
    inside = found.series["time [s]"].between(8.5, 8.9).to_numpy()
    assert np.isfinite(found.series[std].to_numpy(float)[inside]).all()
    assert np.all(found.series[std].to_numpy(float)[inside] > whole.series[std].to_numpy(float)[inside])
    (entry,) = found.about["left_out"]
    assert entry["start [s]"] == pytest.approx(8.0, abs=0.1)
    assert 9.0 <= entry["end [s]"] + 1.0 / RATE <= 10.0  # what follows a long gap at once is not believed either
    key = "wheelset1 lateral force rms error, gravity's included [N]"
    assert score(found, truth)[key] < 1.5 * score(whole, truth)[key]


def test_without_a_speed_there_is_no_level(runs: Runs):
    measured = runs["dry"][1]
    for name in ("wheelset1.speed [m/s]", "wheelset1.wheel_speed [rad/s]", "wheelset1.position [m]"):
        measured = changed(measured, name, None)
    assert not AdhesionLevel().fits(measured)
    with pytest.raises(InputError, match="tachometer"):
        AdhesionLevel().estimate(measured)


def test_other_vehicles_have_no_calibration():
    with pytest.raises(InputError, match="an adhesion calibration for vehicle 'tram'"):
        classifier("tram", "bogie", 10.0)


def test_a_louder_track_shifts_logarithms_and_leaves_coherences():
    signals = np.random.default_rng(5).standard_normal((round(10.0 * RATE), len(SIGNALS)))
    for kind in SETS:
        quiet, loud = features(signals, kind, 10.0), features(3.0 * signals, kind, 10.0)
        shift = np.array([2.0 * np.log(3.0) if one.startswith("log") else 0.0 for one in names(kind, 10.0)])
        assert loud - quiet == pytest.approx(shift, abs=1e-9)
        assert len(quiet) == len(classifier("class175", kind, 10.0).mean)


def test_windows_do_not_reach_beyond_the_record():
    assert [(one.start, one.stop) for one in windows(3000, 10.0, 1.0)] == [(0, 2560), (256, 2816)]


def test_without_creep_and_slope_of_the_contact_the_law_floats():
    flat = {**P, "design_conicity": 1e-12, "design_contact_angle_rate": 1e-12}
    law, contact = with_law(flat, RATE, SPEED, 1e-12, 1.0, 0.3, LawShaping())
    bare = floating(flat, RATE, Shaping())
    assert law.acceleration[:, : 2 * COUNT + 5] == pytest.approx(bare.acceleration, rel=1e-6, abs=1e-3)
    assert contact.rows[:4, 2 * COUNT : 2 * COUNT + 4] == pytest.approx(np.eye(4))


def test_a_wheelset_aside_is_pushed_back_by_gravity_alone():
    """2 N e u for a shift u, and no creep force but spin's, 2 f23 e u / r the other way (Wickens 2003)."""
    _, contact = with_law(P, RATE, SPEED, 1e-9, 1.0, 0.3, LawShaping())
    aside = np.eye(len(contact.rows[0]))[0]
    gravity = -2.0 * P["design_wheel_load"] * P["design_contact_angle_rate"]
    assert contact.rows[4] @ aside == pytest.approx(gravity)
    assert contact.rows[0] @ aside == pytest.approx(0.0, abs=1e-3)


def test_high_pass_of_an_integral_is_that_of_what_was_differentiated():
    time = np.arange(0.0, 20.0, 1.0 / RATE)
    angle = np.sin(2.0 * np.pi * 1.3 * time) - time  # a drift, which a bias would leave
    rate = 2.0 * np.pi * 1.3 * np.cos(2.0 * np.pi * 1.3 * time) - 1.0
    late = time > 6.0
    assert high_pass(rate, 0.3, integrate=True)[late] == pytest.approx(high_pass(angle, 0.3)[late], abs=0.01)


def _steps(levels: list[int], hop: float) -> np.ndarray:
    given = np.full((len(levels), len(LEVELS)), 0.01)
    given[np.arange(len(levels)), levels] = 0.97
    return np.column_stack([hop * np.arange(len(levels)), given])


def test_a_passage_through_levels_in_between_is_one_change():
    long, short = _steps([0] * 20 + [1] * 8 + [2] * 20, 0.5), _steps([0] * 24 + [2] * 24, 0.5)
    (change,) = find_changes(long, short, 10.0)
    assert (change.before, change.after) == ("dry", "low")
    assert change.time == pytest.approx(11.75, abs=0.5)


def test_one_odd_window_is_no_change():
    assert find_changes(_steps([1] * 20 + [2] + [1] * 20, 0.5), _steps([1] * 41, 0.5), 10.0) == []
    assert find_changes(np.empty((0, 5)), np.empty((0, 5)), 10.0) == []


def test_windows_that_share_their_segments_have_the_features_of_each_by_itself():
    signals = np.random.default_rng(4).standard_normal((12 * 256, len(SIGNALS)))
    spans = windows(len(signals), 10.0, 0.5)
    together = features_of(signals, spans, "bogie", 10.0)
    assert len(spans) == 5
    for span, row in zip(spans, together, strict=True):
        np.testing.assert_array_equal(row, features(signals[span], "bogie", 10.0))


def test_cross_spectra_are_those_of_welch():
    """Against SciPy's; its zero frequency is not doubled."""
    mixed = np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 2.0], [0.0, 0.0, 1.0]])
    signals = np.random.default_rng(5).standard_normal((2000, 3)) @ mixed
    segments = Segments(signals, 256, highest=20.0)
    density = segments.density(100, 1900)
    window: Any = np.hanning(256)
    welch: Any = partial(csd, fs=256.0, window=window, nperseg=256, detrend="constant")
    seen = signals[100:1900]
    frequency = welch(seen[:, 0], seen[:, 0])[0]
    np.testing.assert_array_equal(segments.frequency, frequency[frequency < 20.0])
    for i in range(3):
        for j in range(3):
            expected = welch(seen[:, i], seen[:, j])[1][: len(segments.frequency)]
            np.testing.assert_allclose(density[1:, i, j], expected[1:], rtol=1e-10)
