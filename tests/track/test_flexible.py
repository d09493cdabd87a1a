"""The lumped track against a rail on discrete supports, which is assembled here: finite elements of an Euler beam, a
pad, a sleeper and its ballast every 0.6 m.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from railsim.dynamics.corunning import (
    COORDINATES,
    LEFT_Y,
    LEFT_Z,
    RIGHT_Y,
    RIGHT_Z,
    track_rates,
)
from railsim.dynamics.plant import build_plant
from railsim.track.flexible import FlexibleTrack, longest_step
from railsim.vehicles.wheelset import WheelsetVehicle
from tests.engines.rig import flat, make_run

BAYS, PIECES = 80, 6  # sleeper bays, elements of a bay
VERTICAL, LATERAL = "vertical", "lateral"
UNIFORM = FlexibleTrack(stiffness_variation=0.0)
STIFF = UNIFORM.but(pad_stiffness_vertical=280e6, ballast_stiffness_vertical=180e6)
SOFT = UNIFORM.but(pad_stiffness_vertical=65e6, ballast_stiffness_vertical=50e6)


def beam(track: FlexibleTrack, direction: str, frequency: float, above_a_sleeper: bool) -> complex:
    """Receptance [m/N] of one rail where the force acts, above a sleeper in the middle or half a bay from it."""
    bend, mass, length = track.rail_bending_vertical, track.rail_mass, track.sleeper_spacing / PIECES
    pad, damper = track.pad_stiffness_vertical, track.pad_damping_vertical
    bed, bed_damper = track.ballast_stiffness_vertical, track.ballast_damping_vertical
    if direction == LATERAL:
        bend, pad, damper = track.rail_bending_lateral, track.pad_stiffness_lateral, track.pad_damping_lateral
        bed, bed_damper = track.ballast_stiffness_lateral, track.ballast_damping_lateral
    w = 2.0 * np.pi * frequency
    a, b = length, length**2
    stiffness = [[12, 6 * a, -12, 6 * a], [6 * a, 4 * b, -6 * a, 2 * b]]
    stiffness += [[-12, -6 * a, 12, -6 * a], [6 * a, 2 * b, -6 * a, 4 * b]]
    inertia = [[156, 22 * a, 54, -13 * a], [22 * a, 4 * b, 13 * a, -3 * b]]
    inertia += [[54, 13 * a, 156, -22 * a], [-13 * a, -3 * b, -22 * a, 4 * b]]
    element = bend / length**3 * np.array(stiffness) - w**2 * mass * length / 420.0 * np.array(inertia)
    count = BAYS * PIECES
    dofs = 2 * np.arange(count)[:, None] + np.arange(4)
    rows, columns = np.repeat(dofs, 4, axis=1).ravel(), np.tile(dofs, (1, 4)).ravel()
    upper, lower = pad + 1j * w * damper, bed + 1j * w * bed_damper - w**2 * 0.5 * track.sleeper_mass
    supports = 2 * PIECES * np.arange(BAYS + 1)
    values = np.concatenate([np.tile(element.ravel(), count), np.full(supports.size, upper * lower / (upper + lower))])
    place = np.concatenate([rows, supports]), np.concatenate([columns, supports])
    matrix = coo_array((values, place), shape=(2 * count + 2, 2 * count + 2)).tocsc()
    force = np.zeros(2 * count + 2, dtype=complex)
    loaded = PIECES * BAYS + (0 if above_a_sleeper else PIECES)  # two unknowns a node
    force[loaded] = 1.0
    return complex(np.asarray(spsolve(matrix, force))[loaded])


def lumped(track: FlexibleTrack, direction: str, frequency: float) -> complex:
    """Receptance of each rail of the kernel's own track with one force on both, from its linear equations."""
    model = replace(WheelsetVehicle().model(), corunning=track.corunning())
    run = make_run(model, flat(), 20.0, 1.0)
    plant = build_plant(model, run.track, run.speed)

    def rates(track: np.ndarray, y: float = 0.0, z: float = 0.0) -> np.ndarray:
        out = np.zeros(COORDINATES)
        track_rates(plant, 20.0, track[:COORDINATES], track[COORDINATES:], out, y, z, y, z)
        return out

    matrix = np.column_stack([rates(column) for column in np.eye(2 * COORDINATES)])
    still = np.zeros(2 * COORDINATES)
    push = rates(still, z=1.0) if direction == VERTICAL else rates(still, y=1.0)
    w = 2.0 * np.pi * frequency
    dynamic = -(w**2) * np.eye(COORDINATES) - matrix[:, :COORDINATES] - 1j * w * matrix[:, COORDINATES:]
    moved = np.linalg.solve(dynamic, push.astype(complex))
    first, second = (LEFT_Z, RIGHT_Z) if direction == VERTICAL else (LEFT_Y, RIGHT_Y)
    assert abs(moved[first] - moved[second]) < 1e-9 * abs(moved[first])
    return complex(moved[first])


@pytest.mark.parametrize("above_a_sleeper", [True, False])
@pytest.mark.parametrize(
    ("track", "direction", "highest"),
    [(UNIFORM, VERTICAL, 170.0), (SOFT, VERTICAL, 320.0), (STIFF, VERTICAL, 140.0), (UNIFORM, LATERAL, 110.0)],
    ids=["default, vertical", "soft, vertical", "stiff, vertical", "default, lateral"],
)
def test_receptance_is_that_of_a_rail_on_sleepers(
    track: FlexibleTrack, direction: str, highest: float, above_a_sleeper: bool
) -> None:
    """Within 30 % up to a frequency that docs/flexible_track.md states, and within 3 % where nothing moves fast."""
    for frequency in (*np.arange(5.0, highest, 15.0), highest):
        found, expected = lumped(track, direction, frequency), beam(track, direction, frequency, above_a_sleeper)
        assert abs(found) == pytest.approx(abs(expected), rel=0.30), frequency
    still = beam(track, direction, 0.5, above_a_sleeper)
    assert abs(lumped(track, direction, 0.5)) == pytest.approx(abs(still), rel=0.03)


def test_variation_from_sleeper_to_sleeper_is_that_of_the_beam() -> None:
    above, between = (1.0 / abs(beam(UNIFORM, VERTICAL, 0.01, place)) for place in (True, False))
    assert (above - between) / (above + between) == pytest.approx(FlexibleTrack().stiffness_variation, abs=1e-3)


def test_stiffness_and_resonance_are_those_of_a_beam_on_a_foundation() -> None:
    below, _ = UNIFORM.foundations
    assert pytest.approx(2.0 * 2.0**0.5 * 6.4e6**0.25 * below**0.75) == UNIFORM.stiffness
    own = UNIFORM.corunning()
    mass = own.rail_mass_z + 0.5 * own.sleeper_mass_z
    per_metre = UNIFORM.rail_mass + 0.5 * UNIFORM.sleeper_mass / UNIFORM.sleeper_spacing
    assert 1.0 / (own.compliance * mass) == pytest.approx(below / per_metre)


def test_stiffer_pads_ask_for_shorter_steps() -> None:
    assert longest_step(UNIFORM.corunning()) > 1.0 / 2048.0
    hard = UNIFORM.but(pad_stiffness_vertical=2e9)
    assert longest_step(hard.corunning()) < longest_step(UNIFORM.corunning()) / 2.5
