"""The inference: likelihood and evidence against closed forms, verdicts on a system with everything and no physics."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.discrepancy.core.fitting import fit, with_unknown
from experiments.discrepancy.core.healthy import learned_scales
from experiments.discrepancy.core.levels import Sums, cost, fit_levels, middles, slopes
from experiments.discrepancy.core.model import Coordinate, Effect, Group, Hypothesis, Level, Library, as_healthy
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.priors import HalfNormal, LogNormal
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.screen import first_gains
from experiments.discrepancy.core.search import infer
from experiments.discrepancy.core.shared import Gaussian, combined, message
from experiments.discrepancy.core.verdict import Action, State, loss
from railsim.errors import InputError
from tests.experiments.discrepancy.toy import BEND, LIBRARY, STEEP, Line, line

POLICY = Policy()


def parts(seed: int = 1) -> tuple[Sums, ...]:
    """Complex frames with three sources of error."""
    rng = np.random.default_rng(seed)
    roots = rng.standard_normal((3, 4, 3, 3)) + 1j * rng.standard_normal((3, 4, 3, 3))
    residual = rng.standard_normal((4, 5, 3)) + 1j * rng.standard_normal((4, 5, 3))
    return (Sums.of(Group(residual, roots @ np.conj(np.swapaxes(roots, -1, -2)))),)


def test_slope_of_the_levels_is_that_of_their_cost():
    psi, step = np.array([-0.3, 0.2, 0.5]), 1e-5
    slope, _ = slopes(parts(), psi)
    for index, shift in enumerate(step * np.eye(3)):
        difference = (cost(parts(), psi + shift) - cost(parts(), psi - shift)) / (2.0 * step)
        assert slope[index] == pytest.approx(difference, rel=1e-6)


def test_fisher_information_is_the_mean_curvature():
    """Over residuals drawn from the covariance itself."""
    rng, one, psi, step = np.random.default_rng(2), parts()[0], np.array([-0.3, 0.2, 0.5]), 1e-3
    root = np.linalg.cholesky(one.covariance(psi))
    many = 4000
    white = (rng.standard_normal((4, many, 3)) + 1j * rng.standard_normal((4, many, 3))) / np.sqrt(2.0)
    drawn = (Sums.of(Group(np.einsum("fcd,ftd->ftc", root, white), one.components)),)
    _, fisher = slopes(drawn, psi)
    for index, shift in enumerate(step * np.eye(3)):
        curvature = (cost(drawn, psi + shift) - 2.0 * cost(drawn, psi) + cost(drawn, psi - shift)) / step**2
        assert fisher[index, index] == pytest.approx(curvature, rel=0.05)


@pytest.mark.parametrize("prior", [LogNormal(0.2, 0.8), HalfNormal(0.03)])
def test_priors_are_densities_with_the_slope_they_state(prior):
    psi = np.linspace(prior.middle - 14.0, prior.middle + 8.0, 20001)
    values = np.array([prior.cost(one)[0] for one in psi])
    assert np.trapezoid(np.exp(-values), psi) == pytest.approx(1.0, abs=1e-4)
    stated = np.array([prior.cost(one)[1] for one in psi])
    assert stated[1:-1] == pytest.approx((values[2:] - values[:-2]) / (psi[2:] - psi[:-2]), abs=0.05, rel=1e-3)


def test_evidence_of_a_linear_system_is_the_closed_form():
    """With levels known to 1e-5 the marginal likelihood is a normal density."""
    known = tuple(
        replace(level, prior=LogNormal(size, 1e-5))
        for level, size in zip(Line(line(1)).levels, (1.0, 0.1), strict=True)
    )
    system = Line(line(1), levels=known)
    found = fit(Problem(system, Hypothesis((BEND,)), POLICY), np.zeros(3))
    assert found is not None
    design = np.stack([np.ones_like(system.time), system.time, system.time**2], axis=1)
    noise = np.tensordot([1.0, 0.01], system.covariances(np.zeros(3), ())[0][:, 0], 1)
    total = design @ np.diag([1.0, 0.01, 1.0]) @ design.T + noise
    closed = -0.5 * (np.linalg.slogdet(total)[1] + system.seen @ np.linalg.solve(total, system.seen))
    assert found.evidence == pytest.approx(closed, abs=1e-3)


def test_an_unknown_beside_a_fit_is_what_a_whole_fit_gives():
    system = Line(line(3, drift=0.3))
    none = fit(Problem(system, Hypothesis(), POLICY), np.zeros(2))
    assert none is not None
    drift = system.levels[1:]
    quick = with_unknown(POLICY, none, drift)
    whole = fit(Problem(system, Hypothesis((), drift), POLICY), np.zeros(2))
    assert whole is not None
    assert quick.evidence == pytest.approx(whole.evidence, abs=0.3)


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (line(4), "none"),
        (line(5, bend=0.6), "bend"),
        (line(6, slope=3.0), "steep"),
        (line(7, drift=0.5), "unknown: drift"),
    ],
)
def test_verdicts(record: np.ndarray, said: str):
    assert str(infer(Line(record), LIBRARY).action) == said


def test_what_the_library_does_not_know_is_unknown():
    verdict = infer(Line(line(5, bend=0.6)), Library((STEEP,)))
    assert verdict.action == Action("unknown", (), "drift")


def test_what_follows_the_motion_is_part_of_what_is_unknown():
    """A force without a name that has a slope too: the slope's name does not stand beside it where it is of its law."""
    record = line(9, slope=2.0, drift=0.5)
    levels = Line(record).levels
    knowing = (levels[0], replace(levels[1], law=STEEP.faults))
    assert Hypothesis((), knowing[1:]).coordinates(Line(record).coordinates)[1] == STEEP.faults[0]
    library = LIBRARY.without("bend")
    assert infer(Line(record), library).action == Action("name and unknown", ("steep",), "drift")
    verdict = infer(Line(record, levels=knowing), library)
    assert verdict.action == Action("unknown", (), "drift")
    assert any("unknown: drift: fitted whole" in step for step in verdict.steps)


