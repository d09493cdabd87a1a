"""Conicity without a known track: twenty tracks and vehicles, wear from run to run, and what can be known at all."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from estimators.wheel_rail.conicity_least_squares import ConicityLeastSquares
from estimators.wheel_rail.conicity_likelihood import Likelihood
from estimators.wheel_rail.conicity_smoother import ConicitySmoother
from experiments.figures.fig13 import left_side, true_conicity
from experiments.figures.interface import Figure
from experiments.reporting import intervals
from experiments.reporting.claims import HONEST, Claim, Target, above, at_least, at_most, below, exactly
from experiments.reporting.plots import BLACK, BLUE, GREEN, ORANGE, RED
from experiments.reporting.size import Size
from experiments.runs.speed import rows_where
from experiments.runs.wheelset import record
from experiments.scoring.conicity import function_errors
from railsim.analysis.statistics import root_mean_square

SEEDS, FAST_SEEDS = 20, 1
DURATION, FAST_DURATION, SMOKE_DURATION = 60.0, 30.0, 20.0
SPEEDS = (20.0, 45.0)
WITHIN = 0.03
CASES: dict[str, tuple[float, bool]] = {
    "new, gauge constant": (0.0, False),
    "worn 0.1, gauge constant": (0.1, False),
    "new, gauge 2 mm": (0.0, True),
    "worn 0.1, gauge 2 mm": (0.1, True),
}
"""Wear and whether the gauge varies."""
COLOURS = (BLUE, GREEN, ORANGE, RED)
WEAR = np.linspace(0.0, 0.135, 10)
"""Severities of ten runs from new to worn; a hollow of 0.27 mm at the last."""
FIRST_SEED, WEAR_SEED = 2500, 2600
"""Seeds on which nothing was tuned."""
AMPLITUDE = 2e-3
"""m: twice the usual standard deviation of the shift. The conicity there grows with the wear by equal steps of 0.006;
the best cone falls again as the hollow's middle widens, and the equivalent conicity hardly grows at the end."""
CORNER_STEP = 0.01
BOUNDS = ("bound [-]", "bound, corner free [-]", "by corner [-]")
ELSEWHERE, DRAWS = 40, 20000
"""Places along the line at which the gauge is taken to be independent; draws for the chance of an exact order."""
SEARCH = " (cause not proven: the particles' likelihood has a noise of 10 to 30 nats there)"
UNBOUND = " (not for want of information: the model's bound is below 0.3 of the spacing; it is what the model lacks)"
CURVED = " (below 1 mm worn wheels bend within the half millimetre of its pieces)"
ONE_SIZE = " (one model_error for all wheels, which new ones do not need and a search that ended wrongly exceeds)"
"""Why claims are not held, as measured in docs/wheel_rail_geometry.md."""
BOUNDED, BOUNDED_CASE = 3, "worn 0.1, gauge constant"
"""Runs for which the information is stated."""


