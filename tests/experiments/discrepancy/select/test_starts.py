"""Starts: what is kept of a fit that was bent, and when it counts as bent."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from experiments.discrepancy.fit.candidates import Context, candidates
from experiments.discrepancy.screen.locate import Located
from experiments.discrepancy.select.starts import at_home, with_other_ends


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


def test_the_ends_of_a_stretch_are_moved_one_at_a_time():
    context = Context(("bogie.rate_yaw",), (0.0, 600.0), (0.0, 30.0), ((100.0, 5.0),))
    stretch = next(one for one in candidates(context) if one.name == "local_low_adhesion")
    found = with_other_ends(stretch, {"factor": 0.3, "place": 300.0, "length": 200.0})
    ends = {(one["place"], round(one["place"] + one["length"], 6)) for one in found}
    assert {(220.0, 500.0), (380.0, 500.0), (300.0, 420.0), (300.0, 580.0)} <= ends
    assert all(first == 300.0 or last == 500.0 for first, last in ends)
    assert all(one["factor"] == 0.3 for one in found)


def test_a_wave_over_a_stretch_stays_in_phase_and_what_is_no_stretch_stays():
    context = Context(("bogie.rate_yaw",), (0.0, 600.0), (0.0, 30.0), ((100.0, 5.0),))
    known = {one.name: one for one in candidates(context)}
    values = {"amplitude": 1e-4, "wavelength": 0.7, "place": 300.0, "length": 200.0}
    begins = np.array([one["place"] for one in with_other_ends(known["rail_corrugation"], values)])
    waves = (begins - 300.0) / 0.7
    assert np.allclose(waves, np.round(waves)) and np.abs(waves).max() > 200.0
    assert with_other_ends(known["hanging_sleepers"], {"deflection": 1e-3, "place": 300.0, "length": 3.0}) == []
