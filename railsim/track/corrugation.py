"""Corrugation: a periodic wave of the rail head over a limited length."""

import numpy as np

from railsim.errors import InputError
from railsim.track.synthesis import fade_in


def corrugation(
    s: np.ndarray, start: float, length: float, wavelength: float, amplitude: float, fade: float = 5.0
) -> np.ndarray:
    """Vertical wave, m, up +, of the stated amplitude between `start` and `start + length`, with smooth ends of `fade`.

    Raises
    ------
    InputError : the rows are too far apart for the wave, or the ends overlap.
    """
    spacing = float(np.diff(s).max())
    if wavelength < 6 * spacing:
        raise InputError(f"a wave of {wavelength:g} m needs rows {wavelength / 6:.3g} m apart, not {spacing:g} m")
    if length < 2 * fade:
        raise InputError(f"a corrugation of {length:g} m leaves no room for two ends of {fade:g} m; make it longer")
    window = fade_in(s, start, fade) * (1 - fade_in(s, start + length - fade, fade))
    return amplitude * window * np.sin(2 * np.pi * (s - start) / wavelength)
