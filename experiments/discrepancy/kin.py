"""Kin: effects that look like nuisances which stand far from their data sheets.

Half the adhesion begins as friction that is lower than usual. Where the nuisance has gone as far as it may, the
effect's own signature beside it gains nothing, and only a fit shows which of the two it is.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from experiments.discrepancy.fitting import Problem
from experiments.discrepancy.locate import Located
from experiments.discrepancy.noise import split
from experiments.discrepancy.screening import Screened, best_of

ALIKE = 0.9  # cosine of the nominal vehicle's signature and its derivative by the nuisance
OF_EACH = 2  # effects that one nuisance may stand for
MOST = 5


def kin(problem: Problem, located: Located, screened: Sequence[Screened]) -> list[Screened]:
    """For every strained nuisance the effects that are most like it, the best of each first; at most `MOST`.

    Raises
    ------
    ValueError : the problem has no bank, or no noise was stated yet.
    """
    if problem.bank is None or problem.white is None:
        raise ValueError("give the problem a bank and its noise first")
    rows: list[np.ndarray] = []
    known: list[Screened] = []
    for one in best_of(screened):
        signature = problem.bank.kept(one.candidate, one.tried)
        if signature is not None and not (one.candidate.reference or one.candidate.sharp):
            row = split(problem.white.complex(signature))[problem.train].ravel()
            rows.append(row / max(float(np.linalg.norm(row)), 1e-30))
            known.append(one)
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
