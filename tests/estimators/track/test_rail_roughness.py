"""Roughness of rails: closed forms of the wheel on its rail, printed limits, and accelerations made by hand."""

import numpy as np
import pytest
from scipy.integrate import quad

from estimators.interface import Estimate
from estimators.track.rail_roughness import RailRoughness
from estimators.track.roughness_bands import THIRD_OCTAVES, limit, spectra, third_octave
from estimators.vehicle.wheel_on_track import (
    BENDING,
    WheelOnTrack,
    contact_filter,
    contact_stiffness,
    rail_receptance,
)
from railsim import InputError
from railsim.measurements import TIME, Measurements

RATE, SPEED = 4096.0, 20.0
MASS, GAUGE = 600.0, 0.75
VEHICLE = {"wheelset_mass": 2.0 * MASS, "wheel_radius": 0.46, "half_gauge": GAUGE, "design_wheel_load": 60e3}
WAVE, STIFF, RIGID = 10e-6, 100e6, 1e13
"""Amplitude of a wave of the left rail, m, and springs under the rail, N/m."""


def record(
    wavelength: float, support: float = STIFF, noise: float = 0.0, bandwidth: float | None = None, seed: int = 1
) -> Measurements:
    """A rigid wheel of 600 kg on a contact spring and a massless rail on a spring, over a wave of the left rail only.

    Made from the differential equation's own solution, not from the estimator's formula: m z'' = -k (z - r).
    """
    time = np.arange(round(12.0 * RATE)) / RATE
    spring = 1.0 / (1.0 / contact_stiffness(60e3, 0.46) + 1.0 / support)
    omega = 2.0 * np.pi * SPEED / wavelength
    path = spring / (spring - MASS * omega**2) * WAVE
    left = -(omega**2) * path * np.sin(omega * time)
    if bandwidth:
        left = np.imag(-(omega**2) * path * np.exp(1j * omega * time) / (1.0 + 1j * omega / (2.0 * np.pi * bandwidth)))
    rng = np.random.default_rng(seed)
    errors = {"noise_density": noise, "scale_error_std": 0.01}
    if bandwidth:
        errors |= {"bandwidth": bandwidth, "bandwidth_order": 1}
    table, sheets = {TIME: time, "wheelset1.speed [m/s]": np.full(len(time), SPEED)}, []
    for side, values in (("left", left), ("right", np.zeros(len(time)))):
        channel = f"axlebox1_{side}.acceleration_z [m/s2]"
        table[channel] = 9.81 + values + noise * np.sqrt(RATE / 2.0) * rng.standard_normal(len(time))
        place = [0.0, GAUGE if side == "left" else -GAUGE, 0.0]
        sheets.append({"kind": "accelerometer", "name": f"axlebox1_{side}", "position": place, "channels": [channel]})
        sheets[-1]["errors"] = errors
    return Measurements({"origin": "test", "vehicle": VEHICLE, "sensors": sheets}, {RATE: table})


def band_of(estimate: Estimate, wavelength: float) -> dict[str, float]:
    """Entry of the record's spectrum at a wavelength."""
    centres = np.array([one["wavelength [m]"] for one in estimate.about["spectrum"]])
    return estimate.about["spectrum"][int(np.argmin(np.abs(np.log(centres / wavelength))))]


def known_track(**more: object) -> RailRoughness:
    """The estimator that is told the spring under the rail."""
    return RailRoughness.build({"track_compliance": 1.0 / STIFF, "track_spread": 0.0, "contact_filter": False, **more})


def test_receptance_at_rest_is_that_of_a_beam_on_springs() -> None:
    """Force over deflection 2 sqrt 2 B^1/4 s^3/4 (Zimmermann); here the integral of the beam's equation over waves."""
    foundation = 80e6
    whole, _ = quad(lambda k: 1.0 / (BENDING * k**4 + foundation) / np.pi, 0.0, np.inf)
    found = rail_receptance(np.array([1e-3]), whole, 60.0, 0.0)[0]
    assert found.real == pytest.approx(whole, rel=1e-3)


def test_receptance_of_a_moving_beam() -> None:
    """Below the cut-on the same integral with the mass taken from the foundation."""
    foundation, moving, omega = 80e6, 60.0, 500.0
    rest, _ = quad(lambda k: 1.0 / (BENDING * k**4 + foundation) / np.pi, 0.0, np.inf)
    moved, _ = quad(lambda k: 1.0 / (BENDING * k**4 + foundation - moving * omega**2) / np.pi, 0.0, np.inf)
    assert rail_receptance(np.array([omega]), rest, moving, 0.0)[0].real == pytest.approx(moved, rel=1e-3)


def test_wheel_and_contact_resonate_as_an_oscillator() -> None:
    wheel = WheelOnTrack(600.0, 1.2e9, 1e-16, 60.0, 0.1)
    resonance = np.sqrt(1.2e9 / 600.0)
    assert abs(wheel.roughness_over_path(np.array([resonance]))[0]) < 0.01


def test_stiffness_of_a_sphere() -> None:
    """Johnson (1985), 4.23: delta^3 = 9 P^2 / (16 R E*^2), its slope by finite difference; radius 0.3 m on 0.3 m."""
    modulus, radius = 210e9 / (2.0 * 0.91), 0.3

    def approach(force: float) -> float:
        return (9.0 * force**2 / (16.0 * radius * modulus**2)) ** (1.0 / 3.0)

    slope = 2.0 / (approach(60_001.0) - approach(59_999.0))
    assert contact_stiffness(60e3, 0.3) == pytest.approx(slope, rel=1e-4)


