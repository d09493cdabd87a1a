"""Energy of a vehicle without dampers and creep: kept, but for what the integrator loses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from railsim.analysis.energy import energy_over
from railsim.dynamics.equilibrium import initial_state, state_size
from railsim.dynamics.kernel import derivatives
from railsim.dynamics.plant import build_plant
from railsim.dynamics.workspace import NO_WHEELS, workspace
from railsim.model import Model
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.class175 import Class175
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole
from tests.engines.rig import flat, make_run

NO_LOSSES = {
    "primary_longitudinal_damping": 0.0,
    "primary_lateral_damping": 0.0,
    "primary_vertical_damping": 0.0,
    "secondary_lateral_damping": 0.0,
    "secondary_vertical_damping": 0.0,
    "yaw_damper_damping": 0.0,
    "contact_damping_ratio": 0.0,
    "adhesion": Adhesion(creep=False),
}
SOFT = {"body.y": 3e-3, "body.z": 3e-3, "body.roll": 2e-3}
STIFFER = {"bogie.z": 1e-3, "bogie.pitch": 5e-4}


def displaced(model: Model, moved: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """States at rest: in equilibrium, and with some coordinates moved while all others follow without acceleration."""
    run = make_run(model, flat(), 20.0, 1.0, start=0.0)
    plant = build_plant(model, run.track, run.speed)
    rest = initial_state(plant, run)
    x, n = rest.copy(), len(model.names)
    for name, distance in moved.items():
        x[model.names.index(name)] += distance
    others = [i for i in range(n) if model.names[i] not in moved]
    out, scratch = np.empty(state_size(plant)), workspace(int(plant.core.joints))

    def residual(place: np.ndarray) -> np.ndarray:
        x[others] = place
        derivatives(plant, 0.0, x, out, scratch, NO_WHEELS)
        return out[n : 2 * n][others]

    best, step = root(residual, x[others], tol=1e-13).x, 1e-7
    for _ in range(6):
        columns = [(residual(best + e) - residual(best - e)) / (2 * step) for e in step * np.eye(len(best))]
        best = best - np.linalg.solve(np.column_stack(columns), residual(best))
    assert np.abs(residual(best)).max() < 1e-9
    return rest, x


def drift(model: Model, moved: dict[str, float], steps: int | None = None) -> np.ndarray:
    """Change of total energy over 10 s, relative to the energy of the motion; `steps` of 1/1024 s, or the default."""
    rest, x = displaced(model, moved)
    run = make_run(model, flat(), 20.0, 10.0, start=0.0, initial=x)
    run = run if steps is None else replace(run, substeps=steps)
    still = energy_over(make_run(model, flat(), 20.0, 0.01, start=0.0, initial=rest))[0].sum()
    total = energy_over(run).sum(axis=1)
    assert total[0] - still > 0.5
    return (total - total[0]) / (total[0] - still)


LOSSLESS = [
    Manchester(**NO_LOSSES),
    Class175(**NO_LOSSES),
    ManchesterWhole(**NO_LOSSES, traction_rod_damping=0.0),
]


@pytest.mark.parametrize("vehicle", LOSSLESS, ids=lambda v: type(v).__name__)
def test_energy_is_kept(vehicle: Vehicle) -> None:
    """The secondary suspension, to second order in the rotations, included."""
    assert np.abs(drift(vehicle.model(), SOFT)).max() < 1e-8


def test_drift_falls_with_the_order_of_the_integrator() -> None:
    """Runge-Kutta's amplitude at frequency w loses (w h)^6 / 144 a step, its energy (w h)^6 / (72 h) a second: h^5."""
    model = Manchester(**NO_LOSSES).model()
    coarse, fine = drift(model, STIFFER, 1)[-1], drift(model, STIFFER, 2)[-1]  # 1/1024 and 1/2048 s
    assert -1e-4 < coarse < 0.0
    assert np.log2(coarse / fine) == pytest.approx(5.0, abs=0.2)


def test_loss_is_that_of_the_fourth_order_scheme() -> None:
    """Vertical motion of the bogie alone: the predicted loss of energy at its frequency."""
    model = Manchester(**NO_LOSSES).model()
    lost = drift(model, {"bogie.pitch": 5e-4}, 1)[-1]
    v = Manchester()
    wheelset = 2.0 * v.primary_vertical_stiffness * v.semi_wheelbase**2 * 2.0
    frequency = np.sqrt(wheelset / v.bogie_pitch_inertia)
    assert lost == pytest.approx(-10.0 * frequency**6 / 1024.0**5 / 72.0, rel=0.2)
