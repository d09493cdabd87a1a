"""What an unknown is like, on vehicles whose effect the search is not told."""

from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.core.fitting import fit, with_unknown
from experiments.discrepancy.core.model import Fit
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.search import healthy_fit
from experiments.discrepancy.railway.cases import VERTICAL, nominal, recorded
from experiments.discrepancy.railway.pictures import unknown as drawn
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.scales import SCALES
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.railway.unknown import Unknown, told, unknown_of
from experiments.discrepancy.recording.evidence import evidence_of

FORCE = 1500.0  # N


def at(place: str, hidden: dict[str, Any], sensors: Any) -> tuple[Fit, Fit]:
    """`none`, and something unknown at a place, of a vehicle with this effect."""
    measured = recorded(np.random.default_rng(5), "home", (hidden,), sensors)
    none = healthy_fit(Railway(Record(evidence_of(measured, nominal("home", sensors))), SCALES), Policy())
    level = next(one for one in none.system.levels if one.place == place)
    return none, with_unknown(Policy(), none, (level,))


def like(fitted: Fit) -> Unknown:
    """What its unknown is like."""
    found = unknown_of(fitted)
    assert found
    return found


def test_a_wheel_out_of_round_is_a_tone_once_a_turn() -> None:
    none, there = at(
        "axlebox1_left.acceleration_z [m/s2]", {"kind": "out_of_round", "amplitude": 3e-4, "order": 1}, VERTICAL[2:4]
    )
    assert there.evidence > none.evidence + 20.0
    found, radius = like(there), nominal().model.wheelsets[0].radius
    assert found.words == f"a tone at {20.0 / (2.0 * np.pi * radius):.1f} Hz" and found.share > 0.5
    assert found.unit == "m/s2" and not found.curves
    assert unknown_of(none) is None


def test_friction_follows_the_velocity() -> None:
    """Coulomb friction between body and bogie: fitted whole, its curve is a step and its course is square."""
    table = {"displacement": [-1.0, 1.0], "velocity": [-0.2, -0.002, 0.002, 0.2]}
    row = [-FORCE, -FORCE, FORCE, FORCE]
    hidden = {"kind": "empirical_force", "axis": "z", "force": [row, row], **table}
    none, rough = at("secondary z", hidden, VERTICAL[:2])
    whole = fit(Problem(rough.system, rough.hypothesis, Policy()), rough.x, slopes=rough.slopes)
    assert whole and whole.evidence > none.evidence + 100.0
    found = like(whole)
    assert found.words == "it follows the velocity there"
    over = found.curves["velocity"]
    assert over.share > 0.5 > found.curves["displacement"].share
    assert over.mean[0] > 0.25 * FORCE and over.mean[-1] < -0.25 * FORCE  # it opposes the motion
    assert np.quantile(np.abs(found.values), 0.98) == pytest.approx(FORCE, rel=0.3)
    said = told(found)
    assert said["like"] == found.words and len(said["curves"]["velocity"]["mean"]) == len(over.mean)
    assert len(drawn(found).axes) == 4


def test_tolerances_off_their_sheet_are_part_of_what_is_missing() -> None:
    """A damper that is 30 % stronger: minus that share of its force, two dampers side by side, and no other place's."""
    record = Record(
        evidence_of(recorded(np.random.default_rng(5), "home", (), VERTICAL[:2]), nominal("home", VERTICAL[:2]))
    )
    system = Railway(record, SCALES)
    x, places = np.zeros(len(system.coordinates)), {one.place: one for one in system.levels if one.kind == "force"}
    x[[one.name for one in system.coordinates].index("log secondary_vertical_damping")] = np.log(1.3)
    joint, elsewhere = (system.joint(x, (), places[name]) for name in ("secondary z", "primary1 z"))
    assert (
        joint and elsewhere and not elsewhere[1].any() and system.joint(x, (), places["contact of wheelset1 z"]) is None
    )
    velocity = 2j * np.pi * record.frequencies[:, None] * joint[0]
    expected = -0.3 * 2.0 * nominal().vehicle.model_dump()["secondary_vertical_damping"] * velocity
    np.testing.assert_allclose(joint[1], expected, rtol=1e-6)
