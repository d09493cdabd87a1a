"""The other half of a vehicle: what a half vehicle and a whole one have in common, and what not."""

from pathlib import Path

import numpy as np
import pytest

from railsim.effects.second_bogie import SecondBogie
from railsim.errors import InputError
from railsim.scenario import load_scenario
from railsim.simulation import measure, simulate_held
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.whole_vehicle import WholeVehicle

SPEED, START, BUMP = 25.0, 60.0, 40.0  # m/s, m, m ahead of the start


def test_a_whole_vehicle_is_half_of_it_twice():
    """Of a whole vehicle without what a half has no counterpart for, the half leads back to it."""
    whole = ManchesterWhole()
    turned = whole.body_pitch_inertia / (whole.body_mass * whole.semi_bogie_spacing**2)
    again = WholeVehicle.of_half(whole.half(), turned)
    inertia = {name: pytest.approx(getattr(whole, name)) for name in ("body_pitch_inertia", "body_yaw_inertia")}
    assert again.model_dump() == whole.model_dump() | inertia


@pytest.mark.parametrize("share", [0.05, 0.27, 0.6])
def test_its_ends_are_coupled_by_the_share(share: float):
    """Kinetic energy in the motions z1, z2 of the ends: m (z1 + z2)^2 / 8 + I ((z1 - z2) / 2 a)^2 / 2 with I of
    (1 - share) m a^2. Its mixed coefficient over that of z1^2 / 2 is share / (2 - share).
    """
    half = load_scenario("straight_erri_low", {"vehicle": "manchester"})
    whole = half.but(effects=(SecondBogie(share=share),)).model
    body = whole.bodies[whole.index("body")]
    a, inertia = half.vehicle.model_dump()["semi_bogie_spacing"], body.inertia[1]
    assert body.mass == pytest.approx(2.0 * half.model.bodies[half.model.index("body")].mass)
    own, mixed = body.mass / 4 + inertia / (4 * a**2), body.mass / 4 - inertia / (4 * a**2)
    assert mixed / own == pytest.approx(share / (2.0 - share))


def over_a_bump(folder: Path, share: float | None) -> np.ndarray:
    """Vertical acceleration at the body over the leading bogie [m/s2] of a half vehicle, or of a whole one."""
    s = np.arange(0.0, 300.0, 0.25)
    heights = 3e-3 * np.exp(-(((s - START - BUMP) / 4.0) ** 2))
    (folder / "bump.csv").write_text(
        "s [m],vertical [m]\n" + "\n".join(f"{a},{b}" for a, b in zip(s, heights, strict=True))
    )
    ideal = {"kind": "accelerometer", "name": "body", "body": "body", "axes": ["z"], "rate": 256, "errors": {}}
    effects = [] if share is None else [{"kind": "second_bogie", "share": share}]
    told = {"vehicle": "manchester", "speed.speed": SPEED, "duration": 5.0, "sensors": [ideal], "effects": effects,
            "track": str(folder / "bump.csv"), "start": START}  # fmt: skip
    scenario = load_scenario("straight_erri_low", told)
    read = measure(simulate_held(scenario, "compiled"), scenario).measurements
    return read["body.acceleration_z [m/s2]"]


def test_the_body_over_a_bump_moves_as_half_a_body_until_the_other_bogie_comes(tmp_path: Path):
    half, apart, whole = (over_a_bump(tmp_path, share) for share in (None, 1e-9, 0.27))
    largest = np.abs(half - half[0]).max()
    assert np.abs(apart - half).max() < 0.05 * largest
    assert np.abs(whole - half).max() > 0.15 * largest


def test_a_whole_vehicle_has_no_other_half():
    with pytest.raises(InputError, match="take half a vehicle"):
        load_scenario("straight_erri_low", {"vehicle": "manchester_whole", "effects": [{"kind": "second_bogie"}]})
