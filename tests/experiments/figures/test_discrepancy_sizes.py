"""Sizes of effects: within bounds and growing, probabilities as the oracle has them, rivals of another class only."""

from dataclasses import replace

import numpy as np
import pandas as pd

from experiments.discrepancy.blind.benchmark_score import DETECTABLE
from experiments.discrepancy.fit.candidates import Context, candidates
from experiments.figures.discrepancy_runs import SIZES, Sized, detected, named, rivals, three_sizes
from experiments.figures.discrepancy_sizes import DiscrepancySizes, worst

CONTEXT = Context(("bogie.acceleration_y",), (30.0, 700.0), (1.0, 20.0), ((300.0, 10.0),))


def test_sizes_grow_within_the_bounds():
    for one in candidates(CONTEXT):
        free = one.parameters
        found = three_sizes(one)
        for name, p in free.items():
            values = [values[name] for values in found]
            assert all(p.low <= value <= p.high for value in values), one.label
            if p.absent is None or p.smallest is None:
                continue
            near, far = sorted(
                (abs(p.smallest - p.absent), 0.9 * abs((p.high, p.low)[p.smallest < p.absent] - p.absent))
            )
            grown = np.diff([abs(value - p.absent) for value in values])
            assert (grown >= -1e-12).all(), one.label
            assert far == near or (grown > 0.0).all(), one.label
            assert one.build(found[0]) != one.kind.at_absent(**dict(one.choices)), one.label


def test_detection_is_that_of_the_benchmark():
    assert abs(detected(DETECTABLE) - 0.95) < 0.01
    assert detected(0.0) == 0.0 and detected(15.0) == 0.5


def _sized(name: str, signature: list[float]) -> Sized:
    one = next(one for one in candidates(CONTEXT) if one.name == name)
    s = np.array(signature, np.float32)
    power = 0.5 * float(s @ s)
    return Sized(one, SIZES[1], one.build(three_sizes(one)[1]), "x", 1.0, "-", 0.0, power, power, s, s)


def test_rivals_are_of_another_class_and_leave_what_they_cannot_imitate():
    """Signatures of lengths 10 and 4 at 60 degrees: 10 sin 60, half its square 37.5 nats; the own class is none."""
    own = _sized("weak_yaw_damper", [10.0, 0.0, 0.0])
    same = replace(own, size=SIZES[0])
    other = _sized("payload", [2.0, 2.0 * np.sqrt(3.0), 0.0])
    rival = rivals([own, same, other])[0]
    assert rival is not None and rival.name == "payload"
    assert np.isclose(rival.likeness, 0.5) and np.isclose(rival.apart, 37.5)
    assert named(own, rival) < detected(own.gain)
    assert rivals([own, same])[0] is None


def test_claims_tell_a_wrong_name_and_the_worst_confusion():
    row = {
        "effect": "a",
        "class": "a",
        "acts on": "vehicle",
        "possible": True,
        "parameter": "x",
        "value": 1.0,
        "unit": "-",
    }
    row |= {"expected evidence [nats]": 50.0, "detected, expected": 1.0, "named, expected": 1.0, "nearest rival": "b"}
    row |= {"likeness": 0.9, "apart [nats]": 8.0, "absent": 0.0}
    blank = {"blind status": "", "blind effect": "", "blind class": ""}
    rows = [{**row, **blank, "size": size} for size in SIZES]
    rows[1] |= {"blind status": "named", "blind class": "b", "blind effect": "b", "apart [nats]": 3.0}
    table = pd.DataFrame(rows)
    assert [one["apart [nats]"] for one in worst(table)] == [3.0]
    for runs, held in ((1, (None, None, None)), (20, (False, False, True))):
        claims = DiscrepancySizes().check(pd.concat([table, *[table.iloc[1:2]] * (runs - 1)]))
        found = {claim.claim: claim.held for claim in claims}
        assert found[f"blind runs without a wrong name ({runs})"] is held[0]
        assert found[f"blind runs that are surely nameable are named right ({runs})"] is held[1]
        assert found[f"blind runs that are surely detectable are detected ({runs})"] is held[2]
