"""Effects on whole vehicles: each acts on the bogie or wheelset that it is told, as the suspension is built there."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest

from experiments.conformance.effects import changed_bodies, takes_the_part_that_it_is_told
from railsim import InputError, load_scenario
from railsim.effects.interface import EFFECTS, Effect, Setup
from railsim.force_laws import BlowOff, BumpStop, Maxwell, SeriesDamper
from railsim.model import LinearElement, Model, NonlinearElement
from railsim.scenario import Scenario
from railsim.spec import quantity

KINDS = EFFECTS.classes()
OF_A_BOGIE = sorted(name for name, kind in KINDS.items() if kind.fields_of("bogie"))
OF_A_WHEELSET = sorted(name for name, kind in KINDS.items() if kind.fields_of("wheelset"))
PLAIN = {"name": "manchester_whole", "yaw_damper_damping": 200e3}
ARMS = {**PLAIN, "arm_length": 0.48, "arm_rise": 0.014, "lateral_damper_height": 0.5}
COACH = {"name": "class175_whole"}
VEHICLES = {"manchester": PLAIN, "arms": ARMS, "class175": COACH}
STATED = {("class175", name) for name in ("yaw_damper_blow_off", "yaw_damper_series_stiffness")}
"""What the vehicle's dampers have by its own fields."""
CASES = [(v, name) for v in VEHICLES for name in OF_A_BOGIE if (v, name) not in STATED]


def scenario(vehicle: Any, *effects: dict[str, Any]) -> Scenario:
    """A short run with effects."""
    run = {"vehicle": vehicle, "sensors": [], "effects": list(effects), "start": 60.0, "duration": 0.3}
    return load_scenario("straight_erri_high", run)


def model(vehicle: Any, *effects: dict[str, Any]) -> Model:
    """The vehicle's model with effects."""
    return scenario(vehicle, *effects).model


def linear(one: Model) -> dict[str, LinearElement]:
    return {element.name: element for element in one.elements}


def laws(one: Model) -> dict[str, NonlinearElement]:
    return {element.name: element for element in one.nonlinear}


@pytest.mark.parametrize(("vehicle", "name"), CASES)
def test_each_bogie_alone_and_both_together(vehicle: str, name: str):
    build = VEHICLES[vehicle]
    nominal = model(build)
    one, two, both, in_turn = (
        model(build, *({"kind": name, "bogie": number} for number in numbers))
        for numbers in ([1], [2], ["both"], [1, 2])
    )
    first, second = changed_bodies(nominal, one), changed_bodies(nominal, two)
    assert "bogie" in first and "bogie2" not in first and not first & {"wheelset3", "wheelset4"}
    assert "bogie2" in second and "bogie" not in second and not second & {"wheelset1", "wheelset2"}
    assert np.allclose(both.stiffness, in_turn.stiffness, rtol=1e-12, atol=1e-6)
    assert np.allclose(both.damping, in_turn.damping, rtol=1e-12, atol=1e-6)
    assert laws(both) == laws(in_turn)


@pytest.mark.parametrize(("vehicle", "name"), CASES)
def test_bogies_stay_equal_under_an_effect_on_both(vehicle: str, name: str):
    """Stiffness and damping of a bogie against its own wheelsets, and of the body against a bogie about its centre."""
    one = model(VEHICLES[vehicle], {"kind": name})
    for kept in ("stiffness", "damping"):
        front, rear = ({_second(e, end): getattr(e, kept) for e in one.elements if _of(e, end)} for end in (1, 2))
        assert front.keys() == rear.keys()
        for element in front:
            assert np.allclose(front[element], rear[element], rtol=1e-12, atol=1e-6)
    front, rear = ({_second(e, end): (e.axis, e.law) for e in one.nonlinear if _of(e, end)} for end in (1, 2))
    assert front and front == rear


def _of(element: LinearElement | NonlinearElement, end: int) -> bool:
    return ("bogie", "bogie2")[end - 1] in (element.upper, element.lower)


def _second(element: LinearElement | NonlinearElement, end: int) -> str:
    """Name that both bogies' elements have alike: primary3 is the rear bogie's primary1, secondary2 its secondary."""
    name = element.name
    if name.startswith(("primary", "bushing")):
        stem, number = name[:7], int(name[7])
        return f"{stem}{number - 2 * (end - 1)}{name[8:]}"
    return name.replace("2", "") if end == 2 else name


@pytest.mark.parametrize("name", OF_A_BOGIE)
def test_a_half_vehicle_has_one_bogie(name: str):
    with pytest.raises(InputError) as refused:
        scenario("class175", {"kind": name, "bogie": 2})
    assert str(refused.value) == f"effects.0: effect '{name}': there is no bogie 2; give 1 or both"
    alone, both = (model("class175", {"kind": name, "bogie": bogie}) for bogie in (1, "both"))
    assert np.array_equal(alone.stiffness, both.stiffness) and np.array_equal(alone.damping, both.damping)
    assert laws(alone) == laws(both)


