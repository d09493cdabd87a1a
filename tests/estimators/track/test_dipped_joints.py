"""Dipped joints: shapes against the track's own, curvature steps of a bogie without suspension, simulated runs."""

import numpy as np
import pytest

from estimators.track.dip_fit import find
from estimators.track.dipped_joints import DippedJoints
from estimators.track.dips import LENGTHS, Channel, channel, dip_transform, energy, lowest, rounding_gain, twice, window
from experiments.scoring.joints import JointScorer, matched, true_dips
from railsim import measure, simulate
from railsim.measurements import Measurements
from railsim.scenario import Scenario
from railsim.sensors.suite import measure_all
from railsim.simulation import about_recording
from railsim.track import Track, synthesis, write_track
from railsim.track.features import Feature, with_features
from railsim.track.joints import dip, dip_angle
from railsim.track.spectra import Band, spectra

SPACING = 0.125
BASE = 1.3
MEMS = [
    {"kind": "gyro", "name": "bogie", "body": "bogie", "axes": ["roll", "pitch"], "rate": 256, "errors": "mems"},
    {"kind": "accelerometer", "name": "bogie", "body": "bogie", "axes": ["z"], "rate": 256, "errors": "mems"},
    {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.01},
]


def _plain(kind: str = "chord") -> Channel:
    """A channel that is not whitened."""
    k = np.linspace(0, 40, 100)
    return Channel(np.zeros(400), kind, BASE, 0.0, SPACING, k, np.ones(100))  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("half_length", [1.0, 1.6])
def test_transform_is_that_of_the_tracks_joint(half_length: float) -> None:
    x = np.arange(-8, 8, 0.01)
    z = dip(x, float(lowest(np.array([half_length]))[0]), half_length)  # e = 1 m
    for k in (0.3, 1.0, 3.0, 6.0):
        numeric = float(np.sum(z * np.cos(k * x)) * 0.01)
        closed = dip_transform(np.array([k]), np.array([half_length]))[0, 0] * rounding_gain(np.array([k]), 0.3)[0]
        assert closed == pytest.approx(numeric, abs=0.02 * half_length)


