"""Payload and secondary springs that carry it: statics, heights, bounce, and both engines."""

from typing import Any

import numpy as np
import pytest

from railsim.analysis.linear import linearise
from railsim.constants import GRAVITY
from railsim.errors import InputError
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.lookup import build_vehicle
from railsim.vehicles.manchester_whole import ManchesterWhole
from railsim.vehicles.payload import LoadedBody, Payload, loaded
from railsim.vehicles.running_gear import RunningGear
from railsim.vehicles.whole_vehicle import WholeVehicle
from tests.engines.rig import Rows, curve, flat, go, make_run, ratio, rough

AIR: dict[str, Any] = {"area": 0.25, "bag_volume": 0.03, "reservoir_volume": 0.06, "area_rate": 0.2}
ASIDE = {"mass": 8000.0, "ahead": 3.0, "left": 0.3, "height": 1.6}
SEATS, STANDING = 64 * 80.0, 20 * 320.0  # kg on a whole coach
LEVELS = {"tare": 0.0, "half": 0.5 * SEATS, "full": SEATS, "crush": SEATS + STANDING}


def at_rest(vehicle: RunningGear, engine: str = "compiled") -> Rows:
    """Two rows on straight, smooth track."""
    return go(engine, make_run(vehicle.model(), flat(), 20.0, 2.0 / 1024.0))


def whole(**fields: Any) -> WholeVehicle:
    return ManchesterWhole.build(fields)


def wheel_forces(rows: Rows, vehicle: RunningGear) -> np.ndarray:
    """(wheelsets, 2) vertical forces, left and right [N]."""
    count = len(vehicle.model().wheelsets)
    names = [[f"wheel{i + 1}_{side}" for side in ("left", "right")] for i in range(count)]
    return np.array(
        [
            [
                rows[f"{n}.normal_force [N]"][0] * np.cos(rows[f"{n}.contact_angle [rad]"][0])
                + rows[f"{n}.creep_force_y [N]"][0] * np.sin(rows[f"{n}.contact_angle [rad]"][0])
                for n in pair
            ]
            for pair in names
        ]
    )


def test_two_bodies_together_have_the_inertia_of_their_parts() -> None:
    """Against the sum over eight mass points a body, all of them turned about the common centre."""

    def points(mass: float, centre: np.ndarray, radii: np.ndarray) -> np.ndarray:
        corners = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
        return np.hstack((np.full((8, 1), mass / 8), centre + corners * radii))

    empty = points(32000.0, np.array([0.0, 0.0, 1.8]), np.array([7.0, 1.2, 0.8]))
    radii = np.array([7.0, 0.7, np.sqrt(7.0**2 + 0.8**2 - 7.0**2)])
    more = points(8000.0, np.array([3.0, 0.3, 1.6]), radii)

    def inertia(parts: np.ndarray) -> tuple[float, tuple[float, float, float], np.ndarray]:
        m, r = parts[:, 0], parts[:, 1:]
        centre = m @ r / m.sum()
        square = (r - centre) ** 2
        return m.sum(), tuple(m @ (square.sum(axis=1) - square[:, k]) for k in range(3)), centre  # pyright: ignore

    _, own, _ = inertia(empty)
    spread = np.sqrt(inertia(more)[1][0] / 8000.0)
    together = loaded(LoadedBody(32000.0, own, 0.0, 0.0, 1.8), 8000.0, 1.6, 3.0, 0.3, spread)
    mass, expected, centre = inertia(np.vstack((empty, more)))
    assert together.mass == mass
    assert together.inertia[0] == pytest.approx(expected[0], rel=1e-12)
    # lengthwise the payload has the body's radius of gyration
    own_more = inertia(more)[1]
    for k in (1, 2):
        assert together.inertia[k] == pytest.approx(expected[k] - own_more[k] + own[k] / 4.0, rel=1e-12)
    assert [together.ahead, together.left, together.height] == pytest.approx(centre.tolist(), rel=1e-12)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("vehicle", ["manchester_whole", "manchester"])
