"""What the fused estimate says of itself: widened, replaced or withheld bands, and in which words."""

import numpy as np
import pandas as pd
import pytest

from estimators.filters.track_spectrum import ERRI_VERTICAL
from estimators.interface import Estimate
from estimators.signals.bands import BANDS
from estimators.track.plane_fit import Misfit
from estimators.track.self_check import Opinion, checked, gauge_over_vertical, sinking

S = np.arange(0.0, 1000.0, 0.25)
RIGHT = Misfit(1.0, 0.0)


def _series(height: np.ndarray, std: float = 5e-5) -> pd.DataFrame:
    columns = {"s [m]": S, "valid [-]": np.ones(len(S))}
    for band in ("d1", "d2"):
        columns |= {f"vertical_{band} [m]": height, f"vertical_{band}_std [m]": np.full(len(S), std)}
    return pd.DataFrame(columns)


def _noise(size: float, seed: int) -> np.ndarray:
    return size * np.random.default_rng(seed).normal(size=len(S))


def test_what_agrees_is_left_as_it_is():
    opinion = Opinion(Estimate("plain", _series(_noise(5e-5, 1)), {}))
    assert checked(_series(_noise(5e-5, 2)), "vertical", {"d1": RIGHT, "d2": RIGHT}, opinion) == ({}, [])


def test_an_estimate_that_a_plain_one_contradicts_gives_way_to_it():
    plain = _noise(5e-5, 1)
    opinion = Opinion(Estimate("plain", _series(plain, 6e-5), {}))
    columns, words = checked(_series(plain + _noise(6e-4, 2)), "vertical", {"d1": RIGHT}, opinion)
    np.testing.assert_allclose(columns["vertical_d1 [m]"], plain, atol=1e-12)
    assert columns["vertical_d1_std [m]"] == pytest.approx(np.full(len(S), 6e-5))
    assert len(words) == 1 and "differ by 0.6 mm" in words[0] and "plain" in words[0]


def test_readings_that_contradict_the_model_widen_or_withhold():
    columns, words = checked(
        _series(_noise(5e-5, 2)), "vertical", {"d1": Misfit(1.2, 5.0), "d2": Misfit(2.0, 6.0)}, None
    )
    assert columns["vertical_d1_std [m]"] == pytest.approx(np.full(len(S), 5e-5 * np.sqrt(1.2)))
    assert "vertical_d1 [m]" not in columns
    assert np.isnan(columns["vertical_d2 [m]"]).all()
    assert len(words) == 1 and words[0].startswith("vertical D2 withheld")


def test_wheelsets_sink_by_half_the_slope_of_the_tread_for_each_metre_of_gauge():
    """The FRA's spectra have 0.5 to 2 times as much gauge deviation in D1 as vertical, ERRI's a quarter."""
    assert 0.25 < gauge_over_vertical("d1") < 1.5
    steep, flat = (sinking({"design_contact_angle": angle}, ERRI_VERTICAL) for angle in (0.1, 0.05))
    rough = sinking({"design_contact_angle": 0.05}, ERRI_VERTICAL.scaled(4.0 * ERRI_VERTICAL.amplitude))
    for band in BANDS:
        assert steep[band] == pytest.approx(2.0 * flat[band])
        assert rough[band] == pytest.approx(2.0 * flat[band])