class ConicityBlind(Figure):
    """Yaw gyro, accelerometer and transducer of the suspended mass, speed; no track."""

    def compute(self, size: Size) -> pd.DataFrame:
        duration = size.of(DURATION, FAST_DURATION, SMOKE_DURATION)
        cases = size.of(CASES, CASES, {BOUNDED_CASE: CASES[BOUNDED_CASE]})
        speeds = np.linspace(*SPEEDS, FAST_SEEDS if size.reduced else SEEDS)
        rows = [
            run_row(wear, float(speed), duration, FIRST_SEED + seed, gauge, seed < BOUNDED and name == BOUNDED_CASE)
            | {"part": "seed", "case": name}
            for name, (wear, gauge) in cases.items()
            for seed, speed in enumerate(speeds)
        ]
        engine = "compiled" if size.reduced else "exudyn"
        runs = WEAR[:: size.of(1, len(WEAR) // 3, len(WEAR) - 1)]
        rows += [
            run_row(float(wear), 30.0, duration, WEAR_SEED + number, False, known=True, engine=engine)
            | {"part": "wear", "case": "wear"}
            for number, wear in enumerate(runs)
        ]
        return pd.DataFrame(rows)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 5.0), layout="constrained")
        left, right = picture.subplots(1, 2)
        for (name, rows), colour in zip(_cases(table), COLOURS, strict=False):
            left.errorbar(
                rows["at nominal gauge [-]"],
                rows["estimate [-]"],
                2 * rows["std [-]"],
                fmt="o",
                ms=4,
                lw=0.8,
                color=colour,
                label=name,
            )
        _diagonal(left, table)
        left.set(
            xlabel="true conicity at nominal gauge (best cone)",
            ylabel="estimate; bars: 2 std",
            title="other tracks and vehicles",
        )
        left.legend(fontsize=8)
        wear = rows_where(table, table["part"] == "wear")
        right.plot(wear["wear [-]"], wear["true at 2 mm [-]"], "o-", color=BLACK, label="true, at 2 mm")
        spread = 2 * wear["std [-]"]
        right.errorbar(wear["wear [-]"], wear["at 2 mm [-]"], spread, fmt="s-", color=BLUE, label="estimate, at 2 mm")
        known = wear["least squares at 2 mm [-]"]
        right.plot(wear["wear [-]"], known, "^--", color=GREEN, label="least squares, track known, at 2 mm")
        right.plot(wear["wear [-]"], wear["true [-]"], "o:", color=BLACK, ms=3, lw=0.8, label="true, best cone")
        right.plot(wear["wear [-]"], wear["estimate [-]"], "s:", color=BLUE, ms=3, lw=0.8, label="estimate, best cone")
        right.set(xlabel="severity of wear", ylabel="conicity", title="ten runs on ten tracks, 30 m/s")
        right.legend()
        picture.suptitle("Conicity without a known track")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = [claim for name, rows in _cases(table) for claim in _case_claims(name, rows)]
        seeds = rows_where(table, table["part"] == "seed")
        claims.append(_share("all four cases: within 2 std", _within_two_std(seeds), HONEST))
        wear = rows_where(table, table["part"] == "wear")
        every = len(wear) == len(WEAR)
        for truth, column, how in (
            ("wear [-]", "at 2 mm [-]", "without track, at 2 mm"),
            ("wear [-]", "least squares at 2 mm [-]", "least squares, track known, at 2 mm"),
            ("true [-]", "least squares [-]", "least squares, track known, best cones"),
        ):
            right, correlation = order(wear[truth].to_numpy(), wear[column].to_numpy())
            text = f"wear, {how}: runs in their right place"
            placed = Claim.definite(text, right, exactly(1.0), len(wear), every)
            claims.append(_because(placed, UNBOUND * how.startswith("without")))
            text = f"wear, {how}: rank correlation"
            claims.append(Claim.definite(text, correlation, at_least(0.9), len(wear), every))
        claims += _order_claims(wear)
        worn = rows_where(table, table["case"] == BOUNDED_CASE).dropna(subset=["bound [-]"])
        known, free, drift = (float(np.median(worn[name].to_numpy())) for name in BOUNDS)
        return [
            *claims,
            Claim.definite("Cramer-Rao bound, spectrum's shape known", known, at_most(WITHIN), len(worn)),
            Claim.definite("growth of the bound if its corner is free", free / known, above(1.0), len(worn)),
            Claim.definite(
                "change of conicity by an assumed corner that is 10 % too low", drift, at_most(WITHIN), len(worn)
            ),
        ]

    def notes(self) -> list[str]:
        """Why a track without known spectrum gives no conicity."""
        return [
            "For any conicity function F' there is a rail d' = y - F'^-1(F(y - d)) with the same yaw moment, so the "
            "same motion: only the spectrum of d tells them apart.",
            "The bounds are those of the smoother's own model; what that lacks (creep, gauge, sharp contact changes) "
            "is ten times larger and stands in its model_error.",
            "With gauge variation the conicity itself changes along the line, with a hollow wheel by more than its "
            "mean. Rail and gauge cannot be told apart at an instant; over a minute only the right wheel makes both "
            "look like rails and gauge; least known is the gauge's mean, which shifts the wheel's profile.",
        ]


def _case_claims(name: str, rows: pd.DataFrame) -> list[Claim]:
    """Wheels of one wear, gauge constant or not: a case is a seed."""
    error = (rows["estimate [-]"] - rows["at nominal gauge [-]"]).to_numpy()
    shape = rows["function rms [-]"].to_numpy()
    worn, varies = CASES[name][0] > 0.0, CASES[name][1]
    inside = _share(f"{name}: within 2 std", _within_two_std(rows), HONEST)
    claims = [
        _rms(f"{name}: rms error over the seeds, profiles at nominal gauge", error),
        _because(
            _share(f"{name}: share of seeds within 0.03", np.abs(error) <= WITHIN, at_least(0.95)),
            SEARCH * (worn and varies),
        ),
        _because(_rms(f"{name}: function over the inner shifts, rms", shape), CURVED * worn),
        _because(inside, ONE_SIZE * (not varies)),
    ]
    return claims + (_with_gauge(name, rows) if varies else [])


def _within_two_std(rows: pd.DataFrame) -> np.ndarray:
    error = (rows["estimate [-]"] - rows["at nominal gauge [-]"]).to_numpy()
    return np.abs(error) <= 2 * rows["std [-]"].to_numpy()


