"""Conicity over the lateral shift by least squares with piecewise cubic polynomials (Ward et al. 2011, 4.3.3)."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from estimators.interface import Estimate, Estimator, Missing
from estimators.wheel_rail.cubic_splines import Pieces
from estimators.wheel_rail.known_rails import Rails, Survey, missing_rails, refine
from estimators.wheel_rail.straight import told_of_curves
from estimators.wheel_rail.wheelset_motion import NEEDED, YAW, WheelsetMotion, missing_motion, nominal, wheelset_motion
from railsim.measurements import Measurements
from railsim.spec import quantity

FIRST = 8  # pieces with which the record's place on the track is sought
POINTS = 161  # of the table of the result
PENALTIES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # relative to the mean information of a piece
LEAST = 1e-9  # the same, on the coefficients themselves: the constant of the radius has no effect
SAMPLES = 4.0  # rows a period of the highest frequency
WINDOW = 4.0  # s; the conicity over time is that of the cone that fits best in it
GAUGES = 21  # quantiles of the gauge over which the function is averaged
NEAR = 1.25e-4  # m; half width of the stretch of shifts from which they are taken
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


class ConicityLeastSquares(Estimator, frozen=True):
    """Rolling radius over the shift of a single wheelset, from yaw rate, lateral path and the measured track.

    It fits the simplified model. The rolling radius of a wheel is a sum of cubic B-splines over the shift towards its
    own rail; the difference of both wheels is what the yaw equation (18) sees, as in the regression (4). The number of
    pieces and the penalty on curvature are those that predict best those blocks of the record which were left out of
    the fit.
    """

    pieces: tuple[int, ...] = quantity(
        (4, 8, 12, 16, 24, 32), unit="candidates, chosen by cross-validation", source="illustrative", min_length=1
    )
    folds: int = quantity(5, unit="blocks of the record", source="illustrative", ge=2)
    longest: float = quantity(100.0, unit="m", source="illustrative", gt=0.0)
    highest: float = quantity(20.0, unit="Hz", source="illustrative", gt=0.0)
    use_gauge: bool = quantity(True, unit="whether the measured gauge shifts each rail", source="illustrative")
    model_error: float = quantity(
        0.012, unit="- (standard deviation of the conicity's scale)", source="tuned on wheelset_new", ge=0.0
    )

    requires: ClassVar[tuple[str, ...]] = (YAW,)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the equation of the wheelset's yaw needs."""
        return NEEDED

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there: motion and the measured track among it."""
        return super().missing(measurements) + missing_motion(measurements) + missing_rails(measurements)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Conicity over the record and, in `about`, over the shift.

        Raises
        ------
        InputError : sensors, measured track or parameters are missing, or the track does not reach as far as the run.
        """
        self.need(measurements)
        motion = wheelset_motion(measurements, self.longest, self.highest)
        survey = Survey(measurements)
        reach = 1.2 * float(np.abs(motion.y - survey.rails(motion, survey.find(motion), 1.0).centre).max()) + 2e-3
        offset, scale = refine(lambda *at: self._misfit(measurements, motion, survey, reach, *at), survey.find(motion))
        rails = survey.rails(motion, offset, scale)
        equation = self._equation(measurements, motion, rails)
        count, penalty, scores = self._choose(equation, reach)
        fit = solve(equation, Pieces(-reach, reach, count), penalty)
        found = self._result(
            motion,
            rails,
            equation,
            fit,
            {
                "pieces_chosen [-]": count,
                "penalty [-]": penalty,
                "cross_validation [m]": scores,
                "offset [m]": offset,
                "way_scale [-]": scale,
                "creep_coefficient [N]": 1.0 / max(float(fit.coefficients[-1]), 1e-12),
            },
        )
        return told_of_curves(found, measurements)

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
        self,
        measurements: Measurements,
        motion: WheelsetMotion,
        survey: Survey,
        reach: float,
        offset: float,
        scale: float,
    ) -> float:
        equation = self._equation(measurements, motion, survey.rails(motion, offset, scale))
        return float(np.std(solve(equation, Pieces(-reach, reach, FIRST), PENALTIES[3]).residual)) * 1e3

    def _choose(self, equation: Equation, reach: float) -> tuple[int, float, dict[str, float]]:
        """Number of pieces and penalty with the least error (rms, m) on blocks left out."""
        errors_by_choice: dict[tuple[int, float], float] = {}
        for count in self.pieces:
            errors = left_out(equation, Pieces(-reach, reach, count), PENALTIES, self.folds)
            errors_by_choice |= {(count, penalty): error for penalty, error in zip(PENALTIES, errors, strict=True)}
        count, penalty = min(errors_by_choice, key=lambda key: errors_by_choice[key])
        return (
            count,
            penalty,
            {f"{key[0]} pieces, penalty {key[1]:g}": value for key, value in errors_by_choice.items()},
        )

    def _result(
        self, motion: WheelsetMotion, rails: Rails, equation: Equation, fit: Fit, about: dict[str, Any]
    ) -> Estimate:
        shift = (equation.left + equation.right) / 2.0
        visited = shift[equation.rows]
        table = np.linspace(visited.min(), visited.max(), POINTS)
        visits = visited_with(shift[equation.rows], (equation.right - equation.left)[equation.rows], table)
        value, spread = conicity(fit, table, visits, self.model_error)
        nominal_value, _ = conicity(fit, table, None, self.model_error)
        now, now_std = running(fit, equation, round(WINDOW * motion.band.rate), self.model_error)
        series = pd.DataFrame({
            "time [s]": motion.time,
            "conicity [-]": np.where(motion.valid, now, np.nan),
            "conicity_std [-]": now_std,
            "wheelset1.lateral_shift [m]": np.where(motion.valid, shift, np.nan),
            "track_lateral [m]": np.where(motion.valid, rails.centre, np.nan),
        })  # fmt: skip
        function = {
            "shift [m]": table.tolist(), "conicity [-]": value.tolist(), "conicity_std [-]": spread.tolist(),
            "at_nominal_gauge [-]": nominal_value.tolist(), "kind": "secant",
        }  # fmt: skip
        return Estimate(self.name, series, self.model_dump(mode="json") | about | {"conicity_function": function})


