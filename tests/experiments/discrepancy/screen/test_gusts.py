"""A gust is found by superposition: held against runs of the whole, nonlinear model."""

import numpy as np
import pytest

from experiments.discrepancy.fit.candidates import Candidate, Context, candidates
from experiments.discrepancy.fit.fitting import Problem, starting_fit
from experiments.discrepancy.screen.gusts import delayed
from experiments.discrepancy.screen.screening import screen
from experiments.discrepancy.select.starts import elsewhere


def _wind(problem: Problem) -> Candidate:
    time = (float(problem.frames.starts[0]), float(problem.frames.starts[-1] + problem.frames.length))
    context = Context(problem.evidence.channels, (0.0, 1.0), time, ((50.0, 2.0),))
    return next(one for one in candidates(context) if one.name == "wind_gust")


@pytest.mark.parametrize(("force", "begin", "duration"), [(-14e3, 3.4, 4.3), (9e3, 1.3, 6.1)])
def test_when_and_how_long_a_gust_blows_is_found(problem: Problem, force: float, begin: float, duration: float):
    """The loudest section that the candidate is told of is none of the gust's."""
    wind = _wind(problem)
    fit = starting_fit(problem, np.zeros(len(problem.forward.nuisances)))
    hidden = {"force": force, "begin": begin, "duration": duration}
    measured = problem.stacked(problem.forward.predict(fit.z, (wind.build(hidden),)))
    windy = problem.but(measured=measured)
    found = screen(windy, starting_fit(windy, fit.z), [wind])
    best = max(found, key=lambda one: one.gain)
    assert np.sign(best.values["force"]) == np.sign(force)
    assert 0.6 < best.values["force"] / force < 1.6
    assert abs(best.values["begin"] - begin) < 0.8
    assert abs(best.values["begin"] + best.values["duration"] - begin - duration) < 0.8
    others = elsewhere(best, found)
    assert 0 < len(others) <= 2
    assert all(other.values != best.values for other in others)


def test_a_change_comes_later_and_nothing_comes_before_it():
    change = np.arange(1.0, 6.0)[:, None, None] * np.ones((1, 2, 3))
    assert delayed(change, 2)[:, 0, 0].tolist() == [0.0, 0.0, 1.0, 2.0, 3.0]
    assert delayed(change, -1)[:, 0, 0].tolist() == [2.0, 3.0, 4.0, 5.0, 0.0]
    assert np.array_equal(delayed(change, 0), change)