def _share(text: str, hits: np.ndarray, target: Target) -> Claim:
    return Claim.sampled(text, float(np.mean(hits)), target, intervals.of_share(hits))


def _rms(text: str, errors: np.ndarray) -> Claim:
    rms = root_mean_square(errors)
    return Claim.sampled(text, rms, at_most(WITHIN), intervals.of_rms(errors))


def _because(claim: Claim, why: str) -> Claim:
    """The claim, with the reason where it is not held."""
    return replace(claim, claim=claim.claim + why) if claim.held is False else claim


def run_row(
    wear: float,
    speed: float,
    duration: float,
    seed: int,
    gauge: bool,
    bounded: bool = False,
    known: bool = False,
    engine: str = "compiled",
) -> dict[str, Any]:
    """True and estimated conicity of one run; Cramer-Rao bounds at the estimate; least squares with the known track."""
    true, measured = record(wear, speed, duration, seed, gauge, engine=engine)
    smoother = ConicitySmoother() if gauge else ConicitySmoother(gauge=0.0)
    estimate = smoother.estimate(measured)
    function = estimate.about["conicity_function"]
    errors = function_errors(function, true)
    at_nominal_gauge = true_conicity(wear, true.shift)
    inner = rows_where(errors, errors["inner [-]"] > 0.5)
    missed = inner["estimate [-]"] - true_conicity(wear, inner["shift [m]"].to_numpy())
    apart, together = by_gauge(wear, true.shift, true.gauge)
    std = float(estimate.about["effective_conicity_std [-]"])
    effective = float(estimate.about["effective_conicity [-]"])
    row: dict[str, Any] = {
        "wear [-]": wear,
        "speed [m/s]": speed,
        "true [-]": float(true.half_difference @ true.shift / (true.shift @ true.shift)),
        "at nominal gauge [-]": float(at_nominal_gauge @ true.shift**2 / (true.shift @ true.shift)),
        "estimate [-]": effective,
        "true at 2 mm [-]": float(true_conicity(wear, np.array([AMPLITUDE]))[0]),
        "at 2 mm [-]": at_shift(function["shift [m]"], function["conicity [-]"]),
        "best cone [-]": estimate.about["found"].get("best cone over the run [-]", effective),
        "gauge apart [-]": apart,
        "gauge together [-]": together,
        "std [-]": std,
        "own std [-]": float(np.sqrt(max(std**2 - smoother.model_error**2, 0.0))),
        "function rms [-]": float(np.sqrt(np.nanmean(missed**2))),
    }
    if bounded:
        row |= bounds(smoother, measured, estimate.series["wheelset1.lateral_shift [m]"].to_numpy())
    if known:
        least_squares = ConicityLeastSquares(pieces=(16,)).estimate(measured)
        known_track = least_squares.about["conicity_function"]
        series = least_squares.series.dropna()
        weight = series["wheelset1.lateral_shift [m]"] ** 2
        row["least squares [-]"] = float(np.average(series["conicity [-]"], weights=weight))
        row["least squares at 2 mm [-]"] = at_shift(known_track["shift [m]"], known_track["at_nominal_gauge [-]"])
    return row


def at_shift(shift: Any, conicity: Any) -> float:
    """Conicity at `AMPLITUDE`, mean of both sides."""
    return float(np.mean(np.interp([-AMPLITUDE, AMPLITUDE], shift, conicity)))


def bounds(smoother: ConicitySmoother, measured: Any, shift: np.ndarray) -> dict[str, float]:
    """Standard deviation of the best cone's conicity by the Fisher information, corner of the spectrum known or not."""
    likelihood, parameters = smoother.fitted(measured)
    error, variance = likelihood.innovations(parameters)
    corner = likelihood.numbers.corner
    other = Likelihood(
        likelihood.record, likelihood.numbers._replace(corner=corner * (1 + CORNER_STEP)), likelihood.prior,
        smoother.reach, smoother.pieces,
    )  # fmt: skip
    moved, spread = other.innovations(parameters)
    by_error, by_variance = likelihood.sensitivities(parameters)
    by_error = np.vstack([by_error, ((moved - error) / (CORNER_STEP * np.sqrt(variance))).ravel()])
    by_variance = np.vstack([by_variance, ((spread - variance) / (CORNER_STEP * variance)).ravel()])
    information = by_error @ by_error.T + 0.5 * by_variance @ by_variance.T
    own = information[:-1, :-1] + likelihood.prior_precision
    place = np.abs(shift)
    basis = np.stack([np.interp(place, likelihood.shift, column) for column in likelihood.basis.T], axis=1)
    weights = np.zeros(len(parameters))
    weights[: likelihood.count] = shift**2 @ basis / np.sum(shift**2)
    covariance = np.linalg.inv(own)
    cross = covariance @ information[:-1, -1]
    left = information[-1, -1] - information[:-1, -1] @ cross
    known = float(weights @ covariance @ weights)
    return {
        "bound [-]": known**0.5,
        "bound, corner free [-]": (known + float(weights @ cross) ** 2 / max(float(left), 1e-12)) ** 0.5,
        "by corner [-]": abs(0.1 * float(weights @ cross)),
    }


