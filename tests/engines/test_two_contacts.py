"""Tread and flange at once: balance in a curve, energy, no chatter, agreement of the engines, extra channels."""

from dataclasses import replace

import numpy as np
import pytest

from railsim.analysis.energy import energy_over
from railsim.constants import GRAVITY
from railsim.dynamics.channels import SECOND, channel_names
from railsim.dynamics.equilibrium import initial_state
from railsim.dynamics.plant import build_plant
from railsim.engines.interface import Run
from railsim.errors import InputError
from railsim.profiles.pair import ProfilePair
from railsim.scenario import load_scenario
from railsim.simulation import build_run
from railsim.track.track import CANT_BASE
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.manchester_whole import ManchesterWhole
from tests.engines.rig import Rows, curve, flat, go, make_run, rough
from tests.engines.test_energy import NO_LOSSES

TWO = ProfilePair(kind="profiles", contacts=2)
RADIUS, SPEED = 300.0, 12.0
CANT = SPEED**2 / RADIUS / GRAVITY * CANT_BASE
OUTER = "wheel1_right"  # of the leading wheelset in a left-hand curve


def in_curve(vehicle: Vehicle, duration: float) -> Run:
    """From the straight into a curve of 300 m."""
    return make_run(vehicle.model(), curve(RADIUS, CANT, 260.0), SPEED, duration)


def contacts(rows: Rows, wheel: str) -> np.ndarray:
    """(2, 3, rows) forces [N] of each contact on one wheel in the track frame."""
    found = []
    yaw = rows[f"wheelset{wheel[5]}.yaw [rad]"]
    for prefix in ("", "second_"):
        angle = rows[f"{wheel}.{prefix}contact_angle [rad]"]
        normal, along, aside = (
            rows[f"{wheel}.{prefix}{force} [N]"] for force in ("normal_force", "creep_force_x", "creep_force_y")
        )
        level = aside * np.cos(angle)
        across = along * yaw + level - normal * np.sin(angle)
        found.append(np.array([along - level * yaw, across, aside * np.sin(angle) + normal * np.cos(angle)]))
    return np.array(found)


@pytest.mark.parametrize("vehicle", [Manchester(pair=TWO), ManchesterWhole(pair=TWO)], ids=["half", "whole"])
def test_tread_and_flange_balance_weight_and_centrifugal_force(vehicle: Vehicle) -> None:
    run = in_curve(vehicle, 16.0)
    rows, model = go("compiled", run), run.model
    first, second = (float(force[2, -1]) for force in contacts(rows, OUTER))
    assert first > 1e3
    assert second > 1e3
    total, s = np.zeros(3), [body.position[0] for body in model.bodies]
    for number, wheelset in enumerate(model.wheelsets, 1):
        turn = s[model.index(wheelset.body)] / RADIUS  # of the wheelset's track frame against the reference's
        for side in ("left", "right"):
            along, across, up = contacts(rows, f"wheel{number}_{side}").sum(axis=0)[:, -512:].mean(axis=1)
            total += [along - turn * across, across + turn * along, up]
    mass = sum(body.mass for body in model.bodies)
    lean = np.arcsin(CANT / CANT_BASE)
    outward = SPEED**2 / RADIUS
    weight = mass * (GRAVITY * np.cos(lean) + outward * np.sin(lean))
    across = mass * (outward * np.cos(lean) - GRAVITY * np.sin(lean))
    assert total[2] == pytest.approx(weight, rel=0.01)
    assert total[1] == pytest.approx(across, abs=0.01 * weight)