@pytest.mark.parametrize("name", OF_A_BOGIE)
def test_records_of_before_have_the_same_settings(name: str):
    """Digests of runs and of the fits' bank are made of them."""
    assert "bogie" not in KINDS[name].build({}).settings()
    assert KINDS[name].build({"bogie": 2}).settings()["bogie"] == 2


def test_conicity_of_all_wheelsets_has_the_settings_of_before():
    assert "wheelset" not in KINDS["conicity_change"].build({}).settings()
    assert KINDS["conicity_change"].build({"wheelset": 2}).settings()["wheelset"] == 2


@pytest.mark.parametrize("name", OF_A_WHEELSET)
@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_an_effect_on_a_wheelset_acts_on_that_one(name: str, number: int):
    effect = {"kind": name, "wheelset": number}
    for build in (PLAIN, ARMS):
        acting = scenario(build, effect)
        wheelsets = {body for body in changed_bodies(model(build), acting.model) if body.startswith("wheelset")}
        braked = {f"wheelset{entry.wheelset}" for entry in acting.setup.traction}
        assert wheelsets | braked == {f"wheelset{number}"}
    if number > 2:
        with pytest.raises(InputError, match=f"effects.0: effect '{name}': there is no wheelset {number}; give 1 to 2"):
            scenario("class175", effect)


def test_weak_yaw_dampers_lose_force_along_the_track_and_couple():
    for build in (PLAIN, ARMS):
        before, after = (linear(m)["yaw_dampers2"].damping for m in _with(build, {"kind": "weak_yaw_damper"}))
        assert np.array_equal(after, 0.5 * before) and before[0, 0] > 0.0 and before[5, 5] > 0.0


def test_a_weak_damper_with_a_law_of_its_own_gives_a_share_of_its_force():
    before, after = (laws(m)["yaw_damper2_left"].law for m in _with(COACH, {"kind": "weak_yaw_damper", "factor": 0.4}))
    assert isinstance(before, SeriesDamper) and isinstance(after, SeriesDamper)
    assert after.velocity == before.velocity
    for size in ("stiffness", "damping", "damping_beyond"):
        assert getattr(after, size) == pytest.approx(0.4 * getattr(before, size))
    gone = model(COACH, {"kind": "weak_yaw_damper", "factor": 0.0, "bogie": 2})
    assert [name for name in laws(gone) if name.startswith("yaw")] == ["yaw_damper_left", "yaw_damper_right"]


@pytest.mark.parametrize("kind", ["yaw_damper_blow_off", "yaw_damper_series_stiffness"])
def test_what_the_vehicle_states_of_its_dampers_is_refused_by_the_name_of_the_field(kind: str):
    with pytest.raises(InputError, match=f"effect '{kind}': 'yaw_damper_left' .* change the vehicle's {kind[:17]}"):
        scenario(COACH, {"kind": kind})


def test_an_onset_of_a_damper_with_a_law_of_its_own_is_refused():
    with pytest.raises(InputError, match="effect 'weak_yaw_damper': 'yaw_damper_left' .* from the start only"):
        scenario(COACH, {"kind": "weak_yaw_damper", "onset": 1.0})


def test_yaw_dampers_blow_off_one_by_one_where_they_stand():
    after = model(PLAIN, {"kind": "yaw_damper_blow_off", "velocity": 0.02, "bogie": 2})
    found = [e for e in after.nonlinear if isinstance(e.law, BlowOff)]
    assert [(e.axis, e.law) for e in found] == [("x", BlowOff(200e3, 0.1 * 200e3, 0.02))] * 2
    assert [e.position for e in found] == [pytest.approx((-19.0, y, 0.9)) for y in (1.3, -1.3)]


def test_a_spring_in_series_takes_the_place_of_the_linear_damper():
    after = model(PLAIN, {"kind": "yaw_damper_series_stiffness", "compliance": 2e-7, "bogie": 1})
    assert not linear(after)["yaw_dampers"].damping.any() and linear(after)["yaw_dampers2"].damping.any()
    assert [e.law for e in after.nonlinear if isinstance(e.law, Maxwell)] == [Maxwell(1.0 / 2e-7, 200e3)] * 2
    lateral = model(ARMS, {"kind": "lateral_damper_series_stiffness", "compliance": 1e-6, "bogie": 2})
    assert not linear(lateral)["lateral_dampers2"].damping.any()
    assert laws(lateral)["lateral_dampers2_y_series"].law == Maxwell(2e6, 2 * 32e3)


def test_guidance_stands_in_the_bushings_where_there_are_arms():
    """Along the track with all that the arm's slope couples, sideways by itself, and each without the other."""
    nominal = linear(model(ARMS))["bushing3"].stiffness
    along = linear(model(ARMS, {"kind": "primary_yaw_stiffness", "factor": 0.5}))["bushing3"].stiffness
    sideways = linear(model(ARMS, {"kind": "primary_lateral_stiffness", "factor": 0.5}))["bushing3"].stiffness
    softer = linear(model({**ARMS, "primary_longitudinal_stiffness": 0.5 * 31.391e6}))["bushing3"].stiffness
    shear = linear(model({**ARMS, "primary_lateral_stiffness": 0.5 * 3.884e6}))["bushing3"].stiffness
    assert np.allclose(along, softer, rtol=1e-12, atol=1e-6) and np.allclose(sideways, shear, rtol=1e-12, atol=1e-6)
    assert nominal[0, 2] != 0.0 and not np.allclose(along, nominal)


