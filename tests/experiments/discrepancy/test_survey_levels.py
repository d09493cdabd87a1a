"""Levels of a track file's errors are chosen by the model that fits, not by the one that they were first seen with."""

from collections.abc import Sequence

import numpy as np

from experiments.discrepancy.railway.cases import ALL, nominal, recorded
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.survey_levels import LevelSearch, Steps, moved
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import evidence_of

OFF = 3  # steps: errors taken as eight times their size


def of_a_ridge(asked: Sequence[Steps]) -> list[float]:
    """Least at (-1, 2), over a ridge that leads there by turns."""
    return [3.0 * (a + b - 1) ** 2 + 4.0 * (a + 1) ** 2 for a, b in asked]


def test_steps_of_one_kind_at_a_time_go_down_a_ridge_and_ask_once() -> None:
    asked: list[Steps] = []
    search = LevelSearch(lambda ones: (asked.extend(ones), of_a_ridge(ones))[1])
    assert search.lowered((2, 4)) == (-1, 2)
    assert len(asked) == len(set(asked))


def test_levels_stay_where_others_gain_less_than_a_nat() -> None:
    assert LevelSearch(lambda ones: [0.3 * one[0] for one in ones]).lowered((0,)) == (0,)


def test_levels_are_not_raised_for_what_a_model_lacks() -> None:
    assert LevelSearch(lambda ones: [-100.0 * one[0] for one in ones]).lowered((0,)) == (0,)


def test_errors_that_were_taken_as_eight_times_their_size_are_set_right() -> None:
    measured = recorded(np.random.default_rng(4), "home", (), ALL)
    system = Railway(Record(evidence_of(measured, nominal("home", ALL))))
    x, kinds = system._laid(), system._kinds
    system.kept["survey"] = moved((0,) * len(kinds), kinds.index("cross_level"), OFF)
    assert system.settle(x)
    assert max(abs(step) for kind, step in zip(kinds, system._chosen_survey, strict=True) if kind != "gauge") <= 1
    assert not system.settle(x)
