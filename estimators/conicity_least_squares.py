"""Conicity over the lateral shift by least squares with piecewise cubic polynomials (Ward et al. 2011, 4.3.3)."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from estimators._known_rails import Rails, Survey, refine
from estimators._pieces import Pieces
from estimators._wheelset_motion import NEEDED, YAW, WheelsetMotion, has_motion, nominal, wheelset_motion
from estimators.interface import Estimate, Estimator
from railsim.measurements import Measurements
from railsim.spec import quantity

FIRST = 8  # pieces with which the record's place on the track is sought
POINTS = 161  # of the table of the result
PENALTIES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # relative to the mean information of a piece
LEAST = 1e-9  # the same, on the coefficients themselves: the constant of the radius has no effect
SAMPLES = 4.0  # rows a period of the highest frequency
CENTRE = 0.5e-3  # m; nearer to the middle the conicity is the slope there, not the quotient


@dataclass(frozen=True)
class Equation:
    """Equation (18) solved for (r_L - r_R) / 2: output = F(shift) + moment / f11, all in m, shapes (n,).

    Without inertia and suspension the wheelset turns by r0 l psi' / V = -F, Klingel's motion; they need a moment from
    the creep forces, and the unknown creep coefficient f11 is a further regressor's factor.
    """

    output: np.ndarray
    moment: np.ndarray
    left: np.ndarray
    right: np.ndarray
    rows: np.ndarray


@dataclass(frozen=True)
class Fit:
    """Coefficients with their covariance, and the pieces that they belong to; `creep` is the last coefficient."""

    pieces: Pieces
    coefficients: np.ndarray
    covariance: np.ndarray
    residual: np.ndarray

    def half_difference(self, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(r_L - r_R) / 2 in m over the shift (m) on rails of nominal gauge, and its standard deviation."""
        rows = _difference(self.pieces, shift, shift)
        spread = np.einsum("ij,jk,ik->i", rows, self.covariance[:-1, :-1], rows)
        return rows @ self.coefficients[:-1], np.sqrt(np.maximum(spread, 0.0))


class ConicityLeastSquares(Estimator, frozen=True):
    """Rolling radius over lateral shift from yaw rate, lateral path and the measured track, on the simplified model.

    The rolling radius of a wheel is a sum of cubic B-splines over the shift towards its own rail; the difference of
    both wheels is what the yaw equation (18) sees, as in the regression (4). The number of pieces and the penalty on
    curvature are those that foretell blocks of the record best which were left out of the fit.
    """

    pieces: tuple[int, ...] = quantity(
        (4, 8, 12, 16, 24, 32), unit="candidates, chosen by cross-validation", source="illustrative", min_length=1
    )
    folds: int = quantity(5, unit="blocks of the record", source="illustrative", ge=2)
    longest: float = quantity(50.0, unit="m", source="illustrative", gt=0.0)
    highest: float = quantity(20.0, unit="Hz", source="illustrative", gt=0.0)
    use_gauge: bool = quantity(True, unit="whether the measured gauge shifts each rail", source="illustrative")
    model_error: float = quantity(
        0.02, unit="- (standard deviation of the conicity's scale)", source="illustrative: masses, stiffness", ge=0.0
    )

    requires: ClassVar[tuple[str, ...]] = (YAW,)

    def fits(self, measurements: Measurements) -> bool:
        """Whether there are motion, measured track and the nominal parameters."""
        known = all(isinstance(measurements.vehicle.get(name), int | float) for name in NEEDED)
        track = measurements.track
        lateral = track is not None and bool({"lateral [m]", "left_lateral [m]"} & set(track.columns))
        return has_motion(measurements) and known and lateral

    def estimate(self, measurements: Measurements) -> Estimate:
        """Conicity over the record and, in `about`, over the shift.

        Raises
        ------
        InputError : sensors, measured track or parameters are missing, or the track does not reach as far as the run.
        """
        motion = wheelset_motion(measurements, self.longest, self.highest)
        survey = Survey(measurements)
        reach = 1.2 * float(np.abs((motion.y - survey.rails(motion, survey.find(motion), 1.0).centre)).max()) + 2e-3
        offset, scale = refine(lambda *at: self._misfit(measurements, motion, survey, reach, *at), survey.find(motion))
        rails = survey.rails(motion, offset, scale)
        equation = self._equation(measurements, motion, rails)
        count, penalty, scores = self._choose(equation, reach)
        fit = solve(equation, Pieces(-reach, reach, count), penalty)
        return self._result(motion, rails, equation, fit, {
            "pieces_chosen": count, "penalty": penalty, "cross_validation [m]": scores,
            "offset [m]": offset, "way_scale [-]": scale, "creep_coefficient [N]": 1.0 / max(float(fit.coefficients[-1]), 1e-12),
        })

    def _equation(self, measurements: Measurements, motion: WheelsetMotion, rails: Rails) -> Equation:
        radius, half, inertia, stiffness, damping = (nominal(measurements, name) for name in NEEDED)
        moment = inertia * motion.yaw_acceleration + stiffness * motion.yaw + damping * motion.yaw_rate
        gauge = rails.gauge if self.use_gauge else np.zeros(len(rails.gauge))
        shift = motion.y - rails.centre
        every = max(1, int(motion.band.rate / (SAMPLES * motion.band.highest)))
        rows = np.arange(0, len(motion.time), every)
        return Equation(
            -radius * half * motion.yaw_rate / motion.speed,
            radius / (2.0 * half) * moment,
            shift - gauge / 2.0,
            shift + gauge / 2.0,
            rows[motion.valid[rows]],
        )

    def _misfit(
        self, measurements: Measurements, motion: WheelsetMotion, survey: Survey, reach: float, offset: float, scale: float
    ) -> float:
        equation = self._equation(measurements, motion, survey.rails(motion, offset, scale))
        return float(np.std(solve(equation, Pieces(-reach, reach, FIRST), PENALTIES[3]).residual)) * 1e3

    def _choose(self, equation: Equation, reach: float) -> tuple[int, float, dict[str, float]]:
        """Number of pieces and penalty with the least error (rms, m) on blocks left out."""
        found: dict[tuple[int, float], float] = {}
        for count in self.pieces:
            errors = left_out(equation, Pieces(-reach, reach, count), PENALTIES, self.folds)
            found |= {(count, penalty): error for penalty, error in zip(PENALTIES, errors, strict=True)}
        count, penalty = min(found, key=lambda key: found[key])
        return count, penalty, {f"{key[0]} pieces, penalty {key[1]:g}": value for key, value in found.items()}

    def _result(
        self, motion: WheelsetMotion, rails: Rails, equation: Equation, fit: Fit, about: dict[str, Any]
    ) -> Estimate:
        shift = (equation.left + equation.right) / 2.0
        visited = shift[equation.rows]
        table = np.linspace(visited.min(), visited.max(), POINTS)
        value, spread = conicity(fit, table, self.model_error)
        now, now_std = conicity(fit, shift, self.model_error)
        series = pd.DataFrame({
            "time [s]": motion.time, "conicity [-]": now, "conicity_std [-]": now_std,
            "wheelset1.lateral_shift [m]": shift, "track_lateral [m]": rails.centre, "valid [-]": motion.valid.astype(float),
        })
        count = np.histogram(visited, np.append(table - np.diff(table)[0] / 2, table[-1] + np.diff(table)[0] / 2))[0]
        return Estimate(self.name, series, self.model_dump() | about | {
            "shift [m]": table.tolist(), "conicity [-]": value.tolist(), "conicity_std [-]": spread.tolist(),
            "samples": count.tolist(), "left_out": [], "warnings": [],
        })