@pytest.mark.parametrize("build", [PLAIN, ARMS], ids=["plain", "arms"])
def test_a_misaligned_wheelset_is_at_rest_at_its_angle(build: dict[str, Any]):
    """Its suspension gives no force where the wheelset is turned by the angle about its centre."""
    after, angle = model(build, {"kind": "wheelset_misalignment", "angle": 2e-3, "wheelset": 3}), 2e-3
    turned = np.zeros(len(after.mass))
    turned[6 * after.index("wheelset3") + 5] = angle
    force = np.zeros(len(after.mass))
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    for element in (e for e in after.elements if "wheelset3" in (e.upper, e.lower)):
        relative = after.relative(element.upper, element.lower, element.position)
        force += relative.T @ (element.stiffness @ (relative @ turned))
        added = [e for e in after.nonlinear if e.name.startswith(f"{element.name}_misalignment")]
        force += sum(getattr(e.law, "force") * relative[axes.index(e.axis)] for e in added)  # noqa: B009
    assert np.abs(force).max() < 1e-9 * 31.391e6 * angle
    assert laws(after).keys() - laws(model(build)).keys()


def test_a_roll_bar_of_one_bogie_is_weak_beside_stiff_air_springs_in_any_order():
    weak, stiff = {"kind": "weak_roll_bar", "factor": 0.3, "bogie": 2}, {"kind": "air_spring_stiffness", "factor": 2.0}
    built = {**PLAIN, "roll_bar_stiffness": 0.3 * 940e3}
    only_weak = model(built, stiff)
    roll = 6 * only_weak.index("bogie2") + 3
    for order in ([weak, stiff], [stiff, weak]):
        both = model(PLAIN, *order)
        assert both.stiffness[roll, roll] == pytest.approx(only_weak.stiffness[roll, roll], rel=1e-9)


def test_payload_makes_the_whole_body_heavier_and_its_springs_carry_it():
    before, after = _with(PLAIN, {"kind": "payload", "mass": 3200.0, "height": 1.8})
    body = after.index("body")
    ratio = after.mass[6 * body : 6 * body + 6] / before.mass[6 * body : 6 * body + 6]
    assert ratio[[0, 4, 5]] == pytest.approx(1.1) and ratio[3] > 1.0
    for name in ("secondary", "secondary2"):
        assert linear(after)[name].preload[2] == pytest.approx(1.1 * linear(before)[name].preload[2])
    more = linear(after)["primary4"].preload[2] - linear(before)["primary4"].preload[2]
    assert more == pytest.approx(3200.0 * 9.81 / 4, rel=1e-3)


def test_a_whole_body_bends_at_its_centre_and_follows_it_along_the_track():
    after = model(PLAIN, {"kind": "body_bending", "share": 0.3})
    after.check()
    mode, body = (after.bodies[after.index(name)] for name in ("bending", "body"))
    assert (mode.position, mode.origin) == (body.position, body.origin)
    assert mode.mass + body.mass == pytest.approx(32000.0)
    assert after.driver == after.index("train")
    gear = next(element for element in after.elements if element.name == "draw_gear")
    assert (gear.upper, gear.lower) == ("body", "train")
    assert "x" in mode.free and "x" in body.free


def _with(build: Any, *effects: dict[str, Any]) -> tuple[Model, Model]:
    return model(build), model(build, *effects)


class FrontOnly(Effect, frozen=True):
    """What is told a bogie, and changes the bump stop of the front one whatever it is told."""

    closed: float = quantity(0.5, unit="-", source="illustrative", ge=0.0, le=1.0)
    bogie: Literal[1, 2, "both"] = quantity("both", unit="-", source="illustrative", role="bogie")

    def install(self, setup: Setup) -> Setup:
        """Another gap of the front bump stop."""

        def new(element: NonlinearElement) -> NonlinearElement:
            if element.name != "bump_stop" or not isinstance(element.law, BumpStop):
                return element
            return replace(element, law=replace(element.law, gap=0.5 * element.law.gap))

        return setup.modelled(lambda m: replace(m, nonlinear=tuple(new(e) for e in m.nonlinear)))


def test_conformance_finds_an_effect_that_acts_on_another_bogie_than_it_is_told():
    short = list(takes_the_part_that_it_is_told(FrontOnly))
    assert "on 'manchester_whole': number 2 changes bogie" in short
    assert any(text.startswith("on 'manchester': number 2 of 1 is not refused in one line") for text in short)


def test_an_onset_needs_arms_that_are_level_where_their_slope_couples():
    late = {"kind": "primary_yaw_stiffness", "onset": 1.0}
    with pytest.raises(InputError, match="effect 'primary_yaw_stiffness': 'bushing1' .* from the start only"):
        scenario(ARMS, late)
    level = model({**ARMS, "arm_rise": 0.0}, late)
    assert [e.axis for e in level.nonlinear if e.name.startswith("bushing4")] == ["x", "yaw"]
