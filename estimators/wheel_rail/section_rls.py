"""Recursive least squares in sections of lateral displacement: equations (5) to (8) of Ward et al. 2011, Appendix 2.

With R = (r_L + r_R) / 2, S = delta_L + delta_R, D = delta_L - delta_R and everything else known, equations (11) and
(12) are

    y''   - Omega_1 = (2 (f22 - f11) + 2 f11 R / r0) / m  psi - 2 f22 R / (m V) phi' + (2 f23 / r0 - W) D / (2 m)
    psi'' - Omega_2 = (l W S / 2 - k_psi - 2 f23) / I  psi + (2 f23 R / V - I_wy V / r0) / I  phi'
                      + (f33 D - l f11 (r_L - r_R)) / (I r0)

that is regressors psi, phi' and 1, as in (6) and (8). (5) and (7) leave out k_psi and 2 f23 psi in the known part; here
they are taken off the coefficient. `degree` 0 is the regression as printed; with 1 the last term may change linearly
within a section ("local linear"), with 2 as a parabola, and with `gauge` also with the gauge deviation.
"""

from typing import NamedTuple

import numpy as np

from estimators.filters.kalman import correct, project
from railsim.compiled import allocating
from railsim.wheelset.parameters import Coefficients

PSI, ROLL_RATE, CONSTANT = range(3)
LATERAL, TURNING = range(2)
GAUGE_SCALE = 1e-3  # m
SCALE = (1e-3, 1e-2)  # rad, rad/s: typical psi and phi', so that a prior covariance can be stated once


class Signals(NamedTuple):
    """What (5) to (8) take as measured, shapes (n,): F_s in N, the others in m, rad, s; `shift` is y - d, `gauge` the
    deviation of the rails' distance.
    """

    y_rate: np.ndarray
    y_acceleration: np.ndarray
    yaw: np.ndarray
    yaw_rate: np.ndarray
    yaw_acceleration: np.ndarray
    roll: np.ndarray
    roll_rate: np.ndarray
    force: np.ndarray
    shift: np.ndarray
    gauge: np.ndarray
    speed: np.ndarray


class Sections(NamedTuple):
    """What a run of the recursion leaves.

    Attributes
    ----------
    number : section of each sample, (n,). centres, gauges : of y - d and of the gauge deviation, m, (sections,), the
    latter zero where sections are of y - d alone. samples : number of each, (sections,).
    history : coefficients of psi, of phi' and of the rest of the sample's section after it, (2, n, 3), the last at the
    sample's own place and gauge. spread : their standard deviations, (2, n, 3).
    coefficients, covariance : at the end, (2, sections, k) and (2, sections, k, k).
    condition : number of the normalised regressors in each section, (sections,).
    """

    number: np.ndarray
    centres: np.ndarray
    gauges: np.ndarray
    samples: np.ndarray
    history: np.ndarray
    spread: np.ndarray
    coefficients: np.ndarray
    covariance: np.ndarray
    condition: np.ndarray


class Geometry(NamedTuple):
    """Rolling radii (m) and contact angles (rad), any shape."""

    sum_of_radii: np.ndarray
    difference_of_radii: np.ndarray
    sum_of_angles: np.ndarray
    difference_of_angles: np.ndarray


def known_parts(signals: Signals, known: Coefficients) -> tuple[np.ndarray, np.ndarray]:
    """y'' - Omega_1 and psi'' - Omega_2, (5) and (7), shapes (n,)."""
    c, x = known, signals
    first = (x.force - 2 * c.f22 / x.speed * x.y_rate - 2 * c.f23 / x.speed * x.yaw_rate - c.W * x.roll) / c.m
    second = 2 * c.f23 / x.speed * x.y_rate - (2 * (c.l**2 * c.f11 + c.f33) / x.speed + c.f_psi) * x.yaw_rate
    return x.y_acceleration - first, x.yaw_acceleration - second / c.I


def regress(
    signals: Signals,
    known: Coefficients,
    width: float,
    degree: int,
    gauge: bool,
    prior: float = 1e6,
    forgetting: float = 1.0,
    gauge_width: float | None = None,
) -> Sections:
    """Run the recursion through all samples.

    Parameters
    ----------
    width : of a section of y - d, m. degree : of the polynomial within a section. gauge : deviation as a regressor.
    prior : variance at the start of every parameter, of regressors scaled to about one, by the output's variance.
    forgetting : factor a sample of the section. gauge_width : of a section of the gauge deviation too, m, so that a
    section is a stretch of y - d at a stretch of gauge; None: sections of y - d alone.
    """
    number, centres, gauges = numbered(signals, width, gauge_width)
    count = len(centres)
    position = (signals.shift - centres[number]) / width
    deviation = (signals.gauge - gauges[number]) / (gauge_width or GAUGE_SCALE)
    columns = [signals.yaw / SCALE[0], signals.roll_rate / SCALE[1]]
    columns += [position**power * deviation**more for power, more in powers(degree, gauge)]
    regressors = np.stack(columns, axis=1)
    parts = [
        recursion(regressors, output / np.std(output), number, count, prior, forgetting)
        for output in known_parts(signals, known)
    ]
    scales = [np.std(output) for output in known_parts(signals, known)]
    unit = np.ones(regressors.shape[1])
    unit[:2] /= SCALE
    history, spread, end, covariance = (
        np.stack([part[i] * scale * unit[: part[i].shape[-1]] for part, scale in zip(parts, scales, strict=True)])
        for i in range(4)
    )
    covariance *= np.array(scales)[:, None, None, None] * unit[:, None]
    return Sections(
        number, centres, gauges, np.bincount(number, minlength=count), history, spread, end, covariance,
        conditions(regressors, number, count),
    )  # fmt: skip