def order(true: np.ndarray, estimated: np.ndarray) -> tuple[float, float]:
    """Share of the runs that stand in their right place, and correlation of the ranks."""
    ranks = [np.argsort(np.argsort(values, kind="stable")) for values in (true, estimated)]
    return float(np.mean(ranks[0] == ranks[1])), float(np.corrcoef(ranks[0], ranks[1])[0, 1])


def _with_gauge(name: str, rows: pd.DataFrame) -> list[Claim]:
    """The run's own best cone; why that is not the conicity at nominal gauge; what the record can tell at all."""
    cone = (rows["best cone [-]"] - rows["true [-]"]).to_numpy()
    nominal, apart, together = (
        rows[column].to_numpy() for column in ("at nominal gauge [-]", "gauge apart [-]", "gauge together [-]")
    )
    bound = float(np.median(rows["own std [-]"].to_numpy()))
    within = _share(f"{name}: share of runs whose own best cone is within 0.03", np.abs(cone) <= WITHIN, at_least(0.95))
    spread = f"{name}: std by the likelihood's profile over the mean gauge"
    return [
        _because(within, SEARCH * (CASES[name][0] > 0.0)),
        _less(f"{name}: what the profile's bends take from the best cone, gauge independent", apart - nominal),
        _less(f"{name}: what the motion takes more, being largest on wide gauge", together - apart),
        Claim.sampled(spread, bound, at_most(WITHIN), intervals.of_median(rows["own std [-]"].to_numpy())),
    ]


def _less(text: str, differences: np.ndarray) -> Claim:
    return Claim.sampled(text, float(np.mean(differences)), below(0.0), intervals.of_mean(differences))


def by_gauge(wear: float, shift: np.ndarray, gauge: np.ndarray) -> tuple[float, float]:
    """Best cone of the profiles over a run's shifts with its gauge taken elsewhere along the line, and with its own."""
    left = left_side(wear)

    def cone(other: np.ndarray) -> float:
        radii = [np.interp(sign * shift - other / 2.0, left.shift, left.radius) for sign in (1.0, -1.0)]
        return float((radii[0] - radii[1]) / 2.0 @ shift / (shift @ shift))

    elsewhere = np.linspace(0.1, 0.9, ELSEWHERE) * len(gauge)
    return float(np.mean([cone(np.roll(gauge, int(places))) for places in elsewhere])), cone(gauge)


def _order_claims(wear: pd.DataFrame) -> list[Claim]:
    """Whether the order of ten can be had at all: spacing of the states against the errors of the same runs."""
    claims = []
    true = np.sort(wear["true at 2 mm [-]"].to_numpy())
    spacing = float(np.mean(np.diff(true)))
    drawn = np.random.default_rng(FIRST_SEED).standard_normal((DRAWS, len(wear)))

    def exact(deviation: float) -> float:
        """Chance that errors of that standard deviation leave all in their order."""
        return float(np.mean(np.all(np.diff(true + deviation * drawn, axis=1) > 0.0, axis=1)))

    for column, how in (("at 2 mm [-]", "without track"), ("least squares at 2 mm [-]", "least squares, track known")):
        error = (wear[column] - wear["true at 2 mm [-]"]).to_numpy()
        deviation, (low, high, cases) = float(np.std(error, ddof=1)), intervals.of_deviation(error)
        claims += [
            Claim.sampled(
                f"wear, {how}: std of the error over the spacing of the states",
                deviation / spacing,
                at_most(0.3),
                intervals.Interval(low / spacing, high / spacing, cases),
            ),
            Claim.sampled(
                f"wear, {how}: chance of ten in exact order by that",
                exact(deviation),
                at_least(0.9),
                intervals.Interval(exact(high), exact(low), cases),
            ),
        ]
    return claims


def _cases(table: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    return [(name, rows) for name in CASES if len(rows := rows_where(table, table["case"] == name))]


def _diagonal(axes: Axes, table: pd.DataFrame) -> None:
    true = table["at nominal gauge [-]"].to_numpy()
    ends = (0.9 * float(true.min()), 1.1 * float(true.max()))
    axes.plot(ends, ends, color=BLACK, lw=0.8)
    axes.fill_between(
        ends, np.subtract(ends, WITHIN), np.add(ends, WITHIN), color=BLACK, alpha=0.08, lw=0, label=f"within {WITHIN:g}"
    )
