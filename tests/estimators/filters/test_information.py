"""What the smoother makes of a reading that the model takes for another."""

import numpy as np
import pytest

from estimators.filters.information import Information, wavenumbers


def _information(wrong: np.ndarray) -> Information:
    """One reading of one quantity with hardly any noise, that shows `wrong` (k,) more than the model says."""
    k = wavenumbers()
    one = np.ones((len(k), 1, 1), dtype=complex)
    return Information(k, np.ones((len(k), 1)), one, 1e-9 * one, wrong[None, :, None, None] * one[None])


def test_a_reading_that_shows_too_much_makes_too_much_track():
    s = np.arange(0.0, 2000.0, 0.25)
    wave = 1e-3 * np.sin(2.0 * np.pi * s / 40.0)
    found = _information(np.full(len(wavenumbers()), 0.2 + 0j)).mistaken(wave[:, None], 0.25, -1)
    inside = (s > 200.0) & (s < 1800.0)
    assert found[inside, 0] == pytest.approx(0.2 * wave[inside], abs=2e-5)


def test_what_comes_from_behind_is_found_there():
    """A reading that shows half of the track 16 m behind puts half of it 16 m too far ahead into the estimate."""
    s = np.arange(0.0, 2000.0, 0.25)
    bump = 1e-3 * np.exp(-(((s - 1000.0) / 6.0) ** 2))
    late = 0.5 * np.exp(-16.0j * wavenumbers())
    found = _information(late).mistaken(bump[:, None], 0.25, -1)[:, 0]
    assert s[np.argmax(found)] == pytest.approx(1016.0, abs=0.5)
    assert found.max() == pytest.approx(0.5e-3, rel=0.05)