def numbered(signals: Signals, width: float, gauge_width: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Section of each sample (n,), and the sections' centres of y - d and of the gauge, m, (sections,)."""
    cell = np.round(signals.shift / width).astype(np.int64)
    if gauge_width is None:
        lowest = int(cell.min())
        centres = np.arange(lowest, int(cell.max()) + 1) * width
        return cell - lowest, centres, np.zeros(len(centres))
    pairs = np.stack([cell, np.round(signals.gauge / gauge_width).astype(np.int64)], axis=1)
    found, number = np.unique(pairs, axis=0, return_inverse=True)
    return number.ravel().astype(np.int64), found[:, 0] * width, found[:, 1] * gauge_width


def powers(degree: int, gauge: bool) -> list[tuple[int, int]]:
    """Exponents of place and gauge deviation of every term, the constant first."""
    most = degree if gauge else 0
    return [(i, j) for total in range(degree + 1) for j in range(min(total, most) + 1) for i in (total - j,)]


def geometry(coefficients: np.ndarray, known: Coefficients) -> Geometry:
    """Radii and angles from the coefficients of both equations, (2, ..., k): R from psi in (11), which is far better
    conditioned than R from phi'.
    """
    c = known
    lateral, turning = coefficients
    half = c.r0 * (c.m * lateral[..., PSI] - 2 * (c.f22 - c.f11)) / (2 * c.f11)
    angles = 2 * c.m * lateral[..., CONSTANT] / (2 * c.f23 / c.r0 - c.W)
    radii = (c.f33 * angles - c.I * c.r0 * turning[..., CONSTANT]) / (c.l * c.f11)
    total = 2 * (c.I * turning[..., PSI] + c.k_psi + 2 * c.f23) / (c.l * c.W)
    return Geometry(2 * half, radii, total, angles)


def geometry_spread(spread: np.ndarray, known: Coefficients) -> Geometry:
    """Standard deviations of `geometry` from those of the coefficients, (2, ..., k)."""
    c = known
    lateral, turning = spread
    angles = 2 * c.m * lateral[..., CONSTANT] / abs(2 * c.f23 / c.r0 - c.W)
    return Geometry(
        c.r0 * c.m * lateral[..., PSI] / c.f11,
        np.hypot(c.I * c.r0 * turning[..., CONSTANT], c.f33 * angles) / (c.l * c.f11),
        2 * c.I * turning[..., PSI] / (c.l * c.W),
        angles,
    )


def conditions(regressors: np.ndarray, number: np.ndarray, count: int) -> np.ndarray:
    """Condition number of each section's regressors, every column of unit length; NaN with too few samples."""
    condition_numbers = np.full(count, np.nan)
    for section in range(count):
        rows = regressors[number == section]
        if len(rows) > regressors.shape[1]:
            condition_numbers[section] = np.linalg.cond(rows / np.maximum(np.linalg.norm(rows, axis=0), 1e-300))
    return condition_numbers


@allocating
def recursion(regressors, output, number, count, prior, forgetting):
    """Recursive least squares with a parameter set for each section.

    Returns
    -------
    First two coefficients and the rest's sum (n, 3), and standard deviations (n, 3), of the sample's section after the
    sample; then at the end parameters (count, k) and covariances (count, k, k), variance of the residual included.
    """
    n, k = regressors.shape
    theta, P = np.zeros((count, k)), np.zeros((count, k, k))
    squares, seen = np.zeros(count), np.zeros(count)
    history, spread = np.zeros((n, CONSTANT + 1)), np.zeros((n, CONSTANT + 1))
    gain = np.zeros(k)
    for section in range(count):
        for i in range(k):
            P[section, i, i] = prior
    for row in range(n):
        at = number[row]
        total, error = forgetting + project(P[at], regressors[row], gain), output[row]
        for i in range(k):
            error -= regressors[row, i] * theta[at, i]
        squares[at] = forgetting * squares[at] + error * error * forgetting / total
        seen[at] = forgetting * seen[at] + 1.0
        variance = squares[at] / max(seen[at] - k, 1.0)
        correct(theta[at], P[at], gain, total, error)
        if forgetting != 1.0:
            P[at] /= forgetting
        for i in range(k):
            if i < CONSTANT:
                history[row, i] = theta[at, i]
                spread[row, i] = (max(P[at, i, i], 0.0) * variance) ** 0.5
            else:
                history[row, CONSTANT] += theta[at, i] * regressors[row, i]
                for j in range(CONSTANT, k):
                    spread[row, CONSTANT] += P[at, i, j] * regressors[row, i] * regressors[row, j]
        spread[row, CONSTANT] = (max(spread[row, CONSTANT], 0.0) * variance) ** 0.5
    for section in range(count):
        P[section] *= squares[section] / max(seen[section] - k, 1.0)
    return history, spread, theta, P
