"""Contacts of one wheelset against the textbook: Klingel's wave, gravitational stiffness, shares of Kalker's slopes."""

from dataclasses import replace

import numpy as np
import pytest

from estimators.vehicle.contact import ContactGeometry, Wheelset, cones, creep_forces, gyroscopic, relations, weight
from estimators.vehicle.creep import DRY, DRY_ROLLING, kalker_slopes, polach_slopes
from estimators.vehicle.linear_model import Kinematics, Reduced, reduce
from railsim.contact.linear import CreepCoefficients
from railsim.vehicles.class175 import Class175

P = Class175().nominal()
WHEELSET = Wheelset("wheelset", 0.46, 0.75, 1e5, 100.0)
NAMES = ("wheelset.y", "wheelset.yaw")
RAILS = ("wheelset.rail_y", "wheelset.rail_roll")


def free_wheelset(geometry: ContactGeometry, slopes: CreepCoefficients, speed: float) -> Reduced:
    """Without mass to speak of, suspension or weight."""
    moving = Kinematics(NAMES, RAILS, relations(geometry, [WHEELSET]))
    return reduce(creep_forces(WHEELSET, slopes, speed), (1e-6, 1e-6), moving)


def test_free_wheelset_runs_on_klingels_wave() -> None:
    """Wave number sqrt(conicity / (r l)) (Klingel 1883); forces without spin leave nothing else."""
    conicity, speed = 0.1, 20.0
    reduced = free_wheelset(ContactGeometry(conicity, 0.0, 0.0), CreepCoefficients(1e7, 1e7, 0.0), speed)
    values = np.linalg.eigvals(reduced.first_order()[0])
    wave = np.sqrt(conicity / (WHEELSET.radius * WHEELSET.half_gauge)) * speed
    assert np.min(np.abs(values - 1j * wave)) < 1e-4 * wave


def test_wheelset_that_follows_the_rails_has_no_creep_force() -> None:
    """Rails that lie aside by d, and roll: the wheelset at y = d less r times the roll stays there by itself."""
    geometry = ContactGeometry(0.1, 0.03, 2.0, 1.5, 0.03 / WHEELSET.half_gauge)
    elements = creep_forces(WHEELSET, CreepCoefficients(1e7, 9e6, 0.0), 20.0)
    reduced = reduce(elements, (1.0, 1.0), Kinematics(NAMES, RAILS, relations(geometry, [WHEELSET])))
    aside = np.array([1.0, 0.0])
    assert reduced.stiffness @ aside + reduced.input_stiffness[:, 0] == pytest.approx(np.zeros(2), abs=1e-6)
    lower = np.array([-WHEELSET.radius, 0.0])
    assert reduced.stiffness @ lower + reduced.input_stiffness[:, 1] == pytest.approx(np.zeros(2), abs=1e-6)


def test_weight_centres_a_wheelset_on_hollow_heads_and_turns_it_further() -> None:
    """W e across (cones' contact), -W delta l in yaw (Wickens 2003, section 2.5)."""
    geometry = ContactGeometry(0.1, 0.04, 3.0)
    moving = Kinematics(NAMES, RAILS, relations(geometry, [WHEELSET]))
    stiffness = reduce(weight(WHEELSET, geometry), (1.0, 1.0), moving, reactions=False).stiffness
    assert stiffness == pytest.approx(np.diag([1e5 * 3.0, -1e5 * 0.04 * 0.75]))


def test_load_that_leans_with_the_wheelset_counts_only_across_the_track() -> None:
    geometry = ContactGeometry(0.1, 0.04, 0.0)
    moving = Kinematics(NAMES, RAILS, relations(geometry, [WHEELSET]))
    for along_axle, expected in ((False, 1e5), (True, 0.0)):
        elements = weight(WHEELSET, geometry, along_axle=along_axle)
        reduced = reduce(elements, (1.0, 1.0), moving, reactions=False)
        assert reduced.input_stiffness[0, 1] == pytest.approx(expected)


def test_spinning_wheels_turn_when_the_rails_roll_them() -> None:
    moving = Kinematics(NAMES, RAILS, relations(ContactGeometry(0.1, 0.0, 0.0), [WHEELSET]))
    reduced = reduce(gyroscopic(WHEELSET, 23.0), (1.0, 1.0), moving)
    assert reduced.input_damping == pytest.approx(np.array([[0.0, 0.0], [0.0, 100.0 * 23.0 / 0.46]]))


def test_roll_and_shift_that_depend_on_each_other_are_solved_for() -> None:
    """u = y + r roll - d with roll = rail_roll + R u."""
    geometry = replace(cones(P), roll=0.2)
    moving = Kinematics(NAMES, RAILS, relations(geometry, [WHEELSET]))
    (shift, shift_rails), (roll, roll_rails) = (moving.row({f"wheelset.{name}": 1.0}) for name in ("shift", "roll"))
    assert shift == pytest.approx([1.0 + WHEELSET.radius * roll[0], 0.0])
    assert roll == pytest.approx(0.2 * shift)
    assert roll_rails == pytest.approx(0.2 * shift_rails + [0.0, 1.0])


def test_shares_of_kalkers_slopes_are_taken_one_by_one() -> None:
    whole, dry, rolling = (np.array(kalker_slopes(P, share)) for share in (1.0, DRY, DRY_ROLLING))
    assert dry == pytest.approx(0.7 * whole)
    assert rolling == pytest.approx(np.array([0.64, 0.79, 1.0]) * whole)


def test_named_factors_vary_polachs_slopes() -> None:
    plain = polach_slopes(P, 0.05)
    varied = polach_slopes(P | {"creep": 0.9, "spin": 1.2}, 0.05)
    assert varied == pytest.approx((0.9 * plain.f11, 0.9 * plain.f22, 0.9 * 1.2 * plain.f23))
