"""Profiles as a vehicle's setting: found, refused, run."""

import numpy as np
import pytest

from railsim.contact.pairs import WheelRailPair
from railsim.dynamics.channels import channel_names
from railsim.engines import compiled
from railsim.errors import InputError
from railsim.profiles.pair import ProfilePair
from railsim.vehicles.manchester import Manchester
from tests.engines.rig import flat, make_run


def test_kind_chooses_between_profiles_and_analytic_pairs() -> None:
    assert isinstance(Manchester.build({"pair": {"kind": "profiles"}}).pair, ProfilePair)
    assert isinstance(Manchester.build({"pair": {"conicity": 0.2}}).pair, WheelRailPair)


@pytest.mark.parametrize(
    ("pair", "complaint"),
    [
        ({"kind": "profiles", "wear": 2}, "vehicle.pair.wear: Input should be less than or equal to 1"),
        ({"kind": "profiles", "conicity": 0.1}, "vehicle.pair.conicity: unknown key; ProfilePair knows"),
        ({"wear": 0.5}, "vehicle.pair.wear: unknown key; WheelRailPair knows"),
    ],
)
def test_wrong_settings_are_one_line(pair: dict[str, object], complaint: str) -> None:
    with pytest.raises(InputError) as error:
        Manchester.build({"pair": pair}, "vehicle")
    assert str(error.value).startswith(complaint)
    assert "\n" not in str(error.value)


def test_unknown_profile_names_the_shipped_ones() -> None:
    with pytest.raises(InputError, match="shipped profiles are: .*s1002.*uic60_40"):
        Manchester.build({"pair": {"kind": "profiles", "wheel": "s1003"}}).model()


def test_vehicle_on_profiles_rests_on_its_contacts() -> None:
    """S1002 on 60E1 at 1:40: contacts 750.5 mm from the centre line, contact angle some hundredths, weight carried."""
    model = Manchester.build({"pair": {"kind": "profiles"}}).model()
    names = channel_names(model)
    rows = np.concatenate(list(compiled.integrate(make_run(model, flat(), 20.0, 0.5))))
    last = dict(zip(names, rows[-1], strict=True))
    assert abs(last["wheelset1.y [m]"]) < 1e-9
    assert last["wheel1_left.contact_angle [rad]"] == pytest.approx(-last["wheel1_right.contact_angle [rad]"], rel=1e-9)
    assert 0.01 < last["wheel1_left.contact_angle [rad]"] < 0.06
    carried = 0.0
    for wheel in ("wheel1_left", "wheel1_right", "wheel2_left", "wheel2_right"):
        angle = last[f"{wheel}.contact_angle [rad]"]
        carried += last[f"{wheel}.normal_force [N]"] * np.cos(angle) + last[f"{wheel}.creep_force_y [N]"] * np.sin(
            angle
        )
    assert carried == pytest.approx(9.81 * sum(body.mass for body in model.bodies), rel=1e-6)
