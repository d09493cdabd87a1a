"""Elsewhere: what differs from run to run is found anew, and nothing else; names tell recordings apart."""

import numpy as np

from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.result.elsewhere import named, settled
from experiments.discrepancy.select.decide import rms
from railsim.effects.weak_yaw_damper import WeakYawDamper


def test_start_and_biases_are_found_anew_but_no_effect_is_made_up(problem: Problem):
    """A run that began 5 cm later with failed yaw dampers: without the effect the gap stays, with it nothing does."""
    forward = problem.forward
    labels = [one.label for one in forward.nuisances]
    z = np.zeros(len(labels))
    z[labels.index("start.distance")] = 0.1  # of 0.5 m; the registration finds it to centimetres
    z[labels.index("bias.bogie.acceleration_y [m/s2]")] = 1.5
    effect = WeakYawDamper(factor=0.05)
    run = problem.but(measured=problem.stacked(forward.predict(z, (effect,))), test=problem.train)
    nothing = np.zeros(len(labels))
    alone = rms(run, run.whitened(run.measured - settled(run, nothing, ())))
    added = rms(run, run.whitened(run.measured - settled(run, nothing, (effect,))))
    before = rms(run, run.whitened(run.measured - run.stacked(forward.predict(nothing))))
    assert before > alone > 0.5
    assert added < 0.1 * alone


def test_names_tell_recordings_apart():
    assert named(["a/slow", "b/fast"]) == {"slow": "a/slow", "fast": "b/fast"}
    assert list(named(["a/run", "b/run"])) == ["a/run", "b/run"]