def test_energy_is_kept_with_two_contacts() -> None:
    """The vehicle runs sideways against its flanges; what is lost is the integrator's and falls with its step. Impacts
    spread the loss at one step by a factor of three when the start changes by 1e-12, so that the steps are far apart.
    """
    model = Manchester(**NO_LOSSES, pair=TWO).model()
    run = make_run(model, flat(), 20.0, 4.0, start=0.0)
    rest = initial_state(build_plant(model, run.track, run.speed), run)
    moving, sideways = rest.copy(), [i for i, name in enumerate(model.names) if name.endswith(".y")]
    moving[len(model.names) + np.array(sideways)] = 0.2
    losses = []
    for finer in (4, 16):
        run = make_run(model, flat(), 20.0, 4.0, start=0.0, initial=moving, finer=finer)
        total = energy_over(run).sum(axis=1)
        losses.append(float(np.abs(total - total[0]).max()) / (0.5 * 0.2**2 * sum(b.mass for b in model.bodies)))
    assert go("compiled", run)["wheel1_left.second_normal_force [N]"].max() > 1e5
    assert losses[0] < 1e-3
    assert losses[1] < 0.1 * losses[0]


def test_second_contact_does_not_chatter() -> None:
    """With half the step the forces converge, and the flange is touched as often as before."""
    track = rough(curve(800.0, 25.0**2 / 800.0 / GRAVITY * CANT_BASE, 400.0, 20.0), 3.0)
    model = Manchester(pair=TWO).model()
    found = [go("compiled", make_run(model, track, 25.0, 13.0, finer=n)) for n in (1, 2, 4)]
    forces = [rows[f"{OUTER}.second_normal_force [N]"] for rows in found]
    starts = [int(np.count_nonzero((force[1:] > 0.0) & (force[:-1] == 0.0))) for force in forces]
    assert starts[0] > 50
    assert starts == [starts[0]] * 3
    changes = [np.sqrt(np.mean((one - two) ** 2)) for one, two in zip(forces, forces[1:], strict=False)]
    assert changes[0] < 1e-3 * forces[2].max()
    assert changes[1] < 0.25 * changes[0]


def test_two_contacts_on_a_track_of_its_own_mass() -> None:
    """Both contacts press the same light rail; with half the step the forces are the same."""
    run = build_run(load_scenario("curve_s1002_flange", {"start": 380.0, "duration": 3.0, "flexible_track": {}}))
    coarse, fine = go("compiled", run), go("compiled", replace(run, substeps=2 * run.substeps))
    name = f"{OUTER}.second_normal_force [N]"
    assert coarse[name].min() > 1e3
    assert np.sqrt(np.mean((coarse[name] - fine[name]) ** 2)) < 0.02 * np.std(fine[name])


@pytest.mark.parametrize(
    ("vehicle", "other"),
    [(Manchester(pair=TWO), "exudyn"), (Manchester(pair=TWO), "verlet"), (ManchesterWhole(pair=TWO), "verlet")],
    ids=["half exudyn", "half verlet", "whole verlet"],
)
def test_engines_agree_on_flange_contact(vehicle: Vehicle, other: str) -> None:
    run = in_curve(vehicle, 13.0)
    ours, theirs = go("compiled", run), go(other, run)
    for wheel in (OUTER, "wheel1_left"):
        for quantity in (
            "normal_force [N]",
            "creep_force_y [N]",
            "second_normal_force [N]",
            "second_creep_force_y [N]",
        ):
            name = f"{wheel}.{quantity}"
            moved = float(np.ptp(ours[name]))
            assert np.abs(ours[name] - theirs[name]).max() <= 5e-3 * max(moved, 1.0), name


def test_channels_of_the_second_contact_only_where_there_is_one() -> None:
    plain = channel_names(Manchester(pair=TWO.but(contacts=1)).model())
    double = channel_names(Manchester(pair=TWO).model())
    assert not any("second" in name for name in plain)
    added = [name for name in double if name not in plain]
    assert added == [f"wheel{n}_{side}.{q}" for n in (1, 2) for side in ("left", "right") for q in SECOND]


@pytest.mark.parametrize(
    ("pair", "words"),
    [
        ({"kind": "profiles", "contacts": 3}, "less than or equal to 2"),
        ({"kind": "smooth", "contacts": 2}, "unknown key"),
    ],
)
def test_other_numbers_of_contacts_are_refused_in_one_line(pair: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        load_scenario("curve_s1002", {"vehicle.pair": pair})
    assert "contacts" in str(refused.value)
    assert "\n" not in str(refused.value)
