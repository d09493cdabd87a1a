"""Tolerances keep to what a number may be."""

from experiments.discrepancy.railway.tolerances import WIDEST, tolerances
from railsim import load_scenario


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
