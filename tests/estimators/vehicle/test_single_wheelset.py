"""The estimators' single wheelset against the closed equations of the paper."""

import numpy as np
import pytest

from estimators.vehicle import single_wheelset as wheelset
from railsim.errors import InputError
from railsim.vehicles.wheelset import WheelsetVehicle
from railsim.wheelset import WheelsetParameters, full_linear


def paper(conicity: float) -> tuple[wheelset.WheelsetModel, WheelsetParameters]:
    """A cone as the paper has it: one number for radii and contact angle, and no change of the angle."""
    p = WheelsetParameters(spin_creep=0.0)
    return wheelset.WheelsetModel(p.coefficients(), s=conicity, e=0.0, conicity=conicity), p


@pytest.mark.parametrize("conicity", [0.05, 0.2])
def test_cone_gives_the_matrices_of_the_full_linear_equations(conicity: float) -> None:
    model, p = paper(conicity)
    a, b = wheelset.linear(model, conicity, 30.0)
    expected = full_linear(p, conicity, 30.0)
    np.testing.assert_allclose(a, expected.state_matrix, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(b, expected.track_matrix, rtol=1e-12, atol=1e-9)


def test_nominal_parameters_are_those_of_the_new_wheel() -> None:
    new = WheelsetVehicle.build({"pair": {"kind": "profiles"}})
    worn = WheelsetVehicle.build({"pair": {"kind": "profiles", "wear": 0.3}})
    assert wheelset.wheelset_model(new.nominal()) == wheelset.wheelset_model(worn.nominal())


def test_missing_parameter_is_named() -> None:
    vehicle = WheelsetVehicle().nominal()
    del vehicle["yaw_stiffness"]
    assert not wheelset.fits(vehicle)
    with pytest.raises(InputError, match="yaw_stiffness"):
        wheelset.wheelset_model(vehicle)
