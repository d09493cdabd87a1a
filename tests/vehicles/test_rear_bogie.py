"""A rear bogie with other parts: its elements against effects that change one bogie, and by hand."""

import dataclasses

import numpy as np
import pytest

from railsim import load_scenario
from railsim.analysis.curving.layout import check
from railsim.effects.interface import EFFECTS, Setup
from railsim.errors import InputError
from railsim.model import Model
from railsim.speed import Constant
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.payload import Payload
from railsim.vehicles.rear_bogie import RearBogie

VEHICLES = (
    ManchesterWhole(yaw_damper_damping=6e5),
    ManchesterWhole(yaw_damper_damping=6e5, yaw_damper_height=0.5, yaw_damper_blow_off_velocity=0.02),
    Class175Whole(arm_length=0.4, arm_rise=0.02, yaw_damper_series_stiffness=None),
)
FACTOR = 0.7
ALIKE = {
    "weak_yaw_damper": ("yaw_damper_damping",),
    "weak_lateral_damper": ("secondary_lateral_damping",),
    "weak_vertical_damper": ("secondary_vertical_damping",),
    "weak_primary_damper": ("primary_vertical_damping",),
    "secondary_lateral_stiffness": ("secondary_lateral_stiffness",),
    "primary_lateral_stiffness": ("primary_lateral_stiffness",),
}
"""Effects, and the fields that do the same."""


def numbers(model: Model) -> dict[str, list[np.ndarray]]:
    """All of each element."""
    linear = {one.name: [one.stiffness, one.damping, np.array(one.position), np.array(one.preload)]
              for one in model.elements}  # fmt: skip
    laws = {one.name: [np.array([v or 0.0 for v in dataclasses.astuple(one.law)], float)] for one in model.nonlinear}
    return linear | laws


@pytest.mark.parametrize("vehicle", VEHICLES, ids=("linear", "laws", "arms"))
@pytest.mark.parametrize("kind", ALIKE)
def test_a_factor_does_what_the_effect_on_the_second_bogie_does(vehicle, kind):
    scenario = load_scenario("whole_coach").but(vehicle=vehicle, sensors=())
    setup = Setup(vehicle, scenario.geometry, (), Constant(speed=20.0), scenario.traction, 1.0)
    by_effect = EFFECTS.pick(kind).build({"bogie": 2, "factor": FACTOR}).install(setup).model
    other = vehicle.but(rear=RearBogie(**dict.fromkeys(ALIKE[kind], FACTOR)))
    by_field = other.pulled(other.model(), Constant(speed=20.0), 1.0)
    expected, found = numbers(by_effect), numbers(by_field)
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        for one, two in zip(found[name], values, strict=True):
            np.testing.assert_allclose(one, two, rtol=1e-12, atol=1e-9, err_msg=name)


def test_springs_of_the_rear_bogie_by_hand():
    vehicle = ManchesterWhole(rear=RearBogie(secondary_vertical_stiffness=1.2, primary_vertical_stiffness=0.9))
    found = {one.name: one.stiffness for one in vehicle.model().elements}
    usual = {one.name: one.stiffness for one in ManchesterWhole().model().elements}
    k, b = vehicle.secondary_vertical_stiffness, vehicle.secondary_half_spacing
    assert found["secondary2"][2, 2] == pytest.approx(2.0 * 1.2 * k)
    assert found["secondary2"][3, 3] - usual["secondary2"][3, 3] == pytest.approx(2.0 * 0.2 * k * b**2)
    assert found["primary3"][2, 2] == pytest.approx(2.0 * 0.9 * vehicle.primary_vertical_stiffness)
    for name in ("secondary", "primary1", "primary2"):
        np.testing.assert_array_equal(found[name], usual[name])


def test_a_payload_sinks_by_the_springs_of_each_bogie():
    laden = ManchesterWhole(payload=Payload(mass=8000.0), rear=RearBogie(secondary_vertical_stiffness=0.5))
    force = 4000.0 * 9.81  # on each bogie; the payload stands in the middle
    on_bogie = force / (2.0 * laden.secondary_vertical_stiffness)
    primary = force / (4.0 * laden.primary_vertical_stiffness)
    body = next(one for one in laden.model().bodies if one.name == "body")
    assert body.sunk == pytest.approx(0.5 * (on_bogie + 2.0 * on_bogie) + primary, rel=1e-3)


def test_the_balance_in_a_curve_refuses_it():
    check(ManchesterWhole())
    with pytest.raises(InputError, match="leave 'rear' out"):
        check(ManchesterWhole(rear=RearBogie(yaw_damper_damping=0.5)))
