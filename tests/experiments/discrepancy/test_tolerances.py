"""Tolerances keep to what a number may be."""

import math

import pytest

from experiments.discrepancy.core.model import Coordinate
from experiments.discrepancy.railway.build import leading_alone, vehicle_at
from experiments.discrepancy.railway.tolerances import WIDEST, tolerances
from railsim import load_scenario
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.manchester_whole import ManchesterWhole


def test_a_reduction_factor_that_is_one_already_can_only_fall():
    vehicle = load_scenario("yaw_dampers").vehicle
    found = {one.key: one for one in tolerances(vehicle)}
    assert getattr(vehicle, "adhesion").k_adhesion == 1.0  # noqa: B009
    assert found["adhesion.k_adhesion"].most == 0.0
    assert found["adhesion.friction"].most == WIDEST


def test_each_mass_stiffness_and_damping_of_a_sheet_has_one():
    vehicle = load_scenario("yaw_dampers").vehicle
    found = {one.key for one in tolerances(vehicle)}
    sheet = vehicle.model_dump()
    kinds = ("_mass", "_inertia", "_stiffness", "_damping")
    assert found >= {
        name for name, value in sheet.items() if name.endswith(kinds) and isinstance(value, float) and value
    }


def test_a_height_that_the_sheet_does_not_state_is_about_that_of_the_springs():
    stated, not_stated = Class175Whole(), ManchesterWhole()
    heights = {one.key: one for one in tolerances(not_stated) if one.name.endswith("_height")}
    springs = "secondary_height"
    assert set(heights) == {springs, "traction_rod_height", "lateral_damper_height", "yaw_damper_height"}
    assert {one.key for one in tolerances(stated) if one.name.endswith("_height")} == {springs, "lateral_damper_height"}
    assert heights["lateral_damper_height"].nominal == not_stated.secondary_height
    lower = vehicle_at(not_stated, {"log lateral_damper_height": math.log(0.8)})
    assert lower.lateral_damper_height == pytest.approx(0.8 * not_stated.secondary_height)
    assert lower.yaw_damper_height is None


def test_dampers_stay_where_they_are_when_springs_act_higher():
    """Whether their own height is off by nothing or by next to nothing."""
    vehicle, rise = ManchesterWhole(), {"log secondary_height": 0.1}
    still = vehicle_at(vehicle, rise)
    nearly = vehicle_at(vehicle, rise | {"log lateral_damper_height": 1e-12, "log traction_rod_height": 1e-12})
    assert still.secondary_height == pytest.approx(math.exp(0.1) * vehicle.secondary_height)
    for one in (still, nearly):
        assert one.lateral_damper_height == pytest.approx(vehicle.secondary_height)
        assert one.traction_rod_height == pytest.approx(vehicle.secondary_height)


def test_what_the_model_leaves_open_is_no_property_of_a_specimen():
    left = ["secondary_height", "pair.upright_rails"]
    assert [one.key for one in tolerances(ManchesterWhole()) if not one.built] == left


@pytest.mark.parametrize("stated", [0.0, 0.5, 1.0])
def test_rails_may_stay_upright_whatever_the_sheet_says(stated: float):
    vehicle = ManchesterWhole()
    vehicle = vehicle.but(pair=vehicle.pair.but(upright_rails=stated))
    found = next(one for one in tolerances(vehicle) if one.key == "pair.upright_rails")
    for wanted in (0.0, 0.5, 1.0):
        change = math.log((1.0 + wanted) / (1.0 + stated))
        assert change / found.spread <= found.most + 1e-12
        assert vehicle_at(vehicle, {"log pair.upright_rails": change}).pair.upright_rails == pytest.approx(wanted)


def test_nobody_states_what_holds_a_vehicle_at_its_speed():
    found = {one.key: one for one in tolerances(ManchesterWhole())}
    assert found["draw_gear_stiffness"].spread == 1.5
    assert "draw_gear_stiffness" not in {one.key for one in tolerances(ManchesterWhole(draw_gear_stiffness=None))}


def test_bushings_of_arms_whose_height_nobody_has_stated_are_about_the_height_of_the_axle():
    armed = ManchesterWhole(arm_length=0.48)
    assert "arm_rise" not in {one.key for one in tolerances(ManchesterWhole())}
    assert "arm_rise" not in {one.key for one in tolerances(ManchesterWhole(arm_length=0.48, arm_rise=0.02))}
    assert "arm_rise" in {one.key for one in tolerances(armed)}
    for factor in (0.9, 1.1):
        moved = vehicle_at(armed, {"log arm_rise": math.log(factor)})
        assert moved.arm_rise == pytest.approx((factor - 1.0) * armed.wheel_radius)


def test_two_bogies_differ_by_parts_that_are_drawn_each_alone():
    whole = ManchesterWhole(yaw_damper_damping=6e5)
    found = {one.key: one for one in tolerances(whole)}
    for name in ("yaw_damper_damping", "primary_vertical_stiffness"):
        assert found[f"rear.{name}"].spread == pytest.approx(math.sqrt(2.0) * found[name].spread)
    assert "rear.yaw_damper_damping" not in {one.key for one in tolerances(ManchesterWhole())}  # it has none
    parts = [Coordinate(f"log {key}", "-", 0.0, one.spread) for key, one in found.items()]
    alone = next(one for one in leading_alone(parts) if one[0][0] == "log yaw_damper_damping")
    leading = vehicle_at(whole, {name: rate * math.log(0.5) for name, rate in alone})
    assert leading.yaw_damper_damping == pytest.approx(3e5)
    assert leading.rear.yaw_damper_damping * leading.yaw_damper_damping == pytest.approx(6e5)  # of the rear one
    moved = vehicle_at(whole, {"log rear.yaw_damper_damping": math.log(1.1), "log yaw_damper_damping": math.log(0.9)})
    assert moved.rear.yaw_damper_damping == pytest.approx(1.1)
    assert moved.yaw_damper_damping == pytest.approx(0.9 * 6e5)