def test_curvature_steps_by_the_dip_angle_over_the_wheelbase_and_back() -> None:
    count, k = window(0.01)
    one = _plain()
    shape = Channel(one.data, "chord", BASE, 0.0, 0.01, k, np.ones(k.size)).spectrum(k, np.array([1.5]))[0]
    curvature = np.roll(np.fft.irfft(shape, count), count // 2)
    x = (np.arange(count) - count // 2) * 0.01
    angle = 4 / 1.5
    for place, sign in ((-BASE, 1), (BASE, -1)):  # centre of the bogie when leading and trailing wheelset are there
        before, after = np.interp([place - 0.2, place + 0.2], x, curvature)
        parabola = angle / (2 * 1.5) * 0.4 / (2 * BASE)  # the slope of a parabola goes back between the two
        assert after - before == pytest.approx(sign * (angle / (2 * BASE) - parabola), rel=0.03)


def test_energy_is_the_sum_of_squares() -> None:
    count, k = window(SPACING)
    shape = _plain().spectrum(k, LENGTHS[3:5])
    rows = np.fft.irfft(shape, count, axis=1)
    assert energy(shape, count) == pytest.approx((rows**2).sum(axis=1))
    assert twice(6).tolist() == [1, 2, 2, 1]


def test_found_in_white_noise_with_the_stated_uncertainty() -> None:
    rng = np.random.default_rng(5)
    noise = 6e-4 * rng.standard_normal(16_000)
    places = np.arange(40.0, 1960.0, 23.0) + rng.uniform(-3, 3, 84)
    _, k = window(SPACING)
    values = noise.copy()
    for place in places:
        near = np.arange(round(place / SPACING) - 40, round(place / SPACING) + 41)
        x = near * SPACING - place
        slope = [
            np.gradient(dip(np.array([y - 1e-4, y + 1e-4]), 3e-3, 1.3), 2e-4)[0]
            for y in np.concatenate([x + BASE, x - BASE])
        ]
        values[near] += (np.array(slope[: len(x)]) - np.array(slope[len(x) :])) / (2 * BASE)
    one = channel(values, noise, np.ones(16_000, dtype=bool), "chord", BASE, 0.0, SPACING)
    found = find([one], 5.0)
    assert len(found.distance) <= len(places) + 2
    hits = found.take(np.abs(found.distance[None, :] - places[:, None]).argmin(axis=1))
    assert np.abs(hits.distance - places).max() < 0.15
    depth, std = hits.depth()
    assert np.mean(np.abs(depth - 3e-3) < 2 * std) > 0.85
    assert np.sqrt(np.mean((depth / 3e-3 - 1) ** 2)) < 0.15


def _run(folder, speed: float, shape: str, seed: int = 3):
    """Half a kilometre at random distances on rough track: (truth, scenario)."""
    rng = np.random.default_rng(seed)
    s = synthesis.distances(600.0, 0.1)
    found = synthesis.irregularities(spectra("erri_low"), s.size, 0.1, rng, Band(shortest=1.0))
    columns = {key: column * synthesis.fade_in(s, 25, 20) for key, column in found.items()}
    joints = []
    for place in np.cumsum(rng.uniform(9.0, 30.0, 26)) + 60:
        if place < 570:
            depth, length = rng.uniform(3e-3, 6e-3), rng.uniform(0.8, 1.6)
            joints.append(Feature("joint", float(place), "both", depth, dip_angle(depth, length), length))
            x = s - place
            columns["vertical"] += (
                dip(x, depth, length) if shape == "parabola" else -depth * np.exp(-2.5 * np.hypot(x, 0.1) / length)
            )
    write_track(with_features(Track(s, columns, "t"), joints), folder / "t.csv")
    values = {"track": str(folder / "t.csv"), "vehicle": "class175", "speed": {"kind": "constant", "speed": speed}}
    scenario = Scenario.build(values | {"duration": 540 / speed, "sensors": MEMS})
    return simulate(scenario, "compiled", folder / "truth"), scenario


@pytest.mark.parametrize(("speed", "shape"), [(12.0, "parabola"), (40.0, "parabola"), (20.0, "exponential")])
def test_joints_at_random_distances_are_found(tmp_path, speed: float, shape: str) -> None:
    truth, scenario = _run(tmp_path, speed, shape)
    assert len(true_dips(truth)) > 18
    measurements = measure(truth, scenario).measurements
    estimate = DippedJoints().estimate(measurements)
    scores = JointScorer().score(estimate, truth)
    assert scores["recall [-]"] >= 0.95
    assert scores["precision [-]"] >= 0.95
    assert scores["rms error of position [m]"] < 0.1
    if shape == "parabola":
        assert scores["rms relative error of depth [-]"] < 0.2
    assert {"kind", "s [m]", "time [s]", "depth [m]", "depth_std [m]"} <= set(estimate.about["events"][0])
    table = matched(estimate, truth)
    assert np.mean(np.asarray(table["side"]) == "both") > 0.8


def test_lost_samples_are_marked_and_give_no_events(tmp_path) -> None:
    truth, scenario = _run(tmp_path, 40.0, "parabola")
    frames = measure_all(scenario.sensors, truth, 1)
    gyro = frames[256.0]
    lost = gyro["time [s]"].between(4.0, 6.0)
    gyro.loc[lost, "bogie.rate_pitch [rad/s]"] = np.nan
    estimate = DippedJoints().estimate(Measurements(about_recording(scenario), frames))
    valid = np.asarray(estimate.series["valid [-]"]) > 0.5
    time = np.asarray(estimate.series["time [s]"])
    assert not valid[(time > 4.0) & (time < 6.0)].any()
    assert valid[(time > 0.5) & (time < 3.5)].all()
    assert not any(3.9 < event["time [s]"] < 6.1 for event in estimate.about["events"])
    scores = JointScorer().score(estimate, truth)
    assert scores["precision [-]"] == 1.0
    assert scores["recall [-]"] >= 0.9
