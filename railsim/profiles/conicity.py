"""Equivalent conicity of a rolling-radius-difference function after EN 15302 and UIC 519.

The free wheelset follows y'' + dr(y) / (e r0) = 0 with the rolling-radius difference dr (left minus right, y to the
left), the taping lines' distance e and the nominal radius r0. Its first integral gives the wavelength L of the wave
between the turning points c - A and c + A, at which the integral of dr is equal; a cone of conicity
(2 pi / L)^2 e r0 / 2 has the same wavelength. e and r0 cancel.
"""

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import root_scalar

_POINTS = 1000
_PHASE = (np.arange(_POINTS) + 0.5) * np.pi / _POINTS - 0.5 * np.pi
_REST = 1e-9  # relative size of dr's integral below which the wheelset is taken to roll straight on


def equivalent_conicity(shift: np.ndarray, difference: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
    """tan(gamma_e) over the amplitude.

    Parameters
    ----------
    shift, difference : rolling-radius-difference function, increasing `shift`; any one unit of length.
    amplitude : half the distance of the wave's turning points, in the same unit.

    Returns
    -------
    One value per amplitude: 0 where the wheelset has free play without restoring difference, NaN where the function's
    range does not hold a wave of that amplitude.
    """
    function = make_interp_spline(np.asarray(shift, float), np.asarray(difference, float), k=1)
    potential = function.antiderivative()
    ends = float(shift[0]), float(shift[-1])
    return np.array([_conicity(potential, ends, float(one)) for one in np.atleast_1d(amplitude)])


def oscillation_centre(shift: np.ndarray, difference: np.ndarray, amplitude: float) -> float:
    """Middle c of the wave of `amplitude`: the integral of dr is equal at c - A and c + A; NaN where there is none."""
    potential = make_interp_spline(np.asarray(shift, float), np.asarray(difference, float), k=1).antiderivative()
    return _centre(potential, (float(shift[0]), float(shift[-1])), amplitude)


def _conicity(potential, ends: tuple[float, float], amplitude: float) -> float:
    centre = _centre(potential, ends, amplitude)
    if not np.isfinite(centre):
        return np.nan
    top = 0.5 * (float(potential(centre + amplitude)) + float(potential(centre - amplitude)))
    energy = top - potential(centre + amplitude * np.sin(_PHASE))
    scale = float(np.ptp(potential(np.linspace(*ends, 201))))
    if np.max(np.abs(energy)) <= _REST * scale:
        return 0.0
    if energy.min() <= 0.0:
        return np.nan
    half_wave = np.sum(amplitude * np.cos(_PHASE) / np.sqrt(2.0 * energy)) * np.pi / _POINTS
    return float(0.5 * (np.pi / half_wave) ** 2)


def _centre(potential, ends: tuple[float, float], amplitude: float) -> float:
    slack = 1e-9 * (ends[1] - ends[0])
    low, high = ends[0] + amplitude, ends[1] - amplitude
    if low > high + slack:
        return np.nan
    if high - low <= slack:
        low = high = 0.5 * (low + high)

    def mismatch(centre: float) -> float:
        return float(potential(centre + amplitude) - potential(centre - amplitude))

    centres = np.linspace(low, high, 401)
    values = np.array([mismatch(place) for place in centres])
    if high == low:
        scale = float(np.ptp(potential(np.linspace(*ends, 201))))
        return low if abs(values[0]) <= 1e-3 * scale else np.nan
    changes = np.nonzero(values[:-1] * values[1:] <= 0.0)[0]
    if changes.size == 0:
        return np.nan
    first = int(changes[np.argmin(np.abs(centres[changes]))])
    if values[first] == 0.0:
        return float(centres[first])
    return root_scalar(mismatch, bracket=(centres[first], centres[first + 1])).root
