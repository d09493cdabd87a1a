"""Alignment from a box on the body: response against own equations, least error, and what it states."""

import numpy as np
import pytest

from estimators.track.alignment_accelerometer import AlignmentAccelerometer
from estimators.track.alignment_body import AlignmentBody, BodyBox
from estimators.track.chain_error import WAVES
from experiments.conformance.recordings import recording
from experiments.scoring.score import score
from railsim import InputError
from railsim.measurements import TIME, Measurements

CHANNEL = "body.acceleration_z [m/s2]"
Place = tuple[float, float, float]


def changed(name: str = "default", position: Place | None = None, traction_rod: bool = True) -> Measurements:
    """The first seconds of a shipped scenario, with another vehicle in about.json or the box elsewhere."""
    measured = recording(name, 5.0).measurements
    sheets = [
        {**one, "position": list(position)} if position is not None and CHANNEL in one["channels"] else one
        for one in measured.about["sensors"]
    ]
    vehicle = measured.vehicle if traction_rod else {**measured.vehicle, "traction_rod_stiffness": 0.0}
    about = {**measured.about, "vehicle": vehicle, "sensors": sheets}
    rate = measured.rate(CHANNEL)
    speed = next(one for one in measured if one == "wheelset1.speed [m/s]")
    tables = {rate: {TIME: measured.time(CHANNEL), CHANNEL: measured[CHANNEL]}}
    tables.setdefault(measured.rate(speed), {TIME: measured.time(speed)})[speed] = measured[speed]
    return Measurements(about, tables)


def test_response_is_that_of_two_masses_on_two_springs() -> None:
    """m z'' and M Z'' written down here: four primary springs, two secondary ones, wheelsets that average the track."""
    measured = changed(traction_rod=False)
    p = measured.vehicle
    speed, k = 30.0, WAVES
    s = 1j * speed * k
    lower = 4.0 * (p["primary_vertical_stiffness"] + s * p["primary_vertical_damping"])
    upper = 2.0 * (p["secondary_vertical_stiffness"] + s * p["secondary_vertical_damping"])
    bogie = p["bogie_mass"] * s**2 + lower + upper
    body = p["body_mass"] * s**2 + upper
    wheels = lower * np.cos(k * p["semi_wheelbase"])
    expected = s**2 * upper * wheels / (bogie * body - upper**2)
    found = BodyBox.of(measured, CHANNEL).chain.followed(speed)[0, :, 0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_long_waves_pass_as_they_are() -> None:
    slow = BodyBox.of(changed(), CHANNEL).filter(12.0)(np.array([2 * np.pi / 60.0]))
    assert abs(slow[0]) == pytest.approx(1.0, abs=0.1)


def test_no_other_gain_has_a_smaller_expected_error() -> None:
    """Of the track's spectrum, the sensor's noise and the vehicles' scatter: what Wiener's filter is the least of."""
    one, speed = BodyBox.of(changed(), CHANNEL), 30.0
    H, weights = one.chain.followed(speed)[:, :, 0, 0], one.chain.weights
    tracks = one.chain.priors[0].density(WAVES)
    noise = speed / (2.0 * np.pi) * one.chain.noise(speed)[0]

    def error(gain: np.ndarray) -> float:
        off = np.abs(gain * H[0] - 1.0) ** 2 + np.einsum("v,vk->k", weights, np.abs(gain * (H[1:] - H[0])) ** 2)
        return float(np.trapezoid(off * tracks + np.abs(gain) ** 2 * noise, WAVES))

    best = one.height(speed, WAVES)
    least = error(best)
    rng = np.random.default_rng(0)
    for _ in range(20):
        assert error(best * (1.0 + 0.1 * (rng.standard_normal() + 1j * rng.standard_normal()))) > least
    assert error(1.0 / H[0]) > 1.2 * least  # the nominal vehicle undone, as if it were the true one


@pytest.mark.parametrize("name", ["default", "whole_coach"])
def test_error_is_as_stated(name: str) -> None:
    made = recording(name, 40.0)
    assert made.truth is not None
    estimate = AlignmentBody().estimate(made.measurements)
    scores = score(estimate, made.truth)
    assert scores["vertical D1 rms error [mm]"] < 0.6 * scores["vertical D1 true rms [mm]"]
    assert scores["vertical D1 within 2 std [-]"] > 0.85
    assert scores["vertical D2 within 2 std [-]"] > 0.8
    assert estimate.about["known"]["d1"]["vehicle_known"] < estimate.about["known"]["d1"]["as_stated"] < 0.8


def test_the_box_stands_over_a_bogie() -> None:
    with pytest.raises(InputError, match=r"stands 8 m along the body.*x = 8 m"):
        AlignmentBody().estimate(changed("whole_coach", (0.0, 0.0, 0.0)))
    assert BodyBox.of(changed("whole_coach", (8.0, 0.0, 0.0)), CHANNEL).ahead == 0.0
    assert BodyBox.of(changed("whole_coach", (-8.0, 0.0, 0.0)), CHANNEL).ahead == -16.0


def test_a_sensor_on_the_body_is_not_taken_for_one_on_the_bogie() -> None:
    with pytest.raises(InputError, match="stands on 'body': take alignment_body"):
        AlignmentAccelerometer(sensor="body").estimate(changed())
