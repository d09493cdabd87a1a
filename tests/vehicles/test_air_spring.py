"""Air springs against the gas that is in them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railsim.dynamics.laws import law_force
from railsim.force_laws import MOST_NUMBERS, Maxwell
from railsim.vehicles.air_spring import AirSpring, Vertical

ATMOSPHERE, LOAD = 101325.0, 90e3  # Pa, N
AREA, GROWTH, BAG, RESERVOIR, EXPONENT, PIPE, AT = 0.25, 0.2, 0.03, 0.06, 1.4, 60e3, 415e3
SPRING = AirSpring(
    area=AREA,
    area_rate=GROWTH,
    bag_volume=BAG,
    reservoir_volume=RESERVOIR,
    exponent=EXPONENT,
    pipe_damping=PIPE,
    pipe_pressure=AT,
)
FREQUENCIES = (0.05, 0.5, 1.5, 4.0, 10.0, 40.0)  # Hz


def three_elements(s: complex) -> complex:
    """Nishimura's stiffness: the bag in series with reservoir and pipe beside each other; the change of the area."""
    pressure = ATMOSPHERE + LOAD / AREA
    k1, k2 = (EXPONENT * pressure * AREA**2 / volume for volume in (BAG, RESERVOIR))
    c = PIPE * pressure / AT
    return k1 * (k2 + c * s) / (k1 + k2 + c * s) + LOAD / AREA * GROWTH


def stiffness(parts: Vertical, s: complex) -> complex:
    return parts.stiffness + parts.series_stiffness * parts.damping * s / (parts.series_stiffness + parts.damping * s)


@pytest.mark.parametrize("frequency", FREQUENCIES)
def test_dynamic_stiffness_is_that_of_three_elements(frequency: float) -> None:
    s = 2j * np.pi * frequency
    assert stiffness(SPRING.vertical(LOAD), s) == pytest.approx(three_elements(s), rel=1e-12)


@pytest.mark.parametrize("frequency", FREQUENCIES)
def test_gas_that_is_pressed_and_flows_has_this_stiffness(frequency: float) -> None:
    """Polytropic gas in two volumes with a pipe between, 0.2 mm up and down: mass balance, nothing linearised."""
    pressure = ATMOSPHERE + LOAD / AREA
    amplitude, omega = 2e-4, 2.0 * np.pi * frequency
    resistance = PIPE * pressure / AT / AREA**2  # Pa s/m3 of air at this pressure

    def pressures(t: float | np.ndarray, passed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """After a share of the air, counted in m3 at rest, has passed into the reservoir."""
        bag = BAG - AREA * amplitude * np.sin(omega * t)
        return pressure * ((BAG - passed) / bag) ** EXPONENT, pressure * (1.0 + passed / RESERVOIR) ** EXPONENT

    def flow(t: float, passed: np.ndarray) -> np.ndarray:
        high, low = pressures(t, passed)
        return (high - low) / resistance

    slowest = resistance / (EXPONENT * pressure * (1.0 / BAG + 1.0 / RESERVOIR))
    periods = max(3, int(np.ceil(12.0 * slowest * frequency)) + 1)
    end = periods / frequency
    t = np.linspace(end - 1.0 / frequency, end, 400, endpoint=False)
    solved = solve_ivp(flow, (0.0, end), [0.0], t_eval=t, method="LSODA", rtol=1e-9, atol=1e-13)
    pressed = amplitude * np.sin(omega * t)
    force = (pressures(t, solved.y[0])[0] - ATMOSPHERE) * (AREA + GROWTH * pressed) - LOAD
    carrier = np.exp(-1j * omega * t)
    measured = (force @ carrier) / (pressed @ carrier)
    assert stiffness(SPRING.vertical(LOAD), 1j * omega) == pytest.approx(measured, rel=5e-3)


@pytest.mark.parametrize("frequency", [0.5, 4.0, 40.0])
def test_law_of_the_engine_has_this_stiffness(frequency: float) -> None:
    """The element beside the spring, stepped through some periods."""
    parts = SPRING.vertical(LOAD)
    law = Maxwell(parts.series_stiffness, parts.damping)
    row, tables, omega = np.zeros(MOST_NUMBERS), np.zeros(1), 2.0 * np.pi * frequency
    row[: len(law.numbers())] = law.numbers()

    def rate(t: float, state: np.ndarray) -> list[float]:
        return [law_force(law.code, row, tables, t, 0.0, omega * np.cos(omega * t), state[0])[1]]

    periods = max(3, int(np.ceil(12.0 * parts.damping / parts.series_stiffness * frequency)) + 1)
    end = periods / frequency
    t = np.linspace(end - 1.0 / frequency, end, 400, endpoint=False)
    states = solve_ivp(rate, (0.0, end), [0.0], t_eval=t, method="LSODA", rtol=1e-9, atol=1e-12).y[0]
    force = np.array([law_force(law.code, row, tables, 0.0, 0.0, 0.0, state)[0] for state in states])
    force += parts.stiffness * np.sin(omega * t)
    carrier = np.exp(-1j * omega * t)
    measured = (force @ carrier) / (np.sin(omega * t) @ carrier)
    assert measured == pytest.approx(three_elements(1j * omega), rel=1e-3)


def test_pressure_follows_the_load() -> None:
    assert SPRING.pressure(0.25e5) == ATMOSPHERE + 1e5
    more, less = SPRING.vertical(2.0 * LOAD), SPRING.vertical(LOAD)
    assert more.stiffness > 1.7 * less.stiffness
    assert more.damping / less.damping == pytest.approx(SPRING.pressure(2.0 * LOAD) / SPRING.pressure(LOAD))
