"""Element laws of effects against closed forms."""

import numpy as np
import pytest

from railsim.dynamics.laws import law_force
from railsim.errors import InputError
from railsim.force_laws import MOST_NUMBERS, BlowOff, BumpStop, DryFriction, ForceLaw, Maxwell, Scheduled, Tabulated

STEP = 1e-4  # s
NO_TABLE = np.zeros(1)


def row(*numbers: float) -> np.ndarray:
    """A kernel's row."""
    return np.concatenate((numbers, np.zeros(MOST_NUMBERS - len(numbers))))


def force(law: ForceLaw, elongation: float, rate: float, t: float = 0.0) -> float:
    """Force of a law without a state or a table."""
    return law_force(law.code, row(*law.numbers()), NO_TABLE, t, elongation, rate, 0.0)[0]


def driven(law: ForceLaw, amplitude: float, omega: float, turns: int = 12) -> np.ndarray:
    """Force over the last turn of a sinusoidal elongation; a state of the law by the trapezoidal rule."""
    padded, state, forces = row(*law.numbers()), 0.0, []
    count = round(2 * np.pi / omega / STEP)
    time = np.arange(turns * count + 1) * (2 * np.pi / omega / count)
    place, pace = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
    for i in range(len(time)):
        now, change = law_force(law.code, padded, NO_TABLE, time[i], place[i], pace[i], state)
        forces.append(now)
        if i + 1 < len(time):
            trial = state + (time[i + 1] - time[i]) * change
            after = law_force(law.code, padded, NO_TABLE, time[i + 1], place[i + 1], pace[i + 1], trial)[1]
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
    found = harmonic(driven(Maxwell(stiffness, damping), 1e-3, omega), 1e-3)
    exact = 1j * omega * damping / (1 + 1j * omega * damping / stiffness)
    assert found == pytest.approx(exact, rel=2e-3)


def test_friction_loses_four_times_force_times_amplitude_a_cycle():
    amplitude, omega = 5e-3, 20.0
    forces = driven(DryFriction(1000.0, 1e-4), amplitude, omega, turns=1)
    phase = np.linspace(0.0, 2 * np.pi, len(forces))
    assert np.trapezoid(forces, amplitude * np.sin(phase)) == pytest.approx(4 * 1000.0 * amplitude, rel=2e-3)


def test_blow_off_takes_the_damping_beyond_the_velocity():
    """Beside a damper of 2e4 N s/m, 0.1 m/s and a share of 0.1: 2000 N at 0.1 m/s, 2200 N at 0.2 m/s."""
    law = BlowOff(damping=2e4, damping_beyond=2e3, velocity=0.1)
    assert [2e4 * v + force(law, 0.0, v) for v in (0.1, 0.2, -0.2)] == pytest.approx([2000.0, 2200.0, -2200.0])


def test_bump_stop_off_centre_is_the_same_stop_moved():
    forces = [
        force(BumpStop(0.01, 3e4, 1e9, middle), place, 0.0)
        for place, middle in ((0.02, 0.0), (0.025, 0.005), (-0.015, 0.005))
    ]
    assert forces == pytest.approx([1300.0, 1300.0, -1300.0])


def test_scheduled_law_fades_in_over_its_ramp():
    law = Scheduled(stiffness=2e3, damping=50.0, onset=1.0, ramp=2.0, force=10.0)
    full = 2e3 * 0.1 + 50.0 * 0.2 + 10.0
    assert [force(law, 0.1, 0.2, t) for t in (0.5, 1.0, 2.0, 5.0)] == pytest.approx([0.0, 0.0, 0.5 * full, full])
    assert force(Scheduled(force=10.0), 0.1, 0.2) == 10.0


def test_table_gives_its_points_and_is_held_beyond_them():
    law = Tabulated(-0.01, 0.01, -1.0, 2.0, np.arange(6.0).reshape(3, 2))
    padded, tables = row(*law.numbers(), 1, 3, 2), np.concatenate(([99.0], law.table.ravel()))
    for i, place in enumerate((-0.01, 0.0, 0.01)):
        for j, pace in enumerate((-1.0, 1.0)):
            assert law_force(law.code, padded, tables, 0.0, place, pace, 0.0)[0] == pytest.approx(law.table[i, j])
    assert law_force(law.code, padded, tables, 0.0, 0.005, 0.0, 0.0)[0] == pytest.approx(3.5)
    assert law_force(law.code, padded, tables, 0.0, 5.0, 5.0, 0.0)[0] == law.table[-1, -1]


def test_laws_have_codes_of_their_own_and_rows_with_room():
    laws = [BumpStop, Scheduled, Maxwell, DryFriction, BlowOff, Tabulated]
    assert len({law.code for law in laws}) == len(laws)
    assert max(len(law.positions()) for law in laws) <= MOST_NUMBERS


@pytest.mark.parametrize(
    ("law", "numbers", "words"),
    [
        (BumpStop, (-0.01, 3e4, 1e9), "gap"),
        (BumpStop, (0.01, float("nan"), 1e9), "stiffness"),
        (Scheduled, (0.0, 0.0, 1.0, 0.0), "ramp"),
        (Maxwell, (5e6, 0.0), "damping"),
        (DryFriction, (1000.0, 0.0), "slip"),
        (BlowOff, (2e4, -1.0, 0.1), "damping_beyond"),
        (Tabulated, (0.0, 0.01, 0.0, 0.0, np.ones((2, 2))), "rate_step"),
        (Tabulated, (0.0, 0.01, 0.0, 0.1, np.ones((1, 2))), "2 x 2"),
    ],
)
def test_law_refuses_numbers_that_mean_nothing(law: type[ForceLaw], numbers: tuple, words: str):
    with pytest.raises(InputError, match=words):
        law(*numbers)
