"""Spectra: formulas, variance, and what the synthesis makes of them."""

import numpy as np
import pytest
from scipy.signal import welch

from railsim.errors import InputError
from railsim.track.spectra import QUANTITIES, Band, Spectrum, names, spectra, variance
from railsim.track.synthesis import irregularities, irregularity

SPACING = 0.2


def test_all_sets_are_there() -> None:
    assert names() == ["erri_high", "erri_low", "fra_1", "fra_2", "fra_3", "fra_4", "fra_5", "fra_6"]
    for name in names():
        assert tuple(spectra(name)) == QUANTITIES
    with pytest.raises(InputError, match="erri_high, erri_low"):
        spectra("erri_medium")


def test_erri_low_formulas_by_hand() -> None:
    w, b = 0.7, 0.75
    base = 0.8246**2 / ((w**2 + 0.0206**2) * (w**2 + 0.8246**2))
    short = w**2 / (w**2 + 0.438**2)
    angle = 4.032e-7 / b**2 * base * short
    found = {key: float(spectrum.density(w)) for key, spectrum in spectra("erri_low").items()}
    assert found["vertical"] == pytest.approx(4.032e-7 * base)
    assert found["lateral"] == pytest.approx(2.119e-7 * base)
    assert found["gauge_deviation"] == pytest.approx(5.32e-8 * base * short)
    assert found["cross_level"] == pytest.approx(angle * (2 * b) ** 2)  # height of a tilted base of 1.5 m


def test_fra_6_formulas_by_hand() -> None:
    w, cut, short, rough = 0.7, 0.8245, 0.4380, 0.0339e-4
    found = {key: float(spectrum.density(w)) for key, spectrum in spectra("fra_6").items()}
    assert found["vertical"] == pytest.approx(0.25 * rough * cut**2 / (w**2 * (w**2 + cut**2)))
    assert found["lateral"] == pytest.approx(found["vertical"])  # class 6: Aa = Av
    assert found["cross_level"] == pytest.approx(rough * cut**2 / ((w**2 + cut**2) * (w**2 + short**2)))
    assert found["gauge_deviation"] == pytest.approx(found["cross_level"])


def test_variance_in_closed_form() -> None:
    """Integral of A / (W^2 (W^2 + c^2)): A/c^2 (1/W1 - 1/W2 - (atan(W2/c) - atan(W1/c)) / c)."""
    amplitude, c = 2e-6, 0.8245
    low, high = 2 * np.pi / 25, 2 * np.pi / 3
    exact = amplitude / c**2 * (1 / low - 1 / high - (np.arctan(high / c) - np.arctan(low / c)) / c)
    found = variance(Spectrum(amplitude, 0, (0.0, c)), Band(3, 25, skirt=1 + 1e-7))
    assert found == pytest.approx(exact, rel=1e-6)


def test_skirts_are_halfway_at_their_middle() -> None:
    band = Band(4, 50, skirt=1.44)
    assert band.weight(2 * np.pi / np.array([50 * 1.2, 4 / 1.2])) == pytest.approx([0.5, 0.5])
    assert band.weight(2 * np.pi / np.array([50, 4, 10])) == pytest.approx([1, 1, 1])
    assert band.weight(2 * np.pi / np.array([73, 2.7])) == pytest.approx([0, 0])


@pytest.mark.parametrize("bounds", [(3, 2, 1.2), (0, 5, 1.2), (3, 50, 1.0), (3, np.inf, 1.2), (np.nan, 5, 1.2)])
def test_impossible_bands_are_refused(bounds: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="make no band"):
        Band(*bounds)


@pytest.mark.parametrize("name", ["erri_low", "fra_6", "fra_1"])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_standard_deviation_and_density_are_the_formulas(name: str, quantity: str) -> None:
    """20 km against the formula: a factor of 2 or 2 pi in the density would be seen many times over."""
    spectrum, band = spectra(name)[quantity], Band(2.0, 60.0)
    x = irregularity(spectrum, 100_000, SPACING, np.random.default_rng(5), band)
    assert x.std() == pytest.approx(np.sqrt(variance(spectrum, band)), rel=0.06)
    cycles, per_cycle = welch(x, fs=1 / SPACING, nperseg=4096, scaling="density")  # one-sided, m^2 / (1/m)
    inside = (cycles > 1 / 50) & (cycles < 1 / 2.2)
    found = per_cycle[inside] / (2 * np.pi)
    ratio = found / spectrum.density(2 * np.pi * cycles[inside])
    assert np.mean(ratio) == pytest.approx(1, abs=0.06)
    for part in np.array_split(ratio[: 8 * (ratio.size // 8)], 8):  # the shape too, not only the mean
        assert np.mean(part) == pytest.approx(1, abs=0.25)
    beyond = (cycles > 1.3 / 2.0) | ((cycles < 0.6 / 60) & (cycles > 0))
    assert per_cycle[beyond].max() < 0.2 * per_cycle[inside].max()
    assert per_cycle[cycles > 1.5 / 2.0].max() < 1e-4 * per_cycle[inside].max()


def test_quantities_are_independent_and_seeded() -> None:
    made = irregularities(spectra("erri_low"), 100_000, SPACING, np.random.default_rng(2), Band(2, 30))
    again = irregularities(spectra("erri_low"), 100_000, SPACING, np.random.default_rng(2), Band(2, 30))
    assert all(np.array_equal(made[key], again[key]) for key in QUANTITIES)
    correlation = np.corrcoef([made[key] for key in QUANTITIES]) - np.eye(4)
    assert np.abs(correlation).max() < 0.1
    other = irregularities(spectra("erri_low"), 100_000, SPACING, np.random.default_rng(3), Band(2, 30))
    assert abs(np.corrcoef(made["vertical"], other["vertical"])[0, 1]) < 0.1


def test_a_short_track_does_not_repeat_itself() -> None:
    """Over many tracks the two ends are as different as any two far places: twice the variance."""
    spectrum, band = spectra("erri_low")["vertical"], Band(3, 25)
    rng = np.random.default_rng(1)
    made = np.array([irregularity(spectrum, 1000, SPACING, rng, band) for _ in range(400)])
    assert made.shape == (400, 1000)
    apart = np.mean((made[:, -1] - made[:, 0]) ** 2)
    assert apart == pytest.approx(2 * variance(spectrum, band), rel=0.3)


def test_waves_shorter_than_two_rows_are_refused() -> None:
    with pytest.raises(InputError, match="do not fit a spacing of 1 m"):
        irregularity(spectra("erri_low")["vertical"], 1000, 1.0, np.random.default_rng(1), Band(1, 25))
