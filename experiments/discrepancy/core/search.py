"""The search: every effect is fitted, `none` gets every chance that the effects had, unknowns and pairs come last.

Most wrong verdicts come from a bad optimum, not from the score. So `none` is tried again from the nuisances of the
best effect (what nuisances can do is no evidence), every effect begins at the fit of `none` and at the nominal build,
and each half of a pair is tried alone from the pair.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from experiments.discrepancy.core.fitting import ROUNDS, few_steps, fit, with_unknown
from experiments.discrepancy.core.levels import cost, middles, sums
from experiments.discrepancy.core.model import Effect, Fit, Group, Hypothesis, Level, Library, System
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import OutOfTimeError, Problem, distinct, raised
from experiments.discrepancy.core.screen import first_gains, misfit, rough_gains
from experiments.discrepancy.core.verdict import Verdict, decide, log_prior
from railsim.errors import InputError

PAIRS = 3  # partners of the best effect that are fitted whole
START_STEPS = 4  # from each of two alignments
FIRST_STEPS = 2  # of each promising effect of a large library, before any is fitted whole
ORDERING = 0.4  # of the time that is left, which an order of effects may take
STEPPED = 3  # times as many effects as are fitted whole take a linear step from a run of their own
PROMISING = 2  # times as many effects as are fitted whole take these steps
REACH = 4.0  # times what first steps gain: no fit that could change a statement is taken to gain more
NEAR = 2.0  # times what first steps gain: effects that gain less than the best one do by this are not fitted
POLISHED = 2  # effects of a large library whose covariances are made anew
SETTLINGS = 6  # times at most that a system settles about a fit of `none`
BESIDE = 2  # effects beside which something unknown is looked for
HEAVY = 4  # of the best fits of each form in an ordered library, whose arrays stay
PLACES = 8  # where something unknown is looked for beside a fit, where runs are dear
WHOLE = 8  # of those that are fitted whole at most
HOPELESS = 20.0  # nats behind the leader, from where on nothing is fitted whole, or on

Ordered = tuple[float, Effect, np.ndarray]
"""What first steps gain, of which effect, and where they lead."""


def places(levels: Sequence[Level], library: Library) -> tuple[str, ...]:
    """Where something may be unknown, and of each law."""
    laws = [effect.place for effect in library.effects if effect.kind == "law"]
    return tuple(place for place in (*dict.fromkeys(level.place for level in levels), *laws) if place is not None)


@dataclass
class Search:
    """A search under way: the best fit of every hypothesis so far, and what was done."""

    system: System
    library: Library
    policy: Policy
    fits: dict[str, Fit] = field(default_factory=dict)
    steps: list[str] = field(default_factory=list)
    not_tried: list[str] = field(default_factory=list)
    end: float = math.inf  # of time.monotonic()
    say: Callable[[str], None] = lambda _: None
    beside: set[tuple[str, float]] = field(default_factory=set)  # names and evidence of fits: an unknown was looked for
    counts: float = 1.0  # what a nat counts of what effects gain, see `screen.misfit`
    cut: bool = False  # whether the time ended before the likeliest effects were fitted, and `none` once more

    @property
    def ordered(self) -> bool:
        """Whether effects are ordered, and the likeliest fitted: there are many, or runs are dear."""
        return self.system.dear or len(self.library.effects) > self.policy.candidates

    def late(self, what: str) -> bool:
        """Whether there is no time left for a hypothesis, which is then noted; there always is for the first."""
        if time.monotonic() < self.end or not self.fits:
            return False
        self.not_tried.append(f"{what}: no time left")
        return True

    def step(self, text: str) -> None:
        """Something was done: it is kept, and told."""
        self.steps.append(text)
        self.say(text)

    def verdict(self) -> Verdict:
        """Over all that was fitted."""
        fits, where = list(self.fits.values()), places(self.system.levels, self.library)
        beyond = misfit(max(fits, key=self.value), self.library.effects, self.policy)
        found = decide(fits, self.library, where, self.policy, self.not_tried, self.steps, beyond)
        return replace(found, cut=self.cut)

    def problem(self, *effects: Effect, unknown: tuple[Level, ...] = ()) -> Problem:
        """Of these effects, and of something unknown at these levels."""
        end = self.end if self.fits else math.inf
        return Problem(self.system, Hypothesis(effects, unknown), self.policy, end)

    def attempt(self, what: str, how: str, make: Callable[[], Fit | None]) -> None:
        """Keep the fit of a hypothesis that `make` makes, unless the time ends before."""
        self.attempts([(what, how, make)])

    def attempts(self, tasks: Sequence[tuple[str, str, Callable[[], Fit | None]]]) -> bool:
        """The same of several, side by side; whether the time sufficed for one round of each at least."""
        begun = [one for one in tasks if not self.late(one[0])]
        found = self.system.side_by_side([partial(_in_time, make) for _, _, make in begun])
        for (what, how, _), (one, done) in zip(begun, found, strict=True):
            if done:
                self.take(one, how)
            else:
                self.late(what)
        self._lighten()
        return len(begun) == len(tasks) and all(done for _, done in found)

    def _lighten(self) -> None:
        """Let go of the arrays of fits that nothing begins from any more."""
        best: dict[tuple[int, int, bool], list[str]] = {}
        for one in sorted(self.fits.values(), key=lambda found: -self.value(found)):
            what = one.hypothesis
            best.setdefault((len(what.named), len(what.effects), bool(what.unknown)), []).append(what.name)
        kept = {name for names in best.values() for name in names[:HEAVY]}
        if self.ordered:
            self.fits = {name: one if name in kept else one.light() for name, one in self.fits.items()}

    def take(self, found: Fit | None, what: str) -> None:
        """Keep a fit where it is better than the one so far."""
        if found is None:
            return
        name = found.hypothesis.name
        before = self.fits.get(name)
        if before is None or found.evidence > before.evidence:
            gained = "" if before is None else f" (+{found.evidence - before.evidence:.1f} nats)"
            self.step(f"{name}: {what}{gained}")
            self.fits[name] = found

    def named(self) -> list[Fit]:
        """Fits with effects that no healthy system has, the likeliest first."""
        kept = [one for one in self.fits.values() if one.hypothesis.effects and not one.hypothesis.unknown]
        return sorted((one for one in kept if not _small(one)), key=lambda one: -self.value(one))

    def prior(self, hypothesis: Hypothesis) -> float:
        """Its log."""
        return log_prior(hypothesis, self.library, places(self.system.levels, self.library), self.policy)

    def value(self, found: Fit) -> float:
        """Evidence and prior together."""
        return found.evidence + self.prior(found.hypothesis)


def _in_time(make: Callable[[], Fit | None]) -> tuple[Fit | None, bool]:
    """What it makes, and whether the time sufficed."""
    try:
        return make(), True
    except OutOfTimeError:
        return None, False


def infer(
    system: System,
    library: Library,
    policy: Policy | None = None,
    limit: float = math.inf,
    say: Callable[[str], None] = lambda _: None,
) -> Verdict:
    """What is missing in a model.

    limit : seconds after which no further hypothesis is begun; the verdict is over those that were fitted and says
    which were not. `none` is always fitted. say : told each step.

    Raises
    ------
    InputError : the predictions of the nominal model are not finite.
    """
    search = Search(system, library, policy or Policy(), end=time.monotonic() + limit, say=say)
    nominal = _none(search)
    if search.ordered:
        _effects_in_order(search, nominal)
    else:
        none = search.fits["none"]
        sought = [one.sought(none) for one in library.effects]
        promising = sorted(first_gains(none, sought, search.policy, search.end), key=lambda one: -one[0])
        search.attempts([
            (effect.name, "fitted", partial(fit, search.problem(effect), begin))
            for effect in {one.name: one for one in (*(one for _, one, _ in promising), *sought)}.values()
            for begin in distinct([*effect.begins(none.x, system.coordinates),
                                   *effect.begins(nominal, system.coordinates)])
        ])  # fmt: skip
    search.cut |= not _none_again(search)
    search.cut |= not _small_ones(search)
    _unknowns(search)
    _pairs(search)
    _small_ones(search)
    _unknowns(search)
    _whole(search)
    return search.verdict()


def healthy_fit(system: System, policy: Policy) -> Fit:
    """`none` alone, of a system that is known to be healthy."""
    search = Search(system, Library(()), policy)
    _none(search)
    _none_again(search)
    return search.fits["none"]


def _none(search: Search) -> np.ndarray:
    """Alignment from all starts, a few steps from the two best, the fit; gives the nominal build with the best one."""
    starts = search.system.starts()
    problem = replace(search.problem(), system=search.system.about(starts[0], (), None))
    components = problem.system.covariances(starts[0], ())
    residuals = problem.residuals(starts)
    high, costs = raised(problem.levels), []
    for index, start in enumerate(starts):
        groups = [Group(residual[index], part) for residual, part in zip(residuals, components, strict=True)]
        costs.append(cost(sums(groups), high) + problem.prior(start))
    if not np.isfinite(costs).any():
        raise InputError("the nominal model gives no finite prediction of this record; check its sheet and its start")
    best = starts[np.argsort(costs)[:2]]
    slopes = problem.slopes(best[0], problem.groups(best[0], components))
    steps = [partial(few_steps, problem, x, middles(problem.levels), components, START_STEPS, slopes) for x in best]
    _, begin = max(problem.system.side_by_side(steps), key=lambda one: one[0])
    whole = partial(fit, search.problem(), begin, None, slopes, 1)
    search.attempt("none", "fitted roughly from the better of two alignments", whole)
    for turn in range(SETTLINGS):
        before = search.fits.pop("none")  # its evidence is that of another system
        moved = search.system.settle(before.x)
        slopes, rounds = None if moved else before.slopes, 1 if moved and turn + 1 < SETTLINGS else ROUNDS
        search.attempt("none", "fitted", partial(fit, search.problem(), before.x, before.psi, slopes, rounds))
        search.fits.setdefault("none", before)
        if rounds == ROUNDS:
            break
    if not search.system.dear:
        none = search.fits["none"]
        again = partial(fit, search.problem(), none.x, none.psi, none.slopes)
        search.attempt("none once more", "fitted again from its own end", again)
    return best[0]


def _ordered(search: Search, base: Fit, effects: Sequence[Effect], count: int) -> list[Ordered]:
    """What the first steps of each effect beside a fit gain over the same steps without it, in its covariance [nats],
    and where they lead; most first. Only an order, nothing is decided by it: by what the library saw, then one linear
    step, then a few steps of those that promise most, ever fewer. What is linear enough for the library to tell that it
    cannot lead takes no step. Steps have the slopes of the fit; where these are not the effect's own, as where it is
    another vehicle, they gain less than was promised, and the promise counts. count : of those that will be fitted.
    """
    count = count if base.system.dear else search.policy.candidates
    components, now = [group.components for group in base.groups], time.monotonic()
    end = now + ORDERING * (search.end - now)
    rough = rough_gains(base, effects, search.policy)
    likely = [effects[k] for k in np.argsort(-np.array(rough), kind="stable")]
    promises = dict(zip((one.name for one in effects), rough, strict=True))
    led = next((one.family for one in likely if one.kind == "name" and math.isfinite(promises[one.name])), None)
    if math.isfinite(base.evidence):  # levels that are raised hide what the model lacks
        search.counts = 1.0 / misfit(base, [one for one in effects if one.family != led], search.policy)
    most = max(STEPPED * count, sum(math.isinf(one) for one in rough))
    reached = [one for one in likely[:most]
               if not one.linear or _may_lead(search, promises[one.name], one)]  # fmt: skip
    begins = first_gains(base, [one.sought(base) for one in reached], search.policy, end)
    begins.sort(key=lambda one: -one[0])
    first: dict[str, Ordered] = {}
    for one in begins:
        first.setdefault(one[1].name, one)
    firsts = list(first.values())
    hopeful = [k for k, one in enumerate(firsts) if k < POLISHED or _may_lead(search, one[0], one[1])]
    hopeful = hopeful[: PROMISING * count]
    stepping = [firsts[k] for k in hopeful]
    tasks = [((), base.x), *(((effect,), x) for _, effect, x in stepping)]
    steps = [partial(_stepped, search, base, beside, x, components, end) for beside, x in tasks]
    without, *stepped = base.system.side_by_side(steps)
    found = [(max(promised, one[0] - without[0]), effect, one[1])
             for one, (promised, effect, _) in zip(stepped, stepping, strict=True)
             if one is not None and without is not None]  # fmt: skip
    promises |= {name: one[0] for name, one in first.items()}
    late = [one for one in reached if one.name not in first]
    late += [one for (_, one, _), step in zip(stepping, stepped, strict=True) if step is None]
    before = "".join(f"{one.name} + " for one in base.hypothesis.effects)
    search.not_tried += [f"{before}{one.name}: no time left" for one in late]
    best = max((one[0] for one in found), default=-math.inf)
    search.cut |= not before and any(_may_lead(search, promises[one.name], one, best) for one in late)
    rest = [(gain, one, one.begins(base.x, base.system.coordinates)[0])
            for gain, one in sorted(zip(rough, effects, strict=True), key=lambda pair: -pair[0])
            if one.name not in first]  # fmt: skip
    hopeless = (one for k, one in enumerate(firsts) if k not in hopeful)
    return [*sorted(found, key=lambda one: -one[0]), *hopeless, *rest]


def _stepped(
    search: Search, base: Fit, beside: tuple[Effect, ...], x: np.ndarray, components: Sequence[np.ndarray], end: float
) -> tuple[float, np.ndarray] | None:
    """Evidence after a few steps of a fit's effects and others beside them, in its covariances, and where they led;
    None where the time ended before.
    """
    problem = Problem(base.system, Hypothesis((*base.hypothesis.effects, *beside)), search.policy, end)
    try:
        return few_steps(problem, x, base.psi, components, FIRST_STEPS, base.slopes)
    except OutOfTimeError:
        return None


def _effects_in_order(search: Search, nominal: np.ndarray) -> None:
    """Of a large library: one search for each of the effects that gain most, from `none` and from the nominal build;
    the two best as long as it takes.
    """
    none, count = search.fits["none"], search.policy.candidates
    tried: set[str] = set()
    for make, most in ((lambda: none, count), (lambda: _nominal_fit(search, nominal), max(1, count // 3))):
        if time.monotonic() > search.end:
            break
        base = make()
        order = _ordered(search, base, search.library.effects, most)
        most = min(most, max(POLISHED, sum(_may_lead(search, gain, one, order[0][0]) for gain, one, _ in order)))
        begun = partial(fit, psi=base.psi, slopes=base.slopes, rounds=1, thorough=False)
        search.attempts([(one.name, "fitted", partial(begun, search.problem(one), x)) for _, one, x in order[:most]])
        tried |= {effect.name for _, effect, _ in order[:most] if effect.name in search.fits}
        if base is none:
            search.not_tried += [f"{one.name}: first steps gain {gain:.1f} nats" for gain, one, _ in order[most:]]
    left = (text for text in dict.fromkeys(search.not_tried) if text.rsplit(": ", 1)[0] not in tried)
    search.not_tried = list(left)
    likely = search.named()[:POLISHED]
    search.attempts([
        (f"{one.hypothesis.name} once more", "fitted on",
         partial(fit, search.problem(*one.hypothesis.effects), one.x, one.psi, one.slopes))
        for one in likely if search.value(one) > search.value(likely[0]) - HOPELESS
    ])  # fmt: skip


def _may_lead(search: Search, gain: float, effect: Effect, first: float = -math.inf) -> bool:
    """Whether a fit may make an effect as likely as `none`, and as the one whose first steps gain most, `first` [nats]:
    it gains more than its first steps did, but not many times as much.
    """
    near = gain >= min(first / NEAR, first - HOPELESS)
    return near and REACH * gain * search.counts + search.prior(Hypothesis((effect,))) > search.prior(Hypothesis())


def _nominal_fit(search: Search, nominal: np.ndarray) -> Fit:
    """The nominal build with raised levels, from where effects may begin too."""
    problem = replace(search.problem(), system=search.system.about(nominal, (), None), end=math.inf)
    groups = problem.groups(nominal, problem.system.covariances(nominal, ()))
    high, nothing = raised(problem.levels), np.zeros((0, 0))
    total = cost(sums(groups), high) + problem.prior(nominal)
    slopes = problem.slopes(nominal, groups)
    return Fit(Hypothesis(), problem.system, nominal, high, total, -np.inf, nothing, nothing, groups, slopes)


def _none_again(search: Search) -> bool:
    """`none` from the nuisances of the two best effects; of the best one, and from its own end, where runs are dear:
    there in the levels that it has, for to anneal them takes as long as a fit. Gives whether the time sufficed.
    """
    count, named, none, tasks = len(search.system.coordinates), search.named(), search.fits["none"], []
    psi = none.psi if search.system.dear else None
    for found in named[: 1 if search.system.dear else 2]:
        x = found.x[:count].copy()
        for fault in (one for effect in found.hypothesis.effects for one in effect.faults):
            index = [one.name for one in search.system.coordinates].index(fault.name)
            x[index] = search.system.coordinates[index].mean
        slopes = [one[:count] for one in found.slopes]
        again = partial(fit, search.problem(), x, psi, slopes)
        tasks.append(("none from other nuisances", f"from the nuisances of {found.hypothesis.name}", again))
    if search.system.dear and (not named or search.value(named[0]) < search.value(none) + HOPELESS):
        tasks.append(("none once more", "fitted on", partial(fit, search.problem(), none.x, none.psi, none.slopes)))
    return search.attempts(tasks)


def _pairs(search: Search) -> None:
    """The best effect with others of other families, and each half alone from the pair."""
    count, named = len(search.system.coordinates), search.named()
    if not named or search.value(named[0]) < search.value(search.fits["none"]):
        return
    first = named[0].hypothesis.effects[0]
    large = search.ordered
    if large:
        others = [one for one in search.library.effects if _differ(first, one)]
        order = _ordered(search, named[0], others, PAIRS)
        partners = [(other, [x]) for _, other, x in order[:PAIRS]]
        search.not_tried += [f"{first.name} + {one.name}" for _, one, _ in order[PAIRS:]]
    else:
        others = [one.hypothesis.effects[0] for one in named[1:] if _differ(first, one.hypothesis.effects[0])]
        partners = [(other, other.begins(named[0].x, search.system.coordinates)) for other in others]
        search.not_tried += [f"{first.name} + {other.name}" for other, _ in partners[PAIRS:]]
        partners = partners[:PAIRS]
    rounds = 1 if large else ROUNDS
    search.attempts([
        (f"{first.name} + {other.name}", "fitted",
         partial(fit, search.problem(first, other), begin, None, named[0].slopes, rounds))
        for other, begins in partners for begin in begins
    ])  # fmt: skip
    pairs = [one for one in search.named() if len(one.hypothesis.effects) == 2]
    for pair in pairs[: 1 if large else PAIRS]:
        if large:
            on = partial(fit, search.problem(*pair.hypothesis.effects), pair.x, pair.psi, pair.slopes)
            search.attempt(f"{pair.hypothesis.name} once more", "fitted on", on)
        _halves(search, pair, count)


def _halves(search: Search, pair: Fit, count: int) -> None:
    """Each effect of a pair alone, from where the pair is."""
    first, other = pair.hypothesis.effects
    own = count + len(first.own)
    halves = ((first, np.r_[:own]), (other, np.r_[:count, own : len(pair.x)]))
    search.attempts([
        (f"{effect.name} from a pair", f"from {pair.hypothesis.name}",
         partial(fit, search.problem(effect), pair.x[kept], slopes=[one[kept] for one in pair.slopes]))
        for effect, kept in halves
    ])  # fmt: skip


def _small_ones(search: Search) -> bool:
    """Effects that were fitted, as healthy systems have them: alone, and beside the best of the others. Gives whether
    the time sufficed.
    """
    tasks = []
    for found in [one for one in search.named() if any(effect.healthy for effect in one.hypothesis.effects)]:
        effects = tuple(effect.small() if effect.healthy else effect for effect in found.hypothesis.effects)
        if (name := Hypothesis(effects).name) not in search.fits:
            small = partial(fit, search.problem(*effects), found.x, found.psi, found.slopes, 1)
            tasks.append((name, "as healthy systems have it", small))
    return search.attempts(tasks)


def _unknowns(search: Search) -> None:
    """Something unknown at each place, beside healthy systems and beside the best effects, where that was not looked
    for yet. Where runs are dear it takes none, so that it goes before pairs.
    """
    best = [one for one in search.named() if len(one.hypothesis.named) == len(one.hypothesis.effects) == 1][:BESIDE]
    for base in (*_healthy(search), *best):
        if (base.hypothesis.name, base.evidence) in search.beside:
            continue
        search.beside.add((base.hypothesis.name, base.evidence))
        tasks = []
        for place in _strained(search, base):
            levels = tuple(level for level in search.system.levels if level.place == place)
            anew = partial(with_unknown, search.policy, base, levels, search.end)
            name = f"{base.hypothesis.name}, unknown: {place}"
            tasks.append((name, f"levels of {base.hypothesis.name} fitted anew", anew))
        search.attempts(tasks)


def _healthy(search: Search) -> list[Fit]:
    """`none`, and a healthy system with a little of an effect where that is likelier."""
    none, fits = search.fits["none"], search.fits.values()
    little = [one for one in fits if one.hypothesis.effects and not (one.hypothesis.named or one.hypothesis.place)]
    likelier = sorted((one for one in little if search.value(one) > search.value(none)), key=search.value)
    return [none, *likelier[-1:]]


def _strained(search: Search, base: Fit) -> list[str]:
    """Places where something may be unknown beside a fit; where runs are dear those alone whose levels are highest for
    healthy ones: elsewhere a wider prior gains nothing.
    """
    strain: dict[str, float] = {}
    for level, psi in zip(search.system.levels, base.psi, strict=True):
        if level.place is not None:
            cost_here, cost_there = level.prior.cost(float(psi))[0], level.prior.cost(level.prior.middle)[0]
            above = math.copysign(cost_here - cost_there, psi - level.prior.middle)
            strain[level.place] = max(strain.get(level.place, -math.inf), above)
    found = sorted(strain, key=lambda place: -strain[place]) if search.system.dear else list(strain)
    most = PLACES if search.system.dear else len(found)
    search.not_tried += [f"{base.hypothesis.name}, unknown: {place}: levels there are low" for place in found[most:]]
    return found[:most]


def _whole(search: Search) -> None:
    """What leads of the unknowns, alone and beside an effect, is fitted whole, in covariances of its own, until those
    that lead were: with those of another hypothesis their evidence is not comparable. So where one of them leads, the
    other is fitted too, however far behind it seems.
    """
    done: dict[str, bool] = {}
    for _ in range(WHOLE):
        unknown = sorted(
            (one for one in search.fits.values() if one.hypothesis.unknown), key=lambda f: -search.value(f)
        )
        leader = max(search.fits.values(), key=search.value)
        leads = {
            beside: next((f for f in unknown if bool(f.hypothesis.named) is beside), None) for beside in (False, True)
        }
        left = [
            (one, beside) for beside, one in leads.items() if one and one.hypothesis.name not in done
            and (search.value(one) > search.value(leader) - HOPELESS
                 or (leader.hypothesis.unknown and beside not in done.values()))
        ]  # fmt: skip
        if not left or search.late(f"{left[0][0].hypothesis.name}, fitted whole"):
            break
        ((first, beside), *_) = left
        name = first.hypothesis.name
        done[name] = beside
        try:
            problem = search.problem(*first.hypothesis.effects, unknown=first.hypothesis.unknown)
            again = fit(problem, first.x, slopes=first.slopes)
        except OutOfTimeError:
            search.late(f"{name}, fitted whole")
            break
        if again is not None:
            search.step(f"{name}: fitted whole ({again.evidence - first.evidence:+.1f} nats)")
            search.fits[name] = again


def _small(found: Fit) -> bool:
    return any(effect.kind == "small" for effect in found.hypothesis.effects)


def _differ(first: Effect, other: Effect) -> bool:
    """Whether two effects are a pair: of two families, one of them a name."""
    return first.family != other.family and "name" in (first.kind, other.kind)
