"""Every vehicle: units and sources, bounds, a model that both engines can read."""

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.vehicles.interface import VEHICLES
from railsim.vehicles.manchester import Manchester

FOUND = VEHICLES.classes()


@pytest.mark.parametrize("name", FOUND)
def test_every_number_has_unit_and_source(name: str) -> None:
    kind = FOUND[name]
    for field, value in kind.build({}).nominal().items():
        unit, source = kind.about(field)
        assert unit, field
        assert source, field
        assert np.isfinite(value)


@pytest.mark.parametrize("name", FOUND)
def test_model_is_consistent(name: str) -> None:
    model = FOUND[name].build({}).model()
    assert len(set(model.names)) == len(model.names)
    assert (model.mass > 0.0).all()
    for element in model.elements:
        for matrix in (element.stiffness, element.damping):
            assert np.allclose(matrix, matrix.T)
            assert np.linalg.eigvalsh(matrix).min() > -1e-6
    assert np.allclose(model.stiffness, model.stiffness.T)
    assert {w.body for w in model.wheelsets} | {model.reference} <= {body.name for body in model.bodies}


def test_preloads_carry_the_bodies() -> None:
    """Without contacts: springs and weight are in balance for car body and bogie."""
    model = Manchester().model()
    secondary = model.elements[0]
    force = model.preload + model.relative("body", "bogie", secondary.position)[:3].T @ np.array(secondary.preload)
    for name in ("body", "bogie"):
        index = model.index(name)
        assert force[6 * index + 2] == pytest.approx(model.bodies[index].mass * 9.81, rel=1e-12)
        assert np.abs(np.delete(force[6 * index : 6 * index + 6], 2)).max() < 1e-6


@pytest.mark.parametrize("field", ["bogie_mass", "wheel_radius", "secondary_lateral_stiffness"])
def test_negative_parameters_are_refused(field: str) -> None:
    with pytest.raises(InputError, match=field):
        Manchester.build({field: -1.0})
