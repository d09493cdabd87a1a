"""What a pure evidence score breaks on: a test for each kind, with the cure and without it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from experiments.discrepancy.core.fitting import fit
from experiments.discrepancy.core.levels import Sums, best_levels, fit_levels, middles
from experiments.discrepancy.core.model import Coordinate, Effect, Group, Hypothesis, Level, Library
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.priors import HalfNormal, LogNormal
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.search import Search, infer
from experiments.discrepancy.core.verdict import Verdict
from experiments.discrepancy.systems.half_car import COUNT, FORCES, INDEX, HalfCar
from experiments.discrepancy.systems.half_car_truth import make
from tests.experiments.discrepancy.toy import BEND, LIBRARY, STEEP, Line, line

SEEDS = range(40, 44)
DRIFT = 0.8  # of healthy lines in these tests


def without(drift: LogNormal) -> tuple[Level, ...]:
    """Levels of a line whose drift has this prior, and is not asked for."""
    noise = Line(line(1)).levels[0]
    return (noise, Level("drift", "force", drift))


def accused(records: list[np.ndarray], levels: tuple[Level, ...], library: Library = LIBRARY) -> int:
    """How many of these lines are not said to be healthy."""
    return sum(str(infer(Line(one, levels=levels), library).action) != "none" for one in records)


def test_white_noise_alone_names_healthy_systems():
    records = [line(seed, drift=DRIFT) for seed in SEEDS]
    usual = replace(Line(line(1)).levels[1], prior=HalfNormal(0.16))
    assert accused(records, without(LogNormal(1e-3, 0.01))) >= 3
    assert accused(records, (Line(line(1)).levels[0], usual)) == 0


def test_a_limit_in_place_of_a_distribution_makes_healthy_systems_unknown():
    """A level that is held below its share of healthy systems: what is above it has to be something."""
    records, drift = [line(seed, drift=DRIFT) for seed in SEEDS], Line(line(1)).levels[1]
    held = replace(drift, prior=LogNormal(0.01, 0.01))
    spread = replace(drift, prior=HalfNormal(0.16))
    noise = Line(line(1)).levels[0]
    nothing = Library(())
    assert accused(records, (noise, held), nothing) >= 3
    assert accused(records, (noise, spread), nothing) == 0


def test_a_fault_prior_that_is_dense_at_healthy_sizes_names_them():
    """Lines whose slope is a tenth of a fault: no coordinate has a healthy prior of its own, and then one has."""
    fault = Effect("tilt", "tilt", own=(Coordinate("tilt", "1/s", 0.0, 1.0),))
    stiff = (Coordinate("offset", "-", 0.0, 1.0), Coordinate("slope", "1/s", 0.0, 1e-4))
    records = [line(seed, slope=0.1) for seed in SEEDS]
    library = Library((fault,))
    said = [str(infer(_Tilted(one, coordinates=stiff), library).action) for one in records]
    assert said.count("tilt") >= 3
    healthy = Library((Effect("tilt", "tilt", faults=(Coordinate("slope", "1/s", 0.0, 1.0),)),))
    assert {str(infer(Line(one), healthy).action) for one in records} == {"none"}


@dataclass(frozen=True, eq=False)
class _Tilted(Line):
    """A line with a second slope where an effect brings one."""

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        moved = points[:, :2].copy()
        if effects:
            moved[:, 1] += points[:, 2]
        return super().predict(moved, ())


def test_a_law_that_every_part_has_a_little_of_is_no_other_effect():
    """A bend that is a healthy law's: named where no hypothesis may bend, and not where all may bend a little."""
    curve = Effect("unknown: law", "law", (Coordinate("curve", "1/s2", 0.0, 1.0),), place="drift", kind="law")
    records = [line(seed, bend=0.12) for seed in SEEDS]
    assert accused(records, Line(line(1)).levels, Library((BEND,))) >= 3
    lawful = [infer(_Curved(one), Library((curve, STEEP))) for one in records]
    assert {str(one.action) for one in lawful} == {"none"}
    plain = infer(_Curved(line(40, bend=1.2)), Library((curve, STEEP)))
    assert str(plain.action) == "unknown: drift" and leads(plain) == "unknown: law"


def leads(verdict: Verdict) -> str:
    """The best hypothesis."""
    return verdict.rows[0].fit.hypothesis.name


@dataclass(frozen=True, eq=False)
class _Curved(Line):
    """A line whose own law may bend."""

    coordinates: tuple[Coordinate, ...] = (*Line(np.zeros(3)).coordinates, Coordinate("curve", "1/s2", 0.0, 0.15))

    def starts(self) -> np.ndarray:
        return np.zeros((1, 3))

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        del effects
        return super().predict(points, (BEND,))