def solve(equation: Equation, pieces: Pieces, penalty: float) -> Fit:
    """Regularised least squares over all rows; covariance from the residual and its correlation in time."""
    regressors = _regressors(equation, pieces, equation.rows)
    output = equation.output[equation.rows]
    inverse = _inverse(regressors.T @ regressors, pieces, penalty)
    coefficients = inverse @ (regressors.T @ output)
    residual = output - regressors @ coefficients
    return Fit(pieces, coefficients, inverse * np.var(residual) * _correlated(residual), residual)


def left_out(equation: Equation, pieces: Pieces, penalties: tuple[float, ...], folds: int) -> list[float]:
    """Error (rms, m) by penalty of every block of rows as foretold by the others."""
    blocks = np.array_split(equation.rows, folds)
    regressors = [_regressors(equation, pieces, block) for block in blocks]
    normals = [one.T @ one for one in regressors]
    targets = [one.T @ equation.output[block] for one, block in zip(regressors, blocks, strict=True)]
    whole, target = np.sum(normals, axis=0), np.sum(targets, axis=0)
    errors = []
    for penalty in penalties:
        total = 0.0
        for block, one, normal, part in zip(blocks, regressors, normals, targets, strict=True):
            coefficients = _inverse(whole - normal, pieces, penalty) @ (target - part)
            total += float(np.sum((equation.output[block] - one @ coefficients) ** 2))
        errors.append(float(np.sqrt(total / len(equation.rows))))
    return errors


def _inverse(normal: np.ndarray, pieces: Pieces, penalty: float) -> np.ndarray:
    """Inverse of the normal matrix with the penalty on the curvature of the radius."""
    level = float(np.trace(normal[:-1, :-1])) / pieces.size
    bend = pieces.roughness()
    rough = np.zeros_like(normal)
    rough[:-1, :-1] = level * (penalty * bend.T @ bend + LEAST * np.eye(pieces.size))
    return np.linalg.pinv(normal + rough, rcond=1e-14, hermitian=True)


def conicity(fit: Fit, shift: np.ndarray, model_error: float) -> tuple[np.ndarray, np.ndarray]:
    """lambda = (r_L - r_R) / (2 u) over the shift u (m), and its standard deviation; the slope near the middle."""
    far = np.where(np.abs(shift) < CENTRE, CENTRE, shift)
    value, spread = fit.half_difference(far)
    other, other_spread = fit.half_difference(-far)
    near = np.abs(shift) < CENTRE
    found = np.where(near, (value - other) / (2.0 * far), value / far)
    size = np.where(near, np.hypot(spread, other_spread) / (2.0 * CENTRE), spread / np.abs(far))
    return found, np.hypot(size, model_error * np.abs(found))


def _regressors(equation: Equation, pieces: Pieces, rows: np.ndarray) -> np.ndarray:
    return np.column_stack([_difference(pieces, equation.left[rows], equation.right[rows]), equation.moment[rows]])


def _difference(pieces: Pieces, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(r_L - r_R) / 2 by the coefficients of r: the right wheel's shift towards its rail is minus the wheelset's."""
    return (pieces.basis(left) - pieces.basis(-right)) / 2.0


def _correlated(residual: np.ndarray) -> float:
    """How many samples in a row carry the information of one: integral of the autocorrelation, at least 1."""
    size = len(residual)
    spectrum = np.abs(np.fft.rfft(residual - residual.mean(), 2 * size)) ** 2
    correlation = np.fft.irfft(spectrum)[:size]
    correlation /= max(correlation[0], 1e-300)
    end = int(np.argmax(correlation < 0.05)) or size
    return float(max(1.0, 1.0 + 2.0 * np.sum(correlation[1:end])))
