"""The rough order of effects against the marginal likelihood of the same linear model, by another formula; misfit."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.discrepancy.core.fitting import finish, fit
from experiments.discrepancy.core.levels import middles
from experiments.discrepancy.core.model import Coordinate, Effect, Hypothesis, Level, Library
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.priors import HalfNormal, LogNormal
from experiments.discrepancy.core.problem import Problem, raised
from experiments.discrepancy.core.screen import SIZE, misfit, rough_gains
from experiments.discrepancy.core.search import infer
from experiments.discrepancy.core.verdict import decide
from tests.experiments.discrepancy.toy import BEND, STEEP, Line, line


@pytest.mark.parametrize(("bend", "powers"), [(0.0, [2]), (0.4, [2]), (0.4, [3, 2])])
def test_a_rough_gain_is_a_ratio_of_likelihoods(bend: float, powers: list[int]) -> None:
    system = Line(line(3, bend=bend))
    none = fit(Problem(system, Hypothesis(), Policy()), np.zeros(2))
    assert none is not None
    changes = np.stack([0.5 * system.time**power for power in powers])
    bent = replace(BEND, shown=(changes[:, None, None],))
    latent = np.array([one.place is not None for one in system.levels])
    high = np.where(latent, np.maximum(none.psi, raised(system.levels)), none.psi)
    lines = np.stack([np.ones_like(system.time), system.time])

    def value(covariance: np.ndarray) -> float:
        return -0.5 * float(system.seen @ np.linalg.solve(covariance, system.seen) + np.linalg.slogdet(covariance)[1])

    def gains(psi: np.ndarray) -> list[float]:
        errors = np.tensordot(np.exp(2.0 * psi), system.covariances(none.x, ())[0][:, 0], 1)
        healthy = errors + lines.T @ np.diag([1.0, 0.1**2]) @ lines
        steep = errors + lines.T @ np.diag([1.0, 3.0**2]) @ lines
        return [value(healthy + SIZE**2 * changes.T @ changes) - value(healthy), value(steep) - value(healthy)]

    expected = np.maximum(gains(high), gains(none.psi))  # whichever gains more
    assert rough_gains(none, (bent, STEEP), Policy()) == pytest.approx(expected, abs=0.02)


def bent_lines(seed: int, size: float, count: int = 400) -> tuple[Line, tuple[Effect, ...]]:
    """A line on which waves of random size stand that no hypothesis has, and effects that are such waves."""
    rng = np.random.default_rng(seed)
    time, clean = np.linspace(-1.0, 1.0, count), line(seed, count=count)
    waves = [
        np.cos(np.pi * (k * time + phase)) for k, phase in zip(range(3, 33), rng.uniform(0.0, 2.0, 30), strict=True)
    ]
    levels = (Level("noise", "sensor", LogNormal(1.0, 0.3)), Level("drift", "force", HalfNormal(1e-3), "drift"))
    one = 0.05 / np.sqrt(0.5 * count)  # of a wave whose score has the deviation 1 by noise alone
    system = Line(clean + size * one * rng.standard_normal(30) @ np.stack(waves), levels=levels)
    effects = [replace(BEND, name=f"wave {k}", family=f"wave {k}", shown=((10.0 * one * wave)[None, None, None],))
               for k, wave in enumerate(waves)]  # fmt: skip
    return system, tuple(effects)


def test_a_model_that_errs_as_it_says_has_no_misfit() -> None:
    found = []
    for seed in range(6):
        system, effects = bent_lines(seed, 0.0)
        none = fit(Problem(system, Hypothesis(), Policy()), np.zeros(2))
        assert none is not None
        found.append(misfit(none, effects, Policy()))
    assert max(found) < 1.5 and float(np.mean(found)) < 1.2


def test_misfit_is_the_mean_square_of_the_scores() -> None:
    """Waves of `size` beside noise: z^2 is 1 + size^2 in the mean; ten families are taken as 1."""
    size, found = 5.0, []
    for seed in range(6):
        system, effects = bent_lines(seed, size)
        start = np.array([0.3, 0.05])
        problem = Problem(system, Hypothesis(), Policy())
        held = finish(problem, start, middles(system.levels), problem.groups(start, system.covariances(start, ())))
        found.append(misfit(replace(held, psi=middles(system.levels)), effects, Policy()))
    assert float(np.mean(found)) == pytest.approx((30 * (1.0 + size**2) + 10) / 40, rel=0.25)


def test_a_nat_counts_less_where_the_model_lacks_more() -> None:
    system = Line(line(3, bend=0.1))
    none, bent = (
        fit(Problem(system, Hypothesis(effects), Policy()), np.zeros(2 + len(effects))) for effects in ((), (BEND,))
    )
    assert none is not None and bent is not None
    library = Library((BEND, STEEP))
    usual, less = (decide([none, bent], library, ("drift",), Policy(), misfit=size) for size in (1.0, 4.0))
    first, then = ({row.fit.hypothesis.name: row for row in one.rows}["bend"] for one in (usual, less))
    assert then.evidence == pytest.approx(first.evidence / 4.0) and less.misfit == 4.0
    assert abs(then.posterior - 0.5) < abs(first.posterior - 0.5)


MIRROR = Effect("mirror", "mirror", own=(Coordinate("bend", "1/s2", 0.0, 1.0),), starts=((0.5,),), place="drift")
THIRDS = tuple(
    Effect(f"third {k}", f"third {k}", own=(Coordinate("third", "1/s3", 0.0, 1.0),), starts=((0.5,),), place="drift")
    for k in range(Policy().candidates)
)


class Mirrored(Line):
    """Beside `mirror` the line falls with its slope, and faster: the slopes of a fit without it lead the wrong way."""

    def predict(self, points: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        name, slope = (effects[-1].name if effects else ""), points[:, 1:2]
        slope, power = (
            (-0.5 * np.sinh(2.0 * slope) if name == "mirror" else slope),
            (3 if name.startswith("third") else 2),
        )
        own = points[:, 2:3] * self.time**power if effects else 0.0
        return ((points[:, :1] + slope * self.time + own)[:, None, None],)


def test_steps_with_slopes_of_another_model_do_not_hide_an_effect() -> None:
    """The bend comes with the mirror, so that is fitted, though steps with the slopes of `none` lead away from it."""
    wide = (Coordinate("offset", "-", 0.0, 1.0), Coordinate("slope", "1/s", 0.0, 3.0))
    system = Mirrored(line(7, bend=0.5, slope=1.0), coordinates=wide)
    verdict = infer(system, Library((*THIRDS, MIRROR)))
    assert verdict.action.families == ("mirror",)
