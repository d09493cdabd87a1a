"""Vertical movement of the two wheelsets from the bogie's vertical acceleration and pitch rate, as discrete filters.

The equations of motion are those of `vehicle.vertical`. Solved for the wheelsets' displacements w_1 and w_2, twice
differentiated and band limited by H(s), with measured acceleration a and pitch rate q:

    (w_1'' + w_2'') / 2 = H [1 + (m s^2 + Z) / (4 (kp + cp s))] a
    (w_1'' - w_2'') / 2 = -H Lb s [1 + I s^2 / (4 Lb^2 (kp + cp s))] q

After section 5.1 of Ward et al. 2011 (Fig. 17; references 38-41 there). Accelerations are used because the track
spectra of ERRI B176 are flat in them: the signals are then nearly white, and the correlation peak is sharp.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import signal

from estimators.signals.remembered import remembered
from estimators.vehicle.vertical import Ratio, bounce_inverse, pitch_inverse
from railsim.errors import InputError

ACCELERATION = "bogie.acceleration_z [m/s2]"
PITCH_RATE = "bogie.rate_pitch [rad/s]"
FORWARD = "bogie.acceleration_x [m/s2]"


@dataclass(frozen=True)
class Chain:
    """Discrete filters of the inverse.

    Attributes
    ----------
    sections : second-order sections, shape (4 or 6, k, 6). Rows: sum and difference of the wheelsets' accelerations
        (halved), and their inertial shares (that part of each which grows with m/kp and I/(kp Lb^2): where a wrong
        parameter shows). Rows 0, 2 take the vertical acceleration, rows 1, 3 the pitch rate. Where the accelerometer is
        not above the centre of gravity, rows 4, 5 take the pitch rate too: what the lever arm adds to rows 0, 2.
    steady : the sections' states for a constant input of 1, shape (4 or 6, k, 2).
    delay : mean delay of the band's filters in s (centre of the pass band).
    bandwidth : of the band in Hz: white noise through it has 2 * bandwidth independent values a second.
    wheelbase : 2 Lb in m.
    """

    sections: np.ndarray
    steady: np.ndarray
    delay: float
    bandwidth: float
    wheelbase: float


@remembered
def chain(
    vehicle: Mapping[str, Any], rate: float, low: float, high: float, inverse: bool, offset: float = 0.0
) -> Chain:
    """Design the filters.

    Parameters
    ----------
    vehicle : nominal parameters by field name, SI units.
    rate : sample rate in Hz.
    low, high : pass band in Hz (Butterworth: second order below, fourth order above).
    inverse : False leaves the bogie's dynamics in and takes plain sums z -+ Lb theta.
    offset : longitudinal position of the accelerometer before the centre of gravity in m.

    Raises
    ------
    InputError : a vehicle parameter is missing or not positive, or the sample rate is too low for the band.
    """
    if high < 2 * low:
        raise InputError(f"band of {low:g} to {high:.3g} Hz is too narrow; lower 'low' or raise 'reach'")
    if rate < 4 * high:
        raise InputError(
            f"sample rate {rate:g} Hz is too low for a band up to {high:g} Hz; give at least {4 * high:g} Hz"
        )
    band = _band(low, high)
    sos = [_discrete(one, band, rate, np.sqrt(low * high)) for one in _ratios(vehicle, inverse, offset)]
    size = max(len(one) for one in sos)
    sections = np.stack([_padded(one, size) for one in sos])
    steady = np.stack([signal.sosfilt_zi(one) for one in sections])
    return Chain(sections, steady, *_timing(band, low, high), 2.0 * float(vehicle["semi_wheelbase"]))


class _Band(NamedTuple):
    zeros: np.ndarray
    poles: np.ndarray
    gain: float


def _ratios(vehicle: Mapping[str, Any], inverse: bool, offset: float) -> list[Ratio]:
    """What makes the rows of `Chain` of the signals, over s."""
    arm = float(vehicle["semi_wheelbase"])
    unit, none = Ratio(np.array([1.0]), np.array([1.0])), Ratio(np.array([0.0]), np.array([1.0]))
    bounce, bounce_share, pitch, pitch_share = unit, none, unit, none
    if inverse:
        (bounce, bounce_share), (pitch, pitch_share) = bounce_inverse(vehicle), pitch_inverse(vehicle)
    differentiate = Ratio(np.array([-arm, 0.0]), np.array([1.0]))
    ratios = [bounce, differentiate.times(pitch), bounce_share, differentiate.times(pitch_share)]
    if offset:
        lever = Ratio(np.array([offset, 0.0]), np.array([1.0]))
        ratios += [lever.times(bounce), lever.times(bounce_share)]
    return ratios


def _band(low: float, high: float) -> _Band:
    """Analogue band: Butterworth high pass of second order, low pass of fourth order."""
    z1, p1, k1 = _butterworth(2, low, "highpass")
    z2, p2, k2 = _butterworth(4, high, "lowpass")
    return _Band(np.append(z1, z2), np.append(p1, p2), k1 * k2)


def _butterworth(order: int, corner: float, kind: str) -> Any:  # SciPy has no types
    return signal.butter(order, 2 * np.pi * corner, kind, analog=True, output="zpk")


def _discrete(ratio: Ratio, band: _Band, rate: float, exact: float) -> np.ndarray:
    """Bilinear transform of ratio times band, exact at zero and at `exact` Hz: second-order sections, shape (k, 6)."""
    numerator, denominator = np.trim_zeros(ratio[0], "f"), ratio[1]
    zeros = np.append(np.roots(numerator), band.zeros)
    poles = np.append(np.roots(denominator), band.poles)
    gain = band.gain * (numerator[0] / denominator[0] if numerator.size else 0.0)
    warped = np.pi * exact / np.tan(np.pi * exact / rate)
    return signal.zpk2sos(*signal.bilinear_zpk(zeros, poles, gain, warped))


def _padded(sos: np.ndarray, size: int) -> np.ndarray:
    idle = np.tile([1.0, 0.0, 0.0, 1.0, 0.0, 0.0], (size - len(sos), 1))
    return np.vstack([sos, idle])


def _timing(band: _Band, low: float, high: float) -> tuple[float, float]:
    """Group delay of the band in s, weighted with the information on a delay in a white signal, and bandwidth in Hz."""
    omega = 2 * np.pi * np.linspace(0.2 * low, 2 * high, 2001)
    s = 1j * omega[:, None]
    response = band.gain * np.prod(s - band.zeros, axis=1) / np.prod(s - band.poles, axis=1)
    power = np.abs(response) ** 2
    group = -np.gradient(np.unwrap(np.angle(response)), omega)
    width = np.trapezoid(power, omega) ** 2 / np.trapezoid(power**2, omega) / (2 * np.pi)
    return float(np.average(group, weights=omega**2 * power)), float(width)
