"""Shapes of joints, voids and corrugation against their closed forms, and the shipped tracks that hold them."""

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.track import read_track
from railsim.track.corrugation import corrugation
from railsim.track.features import features
from railsim.track.joints import RAIL_LENGTH, ROUNDING, dip, dip_angle, void


@pytest.mark.parametrize(("depth", "half_length"), [(0.003, 1.0), (0.005, 1.7)])
def test_dip_has_its_depth_and_angle(depth: float, half_length: float) -> None:
    x = np.linspace(-2.5, 2.5, 50_001)
    z = dip(x, depth, half_length)
    assert -z.min() == pytest.approx(depth, rel=1e-6)
    assert not z[np.abs(x) > half_length].any()
    slope = np.gradient(z, x)
    curvature_of_parabola = dip_angle(depth, half_length) / (2 * half_length)
    beyond = ROUNDING / 2
    jump = np.interp(beyond, x, slope) - np.interp(-beyond, x, slope) + 2 * curvature_of_parabola * beyond
    assert jump == pytest.approx(dip_angle(depth, half_length), rel=1e-3)


def test_sharp_dip_has_four_times_depth_over_half_length_as_angle() -> None:
    assert dip_angle(0.004, 1.25, rounding=0.0) == pytest.approx(4 * 0.004 / 1.25)
    with pytest.raises(InputError, match="longer than the rounding"):
        dip(np.zeros(3), 0.004, 0.2)


def test_void_is_flat_at_the_bottom_and_carries_no_net_slope() -> None:
    x = np.linspace(-15, 15, 30_001)
    z = void(x, 0.002)
    assert z.min() == pytest.approx(-0.002)
    assert np.abs(np.gradient(z, x)).max() == pytest.approx(
        2 * 1.2 * 0.002 * np.exp(-np.pi / 4) * np.sin(np.pi / 4), rel=1e-3
    )
    assert np.abs(z[[0, -1]]).max() < 1e-9


def test_corrugation_has_its_wavelength() -> None:
    s = np.arange(0, 100, 0.05)
    z = corrugation(s, 20, 60, 0.5, 1e-4)
    inside = (s > 30) & (s < 70)
    assert z[inside].std() == pytest.approx(1e-4 / np.sqrt(2), rel=0.01)
    spectrum = np.abs(np.fft.rfft(z))
    assert np.fft.rfftfreq(s.size, 0.05)[np.argmax(spectrum)] == pytest.approx(2.0, abs=0.02)
    assert not z[(s < 20) | (s > 80)].any()
    with pytest.raises(InputError, match="rows"):
        corrugation(s, 20, 60, 0.2, 1e-4)


def test_jointed_track_has_rails_of_sixty_feet_some_staggered() -> None:
    track = read_track("jointed_60ft")
    found = features(track)
    assert track.length >= 2200
    for side in ("left", "right"):
        places = np.array([one.s for one in found if one.side == side])
        gaps = np.diff(places)
        usual = np.isclose(gaps, RAIL_LENGTH, atol=1e-3)
        assert np.mean(usual) > 0.97
        assert np.isin(np.round(gaps[~usual] / RAIL_LENGTH, 3), [0.5, 1.5]).all()
    alone = [one for one in found if sum(abs(one.s - other.s) < 1.0 for other in found) == 1]
    assert 40 < len(alone) < 100
    totals = track.totals()
    for one in found[::7]:
        rail = totals[f"{one.side}_vertical"]
        near = np.abs(track.s - one.s) < 2.5
        line = np.polyval(np.polyfit(track.s[near], rail[near], 1), one.s)
        assert line - np.interp(one.s, track.s, rail) > 0.4 * (one.depth or 1.0)


def test_main_line_has_two_millimetres() -> None:
    track = read_track("paddington_bristol_like")
    rough = track.s > 45
    assert track.spacing == pytest.approx(0.2)
    assert track.lateral[rough].std() == pytest.approx(2e-3, rel=1e-3)
    assert track.gauge_deviation[rough].std() == pytest.approx(2e-3, rel=1e-3)