def test_a_law_with_wide_priors_is_something_unknown_at_its_place():
    law = Effect("unknown: law", "law", STEEP.faults, place="drift", kind="law")
    verdict = infer(Line(line(6, slope=3.0)), Library((BEND, law)))
    assert verdict.action == Action("unknown", (), "drift") and verdict.rows[0].fit.hypothesis.name == "unknown: law"


def test_what_healthy_systems_have_a_little_of_is_not_named():
    """A bend that is plain to see, of a size that healthy lines have."""
    record, own = line(5, bend=0.15), (replace(BEND.own[0], spread=0.15),)
    assert str(infer(Line(record), LIBRARY).action) == "bend"
    verdict = infer(Line(record), Library((replace(BEND, healthy=own), STEEP)))
    assert str(verdict.action) == "none" and verdict.rows[0].fit.hypothesis.name == "small bend"


def test_something_unknown_beside_what_healthy_systems_have_is_no_fault():
    own = (replace(BEND.own[0], spread=0.3),)
    verdict = infer(Line(line(2, bend=0.3, drift=1.0)), Library((replace(BEND, healthy=own, place=None), STEEP)))
    assert verdict.action == Action("unknown", (), "drift")
    assert verdict.rows[0].fit.hypothesis.name == "small bend + unknown: drift"


def test_a_verdict_without_time_says_what_it_did_not_try():
    verdict = infer(Line(line(5, bend=0.6)), LIBRARY, limit=0.0)
    assert [row.fit.hypothesis.name for row in verdict.rows] == ["none"]
    assert {"bend: no time left", "steep: no time left"} <= set(verdict.not_tried)


def test_an_effect_that_does_what_a_tolerance_does_beside_it_is_that_tolerance_with_both_variances():
    system, wide = Line(line(6, slope=2.0)), Coordinate("slope alone", "1/s", 1.0, 3.0)
    beside = Effect("beside", "steep", own=(wide,), moves=(("slope", 1.0),))
    both = Effect("both", "steep", faults=(Coordinate("slope", "1/s", 1.0, np.hypot(3.0, 0.1)),))
    fits = [fit(Problem(system, Hypothesis((one,)), POLICY), one.begins(np.zeros(2), system.coordinates)[0])
            for one in (beside, both)]  # fmt: skip
    assert fits[0] is not None and fits[1] is not None
    assert fits[0].evidence == pytest.approx(fits[1].evidence, abs=1e-3)
    assert fits[0].x[1:].sum() == pytest.approx(fits[1].x[1], abs=1e-4)