def test_what_follows_the_state_is_a_law_and_no_force():
    """A bend that a drift could imitate: the law of few numbers is worth more than the force of many."""
    curve = Effect("unknown: law", "law", (Coordinate("curve", "1/s2", 0.0, 1.0),), place="drift", kind="law")
    verdict = infer(_Curved(line(7, bend=0.9)), Library((curve,)))
    values = {row.fit.hypothesis.name: row.evidence for row in verdict.rows}
    assert values["unknown: law"] > values["unknown: drift"] + 3.0


def test_none_is_tried_from_the_nuisances_of_the_best_effect():
    """Two valleys in a delay: the only start of `none` lies in the wrong one, that of the effect beyond the hill."""
    lag = Effect("lag", "lag", own=(Coordinate("lag", "s", 0.0, 0.1),), starts=((1.0,),))
    time = Line(line(41)).time
    seen = _chirp(time, np.array([1.0]))[0] + 0.05 * np.random.default_rng(41).standard_normal(len(time))
    verdict = infer(_Late(seen), Library((lag,)))
    assert any("none: from the nuisances of lag" in step for step in verdict.steps), verdict.steps
    assert str(verdict.action) == "none" and verdict.rows[0].fit.x[1] == pytest.approx(1.0, abs=0.05)


def _chirp(time: np.ndarray, delay: np.ndarray) -> np.ndarray:
    late = time - delay[..., None]
    return np.sin(6.0 * late + 2.0 * late**2)


@dataclass(frozen=True, eq=False)
class _Late(Line):
    """A chirp after a delay, to which an effect adds."""

    coordinates: tuple[Coordinate, ...] = (Coordinate("offset", "-", 0.0, 1.0), Coordinate("delay", "s", 0.0, 1.0))

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        delay = points[:, 1] + (points[:, 2] if effects else 0.0)
        return ((points[:, :1] + _chirp(self.time, delay))[:, None, None],)


def test_a_level_has_two_optima_and_the_better_one_is_found():
    """What is left may be laid to either of two places that sound alike; a search from one stays there."""
    rng = np.random.default_rng(3)
    columns = np.stack([[1.0, 0.9], [1.0, 1.1]])
    parts = np.stack([0.01 * np.eye(2), *(np.outer(one, one) for one in columns)])[:, None].astype(complex)
    residual = (rng.standard_normal((1, 200, 1)) * columns[1] + 0.1 * rng.standard_normal((1, 200, 2))).astype(complex)
    levels = (Level("noise", "sensor", LogNormal(1.0, 0.3)), *(Level(n, "force", HalfNormal(0.05), n) for n in "ab"))
    one = (Sums.of(Group(residual, parts)),)
    wrong = np.array([0.0, 0.0, -12.0])
    stuck, best = fit_levels(one, levels, wrong, steps=8), best_levels(one, levels, wrong)
    assert best.cost <= stuck.cost and best.psi[2] > best.psi[1]
    assert best.cost <= fit_levels(one, levels, middles(levels)).cost + 0.01


def test_an_effect_changes_what_the_error_of_the_survey_passes_through():
    """A weak damper lets an axle ring: the survey's error there is louder than at the nominal state."""
    system, weak = HalfCar(make(np.random.default_rng(1)).record), np.zeros(COUNT)
    weak[INDEX["log front damper"]] = np.log(0.3)
    at = int(np.argmin(np.abs(system.frames.frequencies - 10.5)))
    nominal, other = (np.real(system.covariances(x, ())[0][5, at, 0, 0]) for x in (np.zeros(COUNT), weak))
    assert other > 1.5 * nominal
    assert len(system.covariances(weak, ())[0]) == len(system.levels) and FORCES[0] in {s.place for s in system.levels}


def test_two_rounds_about_the_own_state_agree_before_anything_is_compared():
    system, policy = Line(line(5, bend=0.6)), Policy()
    found = fit(Problem(system, Hypothesis((BEND,)), policy), np.zeros(3))
    assert found is not None
    again = fit(Problem(system, Hypothesis((BEND,)), policy), found.x, found.psi, found.slopes)
    assert again is not None and again.evidence == pytest.approx(found.evidence, abs=policy.tolerance)
    search = Search(system, LIBRARY, policy)
    search.take(found, "fitted")
    search.take(again, "fitted again")
    assert search.fits["bend"].evidence == max(found.evidence, again.evidence)