def test_every_level_is_carried_by_all_wheels_alike(vehicle: str, level: str) -> None:
    built = build_vehicle({"name": vehicle, "payload": level})
    assert isinstance(built, RunningGear)
    share = 1.0 if vehicle == "manchester_whole" else 0.5
    wheels = 8 if vehicle == "manchester_whole" else 4
    empty = built.but(payload="tare")
    forces = wheel_forces(at_rest(built), built)
    assert forces == pytest.approx(empty.wheel_load + share * LEVELS[level] * GRAVITY / wheels, rel=1e-7)


@pytest.mark.parametrize("engine", ["compiled", "exudyn"])
@pytest.mark.parametrize("air", [None, AIR], ids=["steel", "air"])
def test_a_load_off_the_centre_is_in_balance(engine: str, air: dict[str, float] | None) -> None:
    """Forces and moments of all wheels against the weights where the bodies stand, and the bogies' shares by levers."""
    vehicle = whole(payload=ASIDE, air_spring=air)
    model, rows = vehicle.model(), at_rest(vehicle, engine)
    forces = wheel_forces(rows, vehicle)
    weights, moment, ahead = 0.0, 0.0, 0.0
    for body in model.bodies:
        weights += body.mass * GRAVITY
        moment += body.mass * GRAVITY * (body.position[1] + rows[f"{body.name}.y [m]"][0])
        ahead += body.mass * GRAVITY * body.position[0]
    assert forces.sum() == pytest.approx(weights, rel=1e-6)
    rails = 0.75  # m; distance of the contacts from the middle
    across = rails * (forces[:, 0] - forces[:, 1]).sum()
    assert across == pytest.approx(moment, rel=2e-4)
    axles = np.array([body.position[0] for body in model.bodies if body.name.startswith("wheelset")])
    assert forces.sum(axis=1) @ axles == pytest.approx(ahead, rel=2e-4)
    mass, x = 40000.0, 3.0 * 8000.0 / 40000.0
    front = mass * GRAVITY * (9.5 + x) / 19.0 + (2615.0 + 2 * 1813.0) * GRAVITY
    assert forces[:2].sum() == pytest.approx(front, rel=2e-4)


@pytest.mark.parametrize("level", LEVELS)
def test_air_springs_keep_the_body_in_its_height_over_the_bogie(level: str) -> None:
    """Within a millimetre. Above the rails it sinks as far as the primary springs of steel do."""
    rows = at_rest(whole(payload=level, air_spring=AIR))
    empty = at_rest(whole(air_spring=AIR))
    body, bogie = (rows[f"{name}.z [m]"][0] - empty[f"{name}.z [m]"][0] for name in ("body", "bogie"))
    assert abs(body - bogie) < 1e-5
    assert bogie == pytest.approx(-LEVELS[level] * GRAVITY / (8 * 1.22e6), abs=2e-5)  # and the contacts' own part


def test_steel_springs_sink() -> None:
    rows, empty = at_rest(whole(payload="crush")), at_rest(whole())
    sunk = LEVELS["crush"] * GRAVITY * (1.0 / (4 * 430e3) + 1.0 / (8 * 1.22e6))
    assert rows["body.z [m]"][0] - empty["body.z [m]"][0] == pytest.approx(-sunk, abs=2e-5)
    assert rows["primary1_left.displacement [m]"][0] == pytest.approx(-LEVELS["crush"] * GRAVITY / (8 * 1.22e6))