@pytest.mark.parametrize("candidates", [1, 9])
def test_an_effect_that_two_tolerances_have_taken_begins_where_they_give_it_back(candidates: int):
    ramp = Effect("ramp", "ramp", own=(Coordinate("ramp", "-", 0.5, 1.0),), moves=(("offset", 1.0), ("slope", 1.0)))
    system = Line(line(6, slope=2.05) + 2.0)
    none = fit(Problem(system, Hypothesis(), POLICY), np.zeros(2))
    assert none is not None
    begin = ramp.begins(none.x, system.coordinates)[0]
    same = system.predict(begin[None], (ramp,))[0] - system.predict(none.x[None], ())[0]
    assert np.abs(same).max() < 1e-12
    before = [Problem(system, Hypothesis((ramp,)), POLICY).prior(begin + step * np.array([-1.0, -1.0, 1.0]))
              for step in (-0.1, 0.0, 0.1)]  # fmt: skip
    assert before[1] < min(before[0], before[2])
    verdict = infer(system, Library((BEND, ramp)), replace(POLICY, candidates=candidates))
    assert str(verdict.action) == "ramp"
    assert verdict.rows[0].fit.x == pytest.approx([0.3, 0.05, 2.0], abs=0.15)


def test_effects_by_tolerances_leave_the_numbers_of_others_where_they_are():
    lift = Effect("lift", "lift", own=(Coordinate("lift", "-", 0.0, 1.0),), moves=(("offset", 2.0),))
    points, effects = as_healthy(np.array([[1.0, 2.0, 3.0, 4.0]]), (lift, BEND), Line(line(1)).coordinates)
    assert effects == (BEND,) and points.tolist() == [[7.0, 2.0, 4.0]]


def test_order_of_the_library_units_and_signs_do_not_matter():
    record = line(5, bend=0.3)
    first = infer(Line(record), LIBRARY)
    for other in (infer(Line(record), Library((STEEP, BEND))), infer(Line(record, gain=-1e3), LIBRARY)):
        assert other.action == first.action
        for row in first.rows:
            twin = next(one for one in other.rows if one.fit.hypothesis.name == row.fit.hypothesis.name)
            assert twin.evidence == pytest.approx(row.evidence, abs=0.1)


def test_evidence_of_healthy_records_does_not_grow_with_their_length():
    """A little drift is what healthy systems have; white noise alone would make an effect of it, ever more surely."""
    largest = []
    for count in (40, 160):
        verdicts = [infer(Line(line(seed, drift=0.03, count=count)), LIBRARY) for seed in range(20, 26)]
        assert {str(verdict.action) for verdict in verdicts} == {"none"}
        largest.append(max(row.evidence for v in verdicts for row in v.rows if row.fit.hypothesis.effects))
    assert largest[1] < largest[0] + 2.0


def test_scales_of_latent_levels_are_learned():
    fits = []
    for seed in range(30, 50):
        found = fit(Problem(Line(line(seed, drift=0.15)), Hypothesis(), POLICY), np.zeros(2))
        assert found is not None
        fits.append(found)
    scale = learned_scales(fits, Line(line(1)).levels)["drift"]
    assert 0.04 < scale < 0.25


def test_a_level_that_no_record_tells_keeps_its_first_scale():
    """A drift of which a record shows nothing: its scale neither grows nor falls over the rounds."""
    system = Line(line(30))
    hidden = Level("hidden", "force", HalfNormal(0.02), "hidden")
    fits = []
    for seed in range(30, 36):
        found = fit(Problem(_Hidden(line(seed), levels=(*system.levels, hidden)), Hypothesis(), POLICY), np.zeros(2))
        assert found is not None
        fits.append(found)
    assert learned_scales(fits, (*system.levels, hidden))["hidden"] == pytest.approx(0.02, rel=0.02)


class _Hidden(Line):
    """A line with a third source that it does not hear."""

    def covariances(self, x: np.ndarray, effects: tuple[Effect, ...]) -> tuple[np.ndarray, ...]:
        (parts,) = super().covariances(x, effects)
        return (np.concatenate([parts, 0.0 * parts[:1]]),)


def test_levels_are_found_where_they_are():
    rng = np.random.default_rng(8)
    eye = np.eye(1)[None, None]
    levels = (Level("noise", "sensor", LogNormal(1.0, 1.0)),)
    residual = 3.0 * rng.standard_normal((1, 4000, 1))
    found = fit_levels((Sums.of(Group(residual, eye)),), levels, middles(levels))
    assert np.exp(found.psi[0]) == pytest.approx(3.0, rel=0.05)


def test_a_message_and_its_prior_give_what_was_known_afterwards():
    before = Gaussian(np.zeros(2), np.diag([1.0, 4.0]))
    after = Gaussian(np.array([0.3, -1.0]), np.array([[0.2, 0.1], [0.1, 0.5]]))
    again = combined(before, [message(after, before)])
    assert np.allclose(again.mean, after.mean) and np.allclose(again.covariance, after.covariance)


