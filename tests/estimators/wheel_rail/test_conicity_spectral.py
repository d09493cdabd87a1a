"""Conicity from the response to a known section: closed forms of the response, place and conicity found again."""

import numpy as np
import pandas as pd
import pytest

from estimators.vehicle.single_wheelset import linear, wheelset_model
from estimators.wheel_rail import conicity_spectral as spectral
from estimators.wheel_rail.conicity_spectral import ConicitySpectral
from railsim import load_scenario
from railsim.errors import InputError
from railsim.measurements import Measurements

SPEED, PLACE, SCALE, CONICITY = 30.0, 137.3, 1.004, 0.12
VEHICLE = load_scenario("wheelset_new").vehicle.nominal()


def survey(length: float = 2600.0) -> pd.DataFrame:
    """Waves from 6 to 80 m."""
    rng = np.random.default_rng(8)
    s = np.arange(0.0, length, 0.2)
    lengths = np.geomspace(6.0, 80.0, 60)
    waves = lengths * np.sin(2.0 * np.pi * s[:, None] / lengths + rng.uniform(0.0, 2.0 * np.pi, 60))
    return pd.DataFrame({"s [m]": s, "lateral [m]": 4e-6 * waves.sum(axis=1)})


def recording(duration: float = 60.0, track: pd.DataFrame | None = None, follows: float = np.inf) -> Measurements:
    """A wheelset of another creep share and conicity than nominal over the waves; its tachometer reads slow.

    `follows` : wave number, rad/m, above which it lags the rails as no wheelset does.
    """
    table = survey()
    model = wheelset_model(VEHICLE, 0.55)
    time = np.arange(0.0, duration, 1.0 / 256.0)
    place = PLACE + SPEED * time
    k = 2.0 * np.pi * np.fft.rfftfreq(len(table), 0.2)
    a, b = linear(model, CONICITY, SPEED)
    s = 1j * k * SPEED
    gain = np.linalg.solve(s[:, None, None] * np.eye(6) - a, (b[:, 0] + s[:, None] * b[:, 1])[:, :, None])[:, 3, 0]
    gain = gain / (1.0 + 1j * k / follows) ** 2
    yaw_rate = np.fft.irfft(np.fft.rfft(table["lateral [m]"]) * gain, len(table))
    yaw_rate += 2e-3 * np.std(yaw_rate) * np.random.default_rng(4).normal(size=len(yaw_rate))
    columns = {"time [s]": time, "wheelset1.rate_yaw [rad/s]": np.interp(place, table["s [m]"], yaw_rate)}
    columns["wheelset1.speed [m/s]"] = np.full(len(time), SPEED / SCALE)
    about = {"origin": "test", "vehicle": VEHICLE, "sensors": []}
    return Measurements(about, {256.0: columns}, table if track is None else track)


def test_place_scale_and_conicity_are_found() -> None:
    found = ConicitySpectral().estimate(recording())
    assert found.series["conicity [-]"].iloc[0] == pytest.approx(CONICITY, rel=0.03)
    assert found.about["creep_share [-]"] == pytest.approx(0.55, rel=0.1)
    assert found.about["offset [m]"] == pytest.approx(PLACE, abs=0.5)
    assert found.about["way_scale [-]"] == pytest.approx(SCALE, abs=5e-4)


def test_a_response_that_no_conicity_makes_is_withheld_in_words() -> None:
    foreign = ConicitySpectral().estimate(recording(follows=0.15))
    assert np.isnan(foreign.series["conicity [-]"].to_numpy()).all()
    assert foreign.series["valid [-]"].to_numpy().max() == 0.0
    assert foreign.about["warnings"] == [spectral.UNLIKE]
    assert ConicitySpectral().estimate(recording()).about["warnings"] == []


def _noisy(rng: np.random.Generator, gains: np.ndarray, noise: float) -> spectral.Blocks:
    """Blocks of a record whose responses to path and cross level are `gains`, shape (2, m)."""
    waves = gains.shape[1]
    parts = rng.normal(size=(3, 8, waves)) + 1j * rng.normal(size=(3, 8, waves))
    slopes = parts[:2] * np.asarray(np.abs(gains).max(axis=1) > 0.0)[:, None, None]
    turning = np.sum(gains[:, None] * slopes, axis=0) + noise * parts[2]
    return spectral.Blocks(np.linspace(0.1, 1.0, waves), np.full(8, 20.0), turning, slopes)


@pytest.mark.parametrize("height", [0.0, 0.4j])
def test_chance_of_a_right_response_is_even_and_of_a_wrong_one_small(height: complex) -> None:
    rng, gains = np.random.default_rng(11), np.array([np.full(30, 1.0 + 0.5j), np.full(30, height)])
    right, wrong = [], []
    for _ in range(200):
        blocks = _noisy(rng, gains, 1.0)
        foretold = np.sum(gains[:, None] * blocks.slopes, axis=0)
        right.append(spectral.Misfit.of(blocks, foretold).chance)
        wrong.append(spectral.Misfit.of(blocks, 0.3 * foretold))
    assert np.mean(np.array(right) < 0.05) == pytest.approx(0.05, abs=0.04)
    assert np.mean(right) == pytest.approx(0.5, abs=0.07)
    assert max(one.chance for one in wrong) < 1e-3
    power = np.sum(np.abs(gains[:, 0]) ** 2)  # of the response; the noise has 1
    assert np.mean([one.wrong for one in wrong]) == pytest.approx(0.7 * np.sqrt(power / (power + 1.0)), rel=0.1)


def test_what_creep_and_conicity_do_alike_is_in_the_deviation() -> None:
    """A response by conicity times creep share tells only their product: the deviation is that of all shares."""
    rng = np.random.default_rng(2)

    def product(conicity: float, creep: float, _speed: float, k: np.ndarray) -> np.ndarray:
        return np.array([np.full(len(k), conicity * creep + 0j), np.zeros(len(k))])

    gains = np.array([np.full(30, 0.06 + 0j), np.zeros(30)])
    blocks = _noisy(rng, gains, 0.001)
    misfit = spectral.Misfit.of(blocks, np.sum(gains[:, None] * blocks.slopes, axis=0))
    mean, spread, _ = spectral.averaged(blocks, product, misfit, np.log(0.1))
    alone = np.minimum(0.06 / spectral.SHARES, 1.0)
    assert mean == pytest.approx(np.mean(alone[alone < 1.0]), rel=0.1)
    assert spread == pytest.approx(np.std(alone[alone < 1.0]), rel=0.1)


def test_long_waves_are_followed() -> None:
    """The suspension holds the yaw, so that the response comes close to one only without it."""
    free = {**VEHICLE, "yaw_stiffness": 0.0, "lateral_stiffness": 0.0}
    respond = spectral.response(free, spectral.WHEELSET)
    assert respond(0.15, 0.7, 20.0, np.array([1e-3]))[0, 0] == pytest.approx(1.0, abs=0.02)


def test_short_record_and_missing_channel_are_refused() -> None:
    with pytest.raises(InputError, match="two blocks"):
        ConicitySpectral().estimate(recording(duration=12.0))
    measured = recording(duration=20.0)
    other = Measurements(measured.about, {256.0: {
        "time [s]": measured.time("wheelset1.speed [m/s]"), "wheelset1.speed [m/s]": measured["wheelset1.speed [m/s]"],
    }}, measured.track)  # fmt: skip
    assert not ConicitySpectral().fits(other)
    with pytest.raises(InputError, match="yaw"):
        ConicitySpectral().estimate(other)
