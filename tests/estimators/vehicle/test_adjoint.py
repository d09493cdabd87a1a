"""Responses by one equation for each output, against those by one for each input."""

import numpy as np
import pytest

from estimators.vehicle import lateral_roll
from estimators.vehicle.adjoint import over_forces
from estimators.vehicle.parameters import numbers
from estimators.vehicle.state_space import Output, System, responses
from estimators.vehicle.vertical import vertical
from railsim.vehicles.class175 import Class175
from railsim.vehicles.class175_whole import Class175Whole

OMEGA = 2.0 * np.pi * np.geomspace(0.02, 60.0, 40)
PLACE = (1.0, 0.4, 0.2)
KINDS = [Output("rate"), *(Output(kind, PLACE) for kind in ("acceleration", "displacement", "axlebox"))]


def _by_inputs(system: System) -> np.ndarray:
    """By one equation for each input."""
    s = 1j * OMEGA[:, None, None]
    twice = 0.0 if system.J is None else s**2 * system.J
    return system.C @ system.states(OMEGA) + system.D + s * system.G + twice


@pytest.mark.parametrize("whole", [False, True])  # the whole vehicle's bogies also surge on traction rods
def test_vertical_plane(whole: bool):
    nominal = numbers((Class175Whole() if whole else Class175()).nominal(), ())
    several = [nominal, nominal | {"body_mass": 1.4 * nominal["body_mass"]}]
    systems = [vertical(one, [*KINDS, Output("height", PLACE)]) for one in several]
    expected = np.stack([_by_inputs(one) for one in systems])
    assert responses(systems, OMEGA) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())
    still = responses([vertical(nominal, [Output("height")])], np.zeros(1))
    assert still[0, 0, 0] == pytest.approx([0.5, 0.5], rel=1e-12)
    felt, height = expected[:, :, 1], expected[:, :, -1]
    assert felt == pytest.approx(-height * OMEGA[:, None] ** 2, rel=1e-6, abs=1e-6 * np.abs(felt).max())


def test_lateral_plane():
    nominal = numbers(Class175().nominal(), lateral_roll.NEEDED)
    several = [nominal, nominal | {"design_conicity": 0.3}, nominal | {"creep": 0.3}]
    outputs = [*KINDS, Output("lift", PLACE), Output("rate", axis="yaw")]
    systems = [lateral_roll.lateral(one, outputs, 25.0) for one in several]
    expected = np.stack([_by_inputs(one) for one in systems])
    assert responses(systems, OMEGA) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_equations_that_need_another_pivot():
    """A position that carries no stiffness and no mass of its own stands first."""
    stiffness = np.array([[[0.0, 2.0, 1.0], [3.0, 0.0, 0.5], [1.0, 1.0, 4.0]]])
    read = np.array([[[1.0, 2.0, 3.0], [0.0, 1.0, 0.0]]])
    found = over_forces(np.zeros((1, 3, 3)), np.zeros((1, 3, 3)), stiffness, read, 0.0 * read, np.array([1.0]))
    assert found[0, 0] == pytest.approx(read[0] @ np.linalg.inv(stiffness[0]))


def test_one_coordinate_of_a_reduction():
    p = numbers(Class175().nominal(), lateral_roll.NEEDED)
    reduced = lateral_roll.equations(p, 25.0)
    expected = reduced.response(1j * OMEGA)[:, reduced.coordinates.index("bogie.yaw")]
    assert reduced.response_of("bogie.yaw", OMEGA) == pytest.approx(expected, rel=1e-9, abs=1e-12)