def test_losses_are_least_for_what_is_true():
    states = [State(), State(frozenset("a")), State(frozenset("ab")), State(unknown="p"), State(frozenset("a"), "p")]
    right = [Action("none"), Action("name", ("a",)), Action("pair", ("a", "b")), Action("unknown", (), "p"),
             Action("name and unknown", ("a",), "p")]  # fmt: skip
    for state, action in zip(states, right, strict=True):
        costs = [loss(other, state, POLICY.losses) for other in right]
        assert loss(action, state, POLICY.losses) == 0.0 and sum(one == 0.0 for one in costs) == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"lenght": 1.0}, "there is no number 'lenght'"), ({"none": -1.0}, "none must be a positive number")],
)
def test_a_wrong_policy_is_refused(changes: dict[str, float], words: str):
    with pytest.raises(InputError, match=words):
        Policy().but(changes)
    assert len(Policy().numbers()) <= 20


def test_two_effects_of_one_name_are_refused():
    with pytest.raises(InputError, match="two effects have one name"):
        Library((BEND, Effect("bend", "other")))


def test_a_search_ends_at_its_limit_within_a_fit_and_says_what_was_not_tried(monkeypatch):
    """By a clock that goes on by a second with each prediction."""
    clock, begins = [0.0], []
    monkeypatch.setattr("time.monotonic", lambda: clock[0])

    class Slow(Line):
        def predict(self, points, effects):
            clock[0] += 1.0
            begins.append([one.name for one in effects])
            return super().predict(points, effects)

    whole = infer(Slow(line(5, bend=0.6)), LIBRARY)
    first = next(number for number, effects in enumerate(begins) if effects)
    limit, clock[0] = first + 3.5, 0.0
    verdict = infer(Slow(line(5, bend=0.6)), LIBRARY, limit=limit)
    assert clock[0] <= limit + 1.0
    assert verdict.rows[0].fit.hypothesis.name == "none" or len(verdict.rows) < len(whole.rows)
    assert any(text.endswith("no time left") for text in verdict.not_tried)


class _Rippled(Line):
    """A line with a wave of its own."""

    def predict(self, points, effects):
        own = [one.name for one in effects if one.own]
        shapes = {"bend": self.time**2, "ripple": np.sin(6.0 * self.time)}
        added = points[:, 2:] @ np.array([shapes[name] for name in own]).reshape(len(own), len(self.time))
        return (super().predict(points, ())[0] + added[:, None, None],)


def test_a_large_library_is_searched_for_pairs_of_effects_with_coordinates_of_their_own():
    ripple = Effect("ripple", "ripple", own=(Coordinate("ripple", "-", 0.5, 0.25),), starts=((0.5,),))
    seen = line(5, bend=0.9) + 0.6 * np.sin(6.0 * np.linspace(-1.0, 1.0, 60))
    verdict = infer(_Rippled(seen), Library((BEND, STEEP, ripple)), replace(POLICY, candidates=1))
    assert str(verdict.action) == "bend and ripple"
    found = verdict.rows[0].fit
    sizes = dict(zip([one.name for one in found.hypothesis.effects], found.x[2:], strict=True))
    assert sizes == pytest.approx({"bend": 0.9, "ripple": 0.6}, abs=0.2)


@pytest.mark.parametrize(("late", "cut"), [("bend", True), ("steep", False)])
def test_a_search_that_did_not_look_at_every_effect_that_may_lead_says_so(monkeypatch, late: str, cut: bool):
    library, policy = Library((BEND, STEEP)), replace(POLICY, candidates=1)
    assert not infer(Line(line(5, bend=0.6)), library, policy).cut
    monkeypatch.setattr(
        "experiments.discrepancy.core.search.first_gains",
        lambda base, effects, *_: [one for one in first_gains(base, effects, policy) if one[1].name != late],
    )
    verdict = infer(Line(line(5, bend=0.6)), library, policy)
    assert verdict.cut is cut and "bend" in {row.fit.hypothesis.name for row in verdict.rows}
    assert any(one.startswith("steep: first steps gain") for one in verdict.not_tried)  # which cannot lead


def test_a_search_that_ends_before_none_is_tried_again_says_so(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr("experiments.discrepancy.core.search.time.monotonic", lambda: clock[0])

    def late(search: object) -> None:
        clock[0] = 2.0

    assert not infer(Line(line(5, bend=0.6)), LIBRARY, POLICY, limit=1.0).cut
    monkeypatch.setattr("experiments.discrepancy.core.search._none_again", late)
    assert infer(Line(line(5, bend=0.6)), LIBRARY, POLICY, limit=1.0).cut