@pytest.mark.parametrize("mass", [0.0, 4000.0, 11520.0])
def test_bounce_follows_the_load_as_the_air_springs_say(mass: float) -> None:
    """Against body and bogie on Nishimura's spring with the pressure that the load asks for: the determinant of both
    bodies' equations, with the complex stiffness k1 (k2 + c s) / (k1 + k2 + c s) + k3, solved for s.
    """
    vehicle = whole(payload={"mass": mass}, air_spring=AIR, secondary_vertical_damping=0.0)
    load = (32000.0 + mass) * GRAVITY / 4.0
    pressure = 101325.0 + load / 0.25
    k1, k2 = (1.4 * pressure * 0.25**2 / volume for volume in (0.03, 0.06))
    k3, c = load / 0.25 * 0.2, 60e3 * pressure / 415e3
    body, bogie = (32000.0 + mass) / 4.0, 2615.0 / 2.0
    primary, damping = 2 * 1.22e6, 2 * 4e3
    # polynomials in s, the highest power first
    spring = np.polyadd(k1 * np.array([c, k2]), k3 * np.array([c, k1 + k2]))
    below = np.array([c, k1 + k2])
    upper = np.polyadd(np.polymul([body, 0, 0], below), spring)
    lower = np.polyadd(np.polymul([bogie, damping, primary], below), spring)
    roots = np.asarray(np.roots(np.polysub(np.polymul(upper, lower), np.polymul(spring, spring))))
    (expected,) = roots[(np.imag(roots) > 2.0) & (np.imag(roots) < 20.0)]
    ours = linearise(vehicle.model(), 20.0).eigenvalues()
    nearest = ours[np.abs(ours - expected).argmin()]
    assert float(np.imag(nearest)) == pytest.approx(float(np.imag(expected)), rel=5e-3)
    assert float(np.real(nearest)) == pytest.approx(float(np.real(expected)), rel=5e-2)


def test_engines_agree_with_a_load_off_the_centre() -> None:
    model = whole(payload=ASIDE, air_spring=AIR).model()
    track = rough(curve(1e9, 0.0, 220.0))
    fast, reference = (go(engine, make_run(model, track, 20.0, 6.0, start=25.0)) for engine in ("compiled", "exudyn"))
    for body in ("body", "bogie", "bogie2", "wheelset1", "wheelset4"):
        for axis in ("y [m]", "z [m]", "yaw [rad]"):
            assert ratio(reference[f"{body}.{axis}"], fast[f"{body}.{axis}"]) < 5e-3, (body, axis)


def test_half_of_a_laden_vehicle_carries_half() -> None:
    half = whole(payload={"mass": 6000.0, "ahead": 1.0}, air_spring=AIR).half()
    assert isinstance(half, HalfVehicle)
    assert half.loaded_body.mass == 16000.0 + 3000.0
    assert whole(payload="crush").half().loaded_body.mass == pytest.approx(16000.0 + 0.5 * LEVELS["crush"])
    assert half.but(payload=Payload()) == whole(air_spring=AIR).half()


@pytest.mark.parametrize(
    ("name", "fields", "said"),
    [
        ("manchester", {"payload": {"mass": -1.0}}, "payload.mass: Input should be greater than or equal to 0"),
        ("manchester", {"payload": "packed"}, "payload.level: Input should be 'tare', 'half', 'full' or 'crush'"),
        ("manchester", {"payload": {"mass": 10.0, "level": "full"}}, "give a level or a mass, not both"),
        ("manchester", {"payload": {"mass": 10.0, "ahead": 1.0}}, "half a body stands on one bogie"),
        ("manchester_whole", {"payload": {"mass": 30e3, "ahead": 30.0}}, "beyond a bogie"),
        ("manchester_whole", {"payload": {"mass": 30e3, "left": 4.0}, "air_spring": {}}, "nearer to the middle"),
        ("manchester_whole", {"air_spring": {"area_rate": -3.0}}, "fall together"),
        ("manchester_whole", {"air_spring": {"area": 0.0}}, "air_spring.area: Input should be greater than 0"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(name: str, fields: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said) as refused:
        build_vehicle({"name": name, **fields}).model()
    assert "\n" not in str(refused.value)
