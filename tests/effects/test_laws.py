"""Element laws of effects against closed forms."""

import numpy as np
import pytest

from railsim.dynamics.laws import law_force
from railsim.model import BLOW_OFF, BUMP_STOP, FRICTION, MAXWELL, TABLED

STEP = 1e-4  # s
NO_TABLE = np.zeros(1)


def driven(law: int, parameters: tuple[float, ...], amplitude: float, omega: float, turns: int = 12) -> np.ndarray:
    """Force over the last turn of a sinusoidal elongation; a state of the law by the trapezoidal rule."""
    padded, state, forces = np.zeros(8), 0.0, []
    padded[: len(parameters)] = parameters
    count = round(2 * np.pi / omega / STEP)
    time = np.arange(turns * count + 1) * (2 * np.pi / omega / count)
    place, pace = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
    for i in range(len(time)):
        force, change = law_force(law, padded, NO_TABLE, time[i], place[i], pace[i], state)
        forces.append(force)
        if i + 1 < len(time):
            trial = state + (time[i + 1] - time[i]) * change
            after = law_force(law, padded, NO_TABLE, time[i + 1], place[i + 1], pace[i + 1], trial)[1]
            state += 0.5 * (time[i + 1] - time[i]) * (change + after)
    return np.array(forces[-count - 1 :])


def harmonic(forces: np.ndarray, amplitude: float) -> complex:
    """Complex stiffness of the first harmonic: force = Re(K x), x = amplitude sin."""
    phase = np.linspace(0.0, 2 * np.pi, len(forces))
    sine, cosine = (np.trapezoid(forces * f(phase), phase) / np.pi for f in (np.sin, np.cos))
    return complex(sine, cosine) / amplitude


@pytest.mark.parametrize("omega", [20.0, 100.0, 500.0])
def test_maxwell_element_has_its_complex_stiffness(omega: float):
    stiffness, damping = 5e6, 2e4
    found = harmonic(driven(MAXWELL, (stiffness, damping), 1e-3, omega), 1e-3)
    exact = 1j * omega * damping / (1 + 1j * omega * damping / stiffness)
    assert found == pytest.approx(exact, rel=2e-3)


def test_friction_loses_four_times_force_times_amplitude_a_cycle():
    amplitude, omega = 5e-3, 20.0
    forces = driven(FRICTION, (1000.0, 1e-4), amplitude, omega, turns=1)
    phase = np.linspace(0.0, 2 * np.pi, len(forces))
    assert np.trapezoid(forces, amplitude * np.sin(phase)) == pytest.approx(4 * 1000.0 * amplitude, rel=2e-3)


def test_blow_off_takes_the_damping_beyond_the_velocity():
    """Beside a damper of 2e4 N s/m, 0.1 m/s and a share of 0.1: 2000 N at 0.1 m/s, 2200 N at 0.2 m/s."""
    padded = np.zeros(8)
    padded[:3] = 2e4, 2e3, 0.1
    total = [2e4 * v + law_force(BLOW_OFF, padded, NO_TABLE, 0.0, 0.0, v, 0.0)[0] for v in (0.1, 0.2, -0.2)]
    assert total == pytest.approx([2000.0, 2200.0, -2200.0])


def test_bump_stop_off_centre_is_the_same_stop_moved():
    force = [
        law_force(BUMP_STOP, np.array([0.01, 3e4, 1e9, middle, 0, 0, 0, 0]), NO_TABLE, 0.0, place, 0.0, 0.0)[0]
        for place, middle in ((0.02, 0.0), (0.025, 0.005), (-0.015, 0.005))
    ]
    assert force == pytest.approx([1300.0, 1300.0, -1300.0])


def test_table_gives_its_points_and_is_held_beyond_them():
    table = np.arange(6.0).reshape(3, 2)
    padded = np.zeros(8)
    padded[:7] = 1, 3, 2, -0.01, 0.01, -1.0, 2.0
    tables = np.concatenate(([99.0], table.ravel()))
    for i, place in enumerate((-0.01, 0.0, 0.01)):
        for j, pace in enumerate((-1.0, 1.0)):
            assert law_force(TABLED, padded, tables, 0.0, place, pace, 0.0)[0] == pytest.approx(table[i, j])
    assert law_force(TABLED, padded, tables, 0.0, 0.005, 0.0, 0.0)[0] == pytest.approx(3.5)
    assert law_force(TABLED, padded, tables, 0.0, 5.0, 5.0, 0.0)[0] == table[-1, -1]
