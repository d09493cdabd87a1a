"""Starts: what is kept of a fit that was bent, and when it counts as bent."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from experiments.discrepancy.locate import Located
from experiments.discrepancy.starts import at_home


def test_the_vehicle_goes_back_to_nominal_and_stays_where_it_is():
    kinds = ("vehicle", "start", "speed", "bias", "adhesion", "scale")
    nuisances = [SimpleNamespace(kind=kind) for kind in kinds]
    problem: Any = SimpleNamespace(forward=SimpleNamespace(nuisances=nuisances))
    fit: Any = SimpleNamespace(z=np.array([3.0, -0.4, 0.7, -5.0, 2.0, 1.0]))
    assert at_home(problem, fit).tolist() == [0.0, -0.4, 0.7, -1.0, 0.0, 0.0]


def test_one_strained_nuisance_may_be_chance_two_are_not():
    def located(*strained: str) -> Located:
        return Located((), np.zeros((0, 0)), np.zeros(0), {}, dict.fromkeys(strained, 3.0))

    assert not located("vehicle.bogie_mass").bent
    assert located("vehicle.bogie_mass", "pair.conicity").bent
