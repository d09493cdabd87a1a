"""Kin: effects that look like nuisances which stand far from their data sheets, or like a law without a name.

Half the adhesion begins as friction that is lower than usual. Where the nuisance has gone as far as it may, the
effect's own signature beside it gains nothing, and only a fit shows which of the two it is. What a tabled law takes
is the missing effect's change with the noise left out: it may say what the residual, with that noise, does not.
"""

import itertools
from collections.abc import Iterator, Sequence, Set

import numpy as np

from experiments.discrepancy.baseline.noise import split
from experiments.discrepancy.fit.fitting import Problem, without_effects
from experiments.discrepancy.fit.hypothesis import Hypothesis
from experiments.discrepancy.screen.locate import Located
from experiments.discrepancy.screen.projection import Projection, whitened
from experiments.discrepancy.screen.screening import Screened, best_of

ALIKE = 0.9  # cosine of the nominal vehicle's signature and its derivative by the nuisance
OF_EACH = 2  # effects that one nuisance may stand for
MOST = 5
LIKE_LAW = 0.2  # cosine of a signature and what a tabled law takes, from which the effect may be what it stands for
OF_LAW = 3


def kin(problem: Problem, located: Located, screened: Sequence[Screened]) -> list[Screened]:
    """For every strained nuisance the effects that are most like it, the best of each first; at most `MOST`.

    Raises
    ------
    ValueError : the problem has no bank, or no noise was stated yet.
    """
    pairs = list(_signatures(problem, best_of(screened)))
    known = [one for one, _ in pairs]
    rows = [_unit(split(whitened(problem, change))[problem.train].ravel()) for _, change in pairs]
    places = {one.label: number for number, one in enumerate(problem.forward.nuisances)}
    liked: list[list[Screened]] = []
    for label in located.surprising:
        own = problem.bank_jacobian[places[label]][problem.train].ravel().astype(float)
        like = [abs(float(row @ own)) / max(float(np.linalg.norm(own)), 1e-30) for row in rows]
        order = sorted(range(len(rows)), key=lambda number: -like[number])[:OF_EACH]
        liked.append([known[number] for number in order if like[number] > ALIKE])
    ranked = [one for turn in itertools.zip_longest(*liked) for one in turn if one is not None]
    found = {one.candidate.label: one for one in ranked}
    return list(found.values())[:MOST]


def of_classes(classes: Set[str], screened: Sequence[Screened], tried: Set[str]) -> list[Screened]:
    """The effects of some classes but for those of some names, each in its best variant."""
    mates: dict[str, Screened] = {}
    for one in best_of(screened):
        if one.candidate.equivalence in classes and one.candidate.name not in tried:
            mates.setdefault(one.candidate.name, one)
    return list(mates.values())


def like_law(problem: Problem, law: Hypothesis, screened: Sequence[Screened]) -> list[Screened]:
    """The effects whose signatures, at any size, are most like what a tabled law takes, as far as nuisances cannot take
    either; each name once, at most `OF_LAW`.

    Raises
    ------
    InputError : the model does not run there without the law.
    ValueError : the problem has no bank, or no noise was stated yet.
    """
    fit = law.fit
    projection = Projection(without_effects(problem, fit), problem.train, problem.forward.bounds)

    def row(change: np.ndarray) -> np.ndarray:
        return _unit(projection.cleaned(projection.row(whitened(problem, change))))

    own = row(fit.stacked - problem.stacked(problem.forward.predict(fit.z)))
    like = [(float(row(signature) @ own), one) for one, signature in _signatures(problem, screened)]
    found: dict[str, Screened] = {}
    for likeness, one in sorted(like, key=lambda pair: -pair[0]):
        if likeness > LIKE_LAW:
            found.setdefault(one.candidate.name, one)
    return list(found.values())[:OF_LAW]


def _signatures(problem: Problem, screened: Sequence[Screened]) -> Iterator[tuple[Screened, np.ndarray]]:
    """Those of which the bank holds a signature (k, f, c) that is theirs as it is."""
    if problem.bank is None:
        raise ValueError("give the problem a bank first")
    for one in screened:
        signature = problem.bank.kept(one.candidate, one.tried)
        if signature is not None and not (one.candidate.reference or one.candidate.sharp):
            yield one, signature


def _unit(row: np.ndarray) -> np.ndarray:
    return row / max(float(np.linalg.norm(row)), 1e-30)