def test_contact_filter() -> None:
    """Remington (1976): a wave of 2 pi a loses 1 / sqrt(1 + pi / 4), long ones nothing."""
    assert contact_filter(np.array([2.0 * np.pi * 5e-3]), 5e-3)[0] == pytest.approx((1.0 + np.pi / 4.0) ** -0.5)
    assert contact_filter(np.array([1.0]), 5e-3)[0] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(("wavelength", "decibels"), [(0.4, 17.1), (0.1, 4.9), (0.0315, -5.0), (0.00315, -11.0)])
def test_limit_of_iso_3095(wavelength: float, decibels: float) -> None:
    assert limit(wavelength) == decibels
    assert np.isnan(limit(1.0))


def test_third_octaves_meet() -> None:
    edges = [third_octave(float(one)) for one in THIRD_OCTAVES]
    assert all(a[0] == pytest.approx(b[1]) for a, b in zip(edges, edges[1:], strict=False))


def test_spectra_hold_the_mean_square() -> None:
    """A sine of amplitude 2 has the mean square 2 (Parseval)."""
    found = spectra(2.0 * np.sin(2.0 * np.pi * np.arange(4000) * 0.02 / 0.5)[None], 0.02, 20.0)
    assert found.density @ found.share(0.3, 1.0) == pytest.approx(2.0, rel=1e-3)


@pytest.mark.parametrize(("wavelength", "support"), [(0.5, STIFF), (0.25, RIGID), (0.16, RIGID)])
def test_a_wave_of_one_rail(wavelength: float, support: float) -> None:
    """Level of a sine of 10 um: 20 log10(10 / sqrt 2) = 17.0 dB; the other rail is not clear of what leaks over."""
    found = known_track(track_compliance=1.0 / support).estimate(record(wavelength, support, noise=1e-3))
    band = band_of(found, wavelength)
    assert band["left level [dB]"] == pytest.approx(20.0 * np.log10(WAVE / np.sqrt(2.0) / 1e-6), abs=0.7)
    assert abs(band["left level [dB]"] - 16.99) <= 2.0 * band["left level_std [dB]"]
    assert band["right level [dB]"] is None


def test_without_the_tracks_give_it_is_wrong() -> None:
    """A rail taken to be rigid gives 0.2 m, beyond the resonance on a soft track, wrong by more than 3 dB."""
    rigid = known_track(track_compliance=0.0).estimate(record(0.2, noise=1e-3))
    assert abs(band_of(rigid, 0.2)["left level [dB]"] - 16.99) > 3.0


@pytest.mark.parametrize("support", [60e6, 100e6, 1e12])
def test_unknown_track_is_in_the_deviation(support: float) -> None:
    """By default the rail is anything between rigid and 50 MN/m: right within two deviations, or not given."""
    found = RailRoughness.build({"contact_filter": False}).estimate(record(1.0, support, noise=1e-3))
    band = band_of(found, 1.0)
    assert abs(band["left level [dB]"] - 16.99) <= 2.0 * band["left level_std [dB]"]
    unsure = RailRoughness.build({"contact_filter": False}).estimate(record(0.25, support, noise=1e-3))
    assert band_of(unsure, 0.25)["left level [dB]"] is None


def test_low_pass_of_the_sensor_is_undone() -> None:
    stiff = known_track(track_compliance=1.0 / RIGID)
    found = stiff.estimate(record(0.2, RIGID, noise=1e-3, bandwidth=150.0))
    assert band_of(found, 0.2)["left level [dB]"] == pytest.approx(16.99, abs=0.7)
    assert found.about["reach"]["highest frequency [Hz]"] == 150.0


def test_what_is_beyond_the_reach_is_not_given() -> None:
    """150 Hz at 20 m/s end at 0.133 m."""
    found = known_track().estimate(record(0.5, noise=1e-3, bandwidth=150.0))
    assert min(one["wavelength [m]"] for one in found.about["spectrum"]) > 0.133
    assert not [name for name in found.series if "10_30" in name or "30_100" in name]
    assert any("beyond what speed and samples reach" in one for one in found.about["warnings"])


def test_noise_alone_gives_nothing() -> None:
    found = known_track().estimate(record(0.5, noise=1.0))
    assert band_of(found, 0.1)["left level [dB]"] is None
    assert band_of(found, 0.1)["left noise [dB]"] > -20.0


def test_lost_samples_are_not_used() -> None:
    whole = record(0.5, noise=1e-3)
    left = "axlebox1_left.acceleration_z [m/s2]"
    table = {TIME: whole.time(left), **{name: np.array(whole[name]) for name in whole}}
    table[left][round(5.0 * RATE) : round(5.5 * RATE)] = np.nan
    found = known_track().estimate(Measurements(dict(whole.about), {RATE: table})).series
    s, valid, rms = (found[name].to_numpy() for name in ("s [m]", "valid [-]", "left_roughness_300_1000mm [m]"))
    lost = (s > 82.0) & (s < 128.0)
    assert not valid[lost].any()
    assert np.isnan(rms[lost]).all()
    assert valid.sum() >= 4


def test_parameters_are_needed() -> None:
    whole = record(0.5)
    table = {TIME: whole.time("wheelset1.speed [m/s]"), **{name: whole[name] for name in whole}}
    with pytest.raises(InputError, match="'wheelset_mass', 'wheel_radius', 'half_gauge', 'design_wheel_load'"):
        RailRoughness().estimate(Measurements(dict(whole.about) | {"vehicle": {}}, {RATE: table}))
