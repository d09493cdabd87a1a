"""Roll of the bogie over that of its wheelsets: limits that have closed forms; and which dips count."""

import numpy as np
import pytest

from estimators.track.dipped_joints import credible
from estimators.vehicle.roll_plane import over_track, parameters, roll_response
from railsim.errors import InputError
from railsim.vehicles.class175 import Class175

VEHICLE = Class175().model_dump()
OMEGA = 2 * np.pi * np.array([0.2, 1.0, 3.0, 9.0, 20.0])


def test_on_a_rigid_primary_suspension_the_bogie_rolls_as_the_wheelsets() -> None:
    p = parameters(VEHICLE) | {"primary_vertical_stiffness": 1e14}
    assert roll_response(p, OMEGA) == pytest.approx(np.ones(5), abs=1e-3)


def test_without_sideways_springs_it_is_two_inertias_one_above_the_other() -> None:
    loose = dict.fromkeys(("primary_lateral_stiffness", "secondary_lateral_stiffness"), 1e-6)
    loose |= dict.fromkeys(("primary_lateral_damping", "secondary_lateral_damping"), 0.0)
    p = parameters(VEHICLE) | loose
    level = p | {"body_height": p["secondary_height"]}  # the body's weight then does not tip it
    s = 1j * OMEGA
    low = 4 * p["primary_half_spacing"] ** 2 * (p["primary_vertical_stiffness"] + s * p["primary_vertical_damping"])
    high = 2 * p["secondary_half_spacing"] ** 2
    high = high * (p["secondary_vertical_stiffness"] + s * p["secondary_vertical_damping"]) + p["roll_bar_stiffness"]
    body = p["body_roll_inertia"] * s**2
    expected = low / (low + p["bogie_roll_inertia"] * s**2 + high * body / (high + body))
    assert roll_response(level, OMEGA) == pytest.approx(expected, rel=1e-6)


def test_waves_of_four_semi_wheelbases_do_not_show() -> None:
    k = np.array([0.01, np.pi / 2 / VEHICLE["semi_wheelbase"]])
    assert np.abs(over_track(VEHICLE, 0.1, k))[1] < 1e-9


def test_missing_parameter_is_named() -> None:
    with pytest.raises(InputError, match="bogie_height"):
        parameters({name: value for name, value in VEHICLE.items() if name != "bogie_height"})


def test_threshold_falls_only_where_there_are_many_dips() -> None:
    weak = np.array([4.3, 4.4])
    assert credible(weak, 2000.0, 5.0, 0.02) == 5.0
    many = np.concatenate([weak, np.full(150, 12.0)])
    level = credible(many, 2000.0, 5.0, 0.02)
    assert 4.0 <= level < 4.4
    assert 5.0 * 2000.0 * np.exp(-(level**2) / 2) <= 0.02 * 152