def solve(equation: Equation, pieces: Pieces, penalty: float) -> Fit:
    """Regularised least squares over all rows; covariance from the residual and its correlation in time."""
    regressors = _regressors(equation, pieces, equation.rows)
    output = equation.output[equation.rows]
    inverse = _inverse(regressors.T @ regressors, pieces, penalty)
    coefficients = inverse @ (regressors.T @ output)
    residual = output - regressors @ coefficients
    return Fit(pieces, coefficients, inverse * np.var(residual) * _correlated(residual), residual)


def left_out(equation: Equation, pieces: Pieces, penalties: tuple[float, ...], folds: int) -> list[float]:
    """Error (rms, m) by penalty of every block of rows as predicted by the others."""
    blocks = np.array_split(equation.rows, folds)
    regressors = [_regressors(equation, pieces, block) for block in blocks]
    normals = [one.T @ one for one in regressors]
    targets = [one.T @ equation.output[block] for one, block in zip(regressors, blocks, strict=True)]
    whole, target = np.sum(normals, axis=0), np.sum(targets, axis=0)
    errors = []
    for penalty in penalties:
        total = 0.0
        for block, rows, normal, part in zip(blocks, regressors, normals, targets, strict=True):
            coefficients = _inverse(whole - normal, pieces, penalty) @ (target - part)
            total += float(np.sum((equation.output[block] - rows @ coefficients) ** 2))
        errors.append(float(np.sqrt(total / len(equation.rows))))
    return errors


def _inverse(normal: np.ndarray, pieces: Pieces, penalty: float) -> np.ndarray:
    """Inverse of the normal matrix with the penalty on the curvature of the radius."""
    level = float(np.trace(normal[:-1, :-1])) / pieces.size
    curvature = pieces.roughness()
    rough = np.zeros_like(normal)
    rough[:-1, :-1] = level * (penalty * curvature.T @ curvature + LEAST * np.eye(pieces.size))
    return np.linalg.pinv(normal + rough, rcond=1e-14, hermitian=True)


def visited_with(shift: np.ndarray, gauge: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Quantiles of the gauge deviation (m) that the record has near each shift of the table, (points, `GAUGES`)."""
    order = np.argsort(shift)
    sorted_shift, sorted_gauge = shift[order], gauge[order]
    share = (np.arange(GAUGES) + 0.5) / GAUGES
    rows = []
    for place in table:
        low, high = np.searchsorted(sorted_shift, [place - NEAR, place + NEAR])
        low, high = max(0, min(low, high - GAUGES)), min(len(shift), max(high, low + GAUGES))
        rows.append(np.quantile(sorted_gauge[low:high], share))
    return np.array(rows)


def conicity(
    fit: Fit, shift: np.ndarray, gauges: np.ndarray | None, model_error: float
) -> tuple[np.ndarray, np.ndarray]:
    """lambda = (r_L - r_R) / (2 u) over the shift u (m) and its standard deviation.

    It is the mean over gauge deviations (points, any number), or on rails of nominal gauge. Nearer to the middle than
    `CENTRE` it is the slope between both ends of that stretch.
    """
    gauges = np.zeros((len(shift), 1)) if gauges is None else gauges
    far = np.where(np.abs(shift) < CENTRE, CENTRE, shift)
    rows = np.mean([_difference(fit.pieces, far - gauge / 2, far + gauge / 2) for gauge in gauges.T], axis=0)
    near = np.abs(shift) < CENTRE
    if near.any():
        other = [_difference(fit.pieces, -CENTRE - gauge / 2, -CENTRE + gauge / 2) for gauge in gauges[near].T]
        rows[near] = (rows[near] - np.mean(other, axis=0)) / 2.0
    rows /= far[:, None]
    spread = np.einsum("ij,jk,ik->i", rows, fit.covariance[:-1, :-1], rows)
    value = rows @ fit.coefficients[:-1]
    return value, np.hypot(np.sqrt(np.maximum(spread, 0.0)), model_error * np.abs(value))


def running(fit: Fit, equation: Equation, window: int, model_error: float) -> tuple[np.ndarray, np.ndarray]:
    """Conicity of the cone that fits best in a moving window of so many samples, and its standard deviation."""
    shift = (equation.left + equation.right) / 2.0
    rows = _difference(fit.pieces, equation.left, equation.right)
    weight = np.ones(window)
    size = np.maximum(np.convolve(shift**2, weight, "same"), 1e-15)
    value = np.convolve((rows @ fit.coefficients[:-1]) * shift, weight, "same") / size
    coarse = slice(None, None, max(1, window // 8))
    mean = (
        np.stack([np.convolve(column * shift, weight, "same")[coarse] for column in rows.T], axis=1)
        / size[coarse, None]
    )
    spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", mean, fit.covariance[:-1, :-1], mean), 0.0))
    place = np.arange(len(value))
    return value, np.hypot(np.interp(place, place[coarse], spread), model_error * np.abs(value))


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
