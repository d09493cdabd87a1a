"""Candidates keep within the effects' bounds, come in sizes that are there, and know the run that they are for."""

import numpy as np

from experiments.discrepancy.candidates import Context, candidates

CONTEXT = Context(
    ("bogie.acceleration_y", "bogie.rate_yaw"), (50.0, 900.0), (1.0, 30.0), ((300.0, 10.0), (600.0, 20.0))
)


def test_every_size_of_every_candidate_can_be_built_and_differs_from_absence():
    for one in candidates(CONTEXT):
        free = one.parameters
        sizes = list(one.sizes())
        assert sizes, one.label
        for values in sizes:
            effect = one.build(values)
            assert effect != one.kind.at_absent(**dict(one.choices)), one.label
            assert all(free[name].low <= value <= free[name].high for name, value in values.items()), one.label


def test_places_lie_within_the_run():
    for one in candidates(CONTEXT):
        for values in one.variants_of(next(iter(one.sizes()))):
            for name in ("place", "first"):
                if name in values:
                    assert CONTEXT.distance[0] <= values[name] <= CONTEXT.distance[1], one.label


def test_steps_of_derivatives_are_small_against_the_range():
    for one in candidates(CONTEXT):
        steps = [one.step(name, parameter) for name, parameter in one.parameters.items()]
        assert np.all(np.array(steps) <= 0.05), one.label
