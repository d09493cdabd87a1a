"""What there is to know of a dipped joint: Cramer-Rao bound of its depth with the track's irregularity as noise.

Known: the shape of a dip (two parabolas, rounded), the bogie's response, the sensors' noise, the irregularity's
spectrum and on which rails the joint is. Unknown: the depths of the rails, the half length (for which what the
estimator takes beforehand is given) and the place, which by symmetry says nothing of the depth. The rails' mean m and
half their difference h are independent; in m(k) and h(k), Fisher's information on the parameters p is

    F_ij = 2 integral dk / (2 pi) [m_i m_j / (S_m + N_m) + h_i h_j / (S_h + N_h)]

over wave numbers, with the irregularity's densities S, and the sensors' noise N brought to the rails.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from estimators.track.curvature import BOUNCE, PITCH, ROLL
from estimators.track.dip_fit import SPREAD
from estimators.track.dips import ROUNDING, TRACK_WIDTH, dip_transform, lowest, rounding_gain
from estimators.vehicle.roll_plane import roll_response
from estimators.vehicle.vertical import bounce_inverse, pitch_inverse
from experiments.scoring.joints import true_groups
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.track.features import Feature
from railsim.track.spectra import Band, spectra
from railsim.truth import Truth

SPECTRUM = "erri_low"
"""Of `jointed_60ft`."""
AS_DRAWN = Band(shortest=1.0)
"""Waves that are in the shipped track; below 1 m, rows and vehicles of the simulation have none."""
_K = np.geomspace(2 * np.pi / 64, 2 * np.pi / 0.2, 3000)
_STEP = 0.01


class Noise(NamedTuple):
    """Densities of the sensors' noise, one-sided: rad/s/sqrt(Hz) and m/s2/sqrt(Hz); None: not fitted."""

    pitch: float | None
    roll: float | None
    bounce: float | None


def bounds(table: pd.DataFrame, truth: Truth, measurements: Measurements, speed: float) -> pd.DataFrame:
    """The table of `joint_score.matched` with the columns "bound [-]" (the irregularity has waves of all lengths) and
    "bound as drawn [-]" (only those of the shipped track); NaN in rows of false events.
    """
    groups = {group[0].s: group for group in true_groups(truth)}
    noise = Noise(*(_density(measurements, name) for name in (PITCH, ROLL, BOUNCE)))
    columns = {}
    for name, band in (("bound [-]", None), ("bound as drawn [-]", AS_DRAWN)):
        known = {s: relative_bound(group, measurements.vehicle, speed, noise, band) for s, group in groups.items()}
        columns[name] = [known.get(s, np.nan) for s in np.asarray(table["true s [m]"])]
    return table.assign(**columns)


def relative_bound(
    joint: Sequence[Feature], vehicle: Mapping[str, Any], speed: float, noise: Noise, band: Band | None
) -> float:
    """Least standard deviation of the depth of both rails' mean, over that depth, of one joint.

    Parameters
    ----------
    joint : the joint's features, of one rail or both; one length.
    band : waves that the irregularity has; None: all, by the spectrum's law.
    """
    size = {one.side: (one.depth or 0.0) for one in joint}
    length = float(joint[0].half_length or 1.0)
    left, right = (size.get(side, size.get("both", 0.0)) for side in ("left", "right"))
    mean, half = (left + right) / 2, (left - right) / 2
    mean_noise, half_noise = _noise(vehicle, speed, noise, band)
    unit, change = _shape(length), (_shape(length + _STEP) - _shape(length - _STEP)) / (2 * _STEP)
    zero = np.zeros(len(_K))
    if len(size) == 1 and "both" not in size:
        sign = np.sign(half)
        rows = [(unit, sign * unit), (mean * change, half * change)]
    else:
        rows = [(unit, zero), (mean * change, half * change), (zero, unit)]
    if noise.roll is None:
        rows = rows[:2]
    weight = np.gradient(_K) / np.pi
    information = np.array(
        [[np.sum(weight * (a[0] * b[0] / mean_noise + a[1] * b[1] / half_noise)) for b in rows] for a in rows]
    )
    information[1, 1] += (SPREAD * length) ** -2
    return float(np.sqrt(np.linalg.inv(information)[0, 0]) / mean)


def _density(measurements: Measurements, name: str) -> float | None:
    """Noise that the data sheet states, rounding included."""
    if name not in measurements:
        return None
    return data_sheet(measurements.about, name).density(measurements.rate(name))


def _shape(length: float) -> np.ndarray:
    """Transform of a dip 1 m deep."""
    one = np.array([length])
    return dip_transform(_K, one)[0] * rounding_gain(_K, ROUNDING) / lowest(one)[0]


def _noise(vehicle: Mapping[str, Any], speed: float, noise: Noise, band: Band | None) -> tuple[np.ndarray, np.ndarray]:
    """Two-sided densities over k / (2 pi) of what is not dip, m3: of the rails' mean, and of half their difference."""
    laws, weight = spectra(SPECTRUM), 1.0 if band is None else band.weight(_K)
    omega, arm = _K * speed, _K * float(vehicle["semi_wheelbase"])
    information = np.zeros(len(_K))
    if noise.pitch is not None:
        information += (
            _K**4
            * np.sinc(arm / np.pi) ** 2
            * speed
            / (noise.pitch**2 / 2 * np.abs(pitch_inverse(vehicle).whole(omega)) ** 2)
        )
    if noise.bounce is not None:
        information += (
            omega**4
            * np.cos(arm) ** 2
            / (noise.bounce**2 / 2 * np.abs(bounce_inverse(vehicle).whole(omega)) ** 2 * speed)
        )
    mean = np.pi * laws["vertical"].density(_K) * weight + 1 / np.maximum(information, 1e-30)
    if noise.roll is None:
        return mean, np.full(len(_K), np.inf)
    seen = np.abs(roll_response(vehicle, omega) * np.cos(arm)) * omega * 2 / TRACK_WIDTH
    half = (
        np.pi * laws["cross_level"].density(_K) / 4 * weight + noise.roll**2 / 2 * speed / np.maximum(seen, 1e-30) ** 2
    )
    return mean, half
