"""The half car: frames, covariances against perturbed simulations, model against truth, verdicts, benchmark."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.core.counting import judged, page, read_rows, score
from experiments.discrepancy.core.counting_picture import picture
from experiments.discrepancy.core.fitting import finish, fit
from experiments.discrepancy.core.frames import Frames
from experiments.discrepancy.core.held_out import held_out, untouched
from experiments.discrepancy.core.levels import middles
from experiments.discrepancy.core.model import Hypothesis
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.search import healthy_fit, infer
from experiments.discrepancy.core.verdict import Action
from experiments.discrepancy.systems import half_car_truth as truth
from experiments.discrepancy.systems.half_car import (
    CHANNELS,
    COUNT,
    FORCES,
    INDEX,
    RELAXATION,
    SHEET,
    HalfCar,
    Record,
    Surveyed,
    patch,
    physical,
)
from experiments.discrepancy.systems.half_car_benchmark import NAME, answered, case_of, run_benchmark
from experiments.discrepancy.systems.half_car_library import LIBRARY
from railsim.errors import InputError

NOMINAL = np.zeros(COUNT)
EFFECTS = {effect.name: effect for effect in LIBRARY.effects}
BANDS = (3.0, 6.0, 12.0, 20.0, 30.0)  # Hz


def home(seed: int = 1) -> HalfCar:
    """A healthy car at home."""
    return HalfCar(truth.make(np.random.default_rng(seed)).record)


def bands(system: HalfCar, values: np.ndarray) -> np.ndarray:
    """(bands, channels) sums of mean squares."""
    f = system.frames.frequencies
    return np.array([values[(f >= low) & (f < high)].sum(axis=0) for low, high in pairwise(BANDS)])


def power(system: HalfCar, changed: HalfCar, x: np.ndarray) -> np.ndarray:
    """(F, channels) mean squares of the difference that a change makes."""
    return np.mean(np.abs(changed.predict(x[None], ())[0] - system.predict(NOMINAL[None], ())[0])[0] ** 2, axis=1)


def test_the_frame_is_tight():
    """Squares of all bins, the first and the last by half, are those of the record, and the record comes back."""
    frames = Frames(2000, 100.0, low=0.0, high=50.0)
    seen = np.random.default_rng(1).standard_normal((3, 2000))
    seen[:, :100] = seen[:, -100:] = 0.0
    values = frames.analyse(seen)
    half = np.ones(len(values))
    half[[0, -1]] = 0.5
    assert np.einsum("f,ftc->c", half, np.abs(values) ** 2) == pytest.approx((seen**2).sum(axis=1), rel=1e-9)
    half[[0, -1]] = 1.0
    assert frames.synthesise(values) == pytest.approx(seen, abs=1e-9)


def test_white_noise_has_its_variance_in_every_value():
    frames = Frames(200_000, 200.0)
    values = frames.analyse(np.random.default_rng(2).standard_normal((1, 200_000)))
    assert float((np.abs(values) ** 2).mean()) == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize("end", ["front", "rear"])
def test_a_relaxing_spring_is_a_spring_where_it_holds_and_a_damper_where_it_gives(end: str):
    """Closed forms of Maxwell's element: force k u, u' = e - r u. For r to 0 it is k d, for large r it is k / r e."""
    system, stiffness = home(), 3000.0
    for rate, name, force in ((1e-3, f"log {end} spring", 4), (800.0, f"log {end} damper", 6)):
        relaxing, plain = NOMINAL.copy(), NOMINAL.copy()
        relaxing[INDEX[f"{end} relaxing spring"]] = stiffness
        relaxing[INDEX[f"log {end} relaxation"]] = np.log(rate / RELAXATION)
        whole = physical(NOMINAL[None], ())[0][force + (end == "rear")]
        plain[INDEX[name]] = np.log1p(stiffness / max(rate, 1.0) / whole)
        changes = [power(system, system, x) for x in (relaxing, plain)]
        assert bands(system, changes[0]) == pytest.approx(bands(system, changes[1]), rel=0.1)


def test_a_relaxing_spring_passes_latent_forces_as_the_run_does():
    """Of a suspension with a relaxing spring: the linear answer to a stiffer spring against two runs."""
    system, x = home(), NOMINAL.copy()
    x[INDEX["front relaxing spring"]] = 15e3
    stiff = x.copy()
    stiff[INDEX["log front spring"]] = 0.01
    added = physical(stiff[None], ())[0][4] - physical(x[None], ())[0][4]
    travel = system.run(x[None], ())[0, 4]
    acts = np.mean(np.abs(system.frames.analyse(added * travel[None])[..., 0]) ** 2, axis=1)
    predicted = acts[:, None] * np.abs(system.transfers(x, ()).forces[:, :, 0]) ** 2
    apart = system.predict(np.stack([x, stiff]), ())[0]
    ratio = bands(system, np.mean(np.abs(apart[1] - apart[0]) ** 2, axis=1)) / bands(system, predicted)
    assert ratio[:, :4] == pytest.approx(1.0, abs=0.1)


def test_latent_forces_of_springs_and_dampers_are_as_loud_as_these():
    """Against the forces of a run over which the laws are straight: spring k d, damper c e."""
    system = home()
    out, p = system.run(NOMINAL[None], ())[0], physical(NOMINAL[None], ())[0]
    forces = np.stack([p[4] * out[4], p[5] * out[11], p[6] * out[9], p[7] * out[10]])
    true = np.mean(np.abs(system.frames.analyse(forces)) ** 2, axis=1)
    assert bands(system, system.transfers(NOMINAL, ()).parts) == pytest.approx(bands(system, true), rel=0.1)


def test_drawn_errors_are_as_the_covariances_say():
    """Of a car at home, in bands; where the road passes by straight laws, its part is that of the linear answer."""
    system = home().about(NOMINAL, (), None)
    psi = middles(system.levels)
    stated = np.tensordot(np.exp(2.0 * psi), system.covariances(NOMINAL, ())[0], 1)
    (drawn,) = system.errors(NOMINAL, (), psi, 12, np.random.default_rng(4))
    ratio = bands(system, np.mean(np.abs(drawn) ** 2, axis=(0, 2))) / bands(
        system, np.real(np.einsum("fcc->fc", stated))
    )
    assert ratio == pytest.approx(1.0, abs=0.2)


def test_survey_errors_pass_as_perturbed_roads_do():
    system, rng = home(), np.random.default_rng(3)
    level = system.record.survey
    assert level is not None
    found = []
    for _ in range(12):
        moved = system.record.road + level * rng.standard_normal(len(system.record.road))
        found.append(power(system, HalfCar(replace(system.record, road=moved)), NOMINAL))
    stated = np.real(np.einsum("fcc->fc", system.covariances(NOMINAL, ())[0][5]))
    ratio = bands(system, np.mean(found, axis=0)) / bands(system, stated)
    assert ratio == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(("place", "name", "output"), [(0, "log front spring", 4), (1, "log rear spring", 11)])
def test_latent_forces_in_suspensions_pass_as_changed_springs_do(place: int, name: str, output: int):
    system, x = home(), NOMINAL.copy()
    x[INDEX[name]] = 0.01
    stiffer = physical(x[None], ())[0][4 + place] - physical(NOMINAL[None], ())[0][4 + place]
    travel = system.run(NOMINAL[None], ())[0, output]
    acts = np.mean(np.abs(system.frames.analyse(stiffer * travel[None])[..., 0]) ** 2, axis=1)
    predicted = acts[:, None] * np.abs(system.transfers(NOMINAL, ()).forces[:, :, place]) ** 2
    ratio = bands(system, power(system, system, x)) / bands(system, predicted)
    assert ratio[:, :4] == pytest.approx(1.0, abs=0.08)
    # front travel is so small above the bounce that leakage of the windows shows in the outer bands, and behind
    # a force at the rear in all of them
    assert place == 1 or ratio[1:3, 4] == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize("place", ["front axle", "rear axle"])
@pytest.mark.parametrize("frequency", [5.0, 11.0, 25.0])
def test_latent_forces_on_axles_pass_as_tones_do(place: str, frequency: float):
    system, effect = home(), EFFECTS[f"tone at {place}"]
    x = np.concatenate([NOMINAL, [np.log(frequency), 0.0, 20.0]])
    change = system.run(x[None], (effect,))[0, :5] - system.run(NOMINAL[None], ())[0, :5]
    along = system.transfers(NOMINAL, ()).forces[int(2 * frequency) - system.frames.kept[0], :, FORCES.index(place)]
    assert np.std(change[:, 400:], axis=1) * np.sqrt(2.0) / 20.0 == pytest.approx(np.abs(along), rel=0.05)


def test_a_force_on_the_body_is_what_suspensions_and_axles_make_of_it():
    forces = home().transfers(NOMINAL, ()).forces
    sides = np.stack(
        [forces[..., 2] - forces[..., 0], forces[..., 3] - forces[..., 1]]
    )  # bounce - a pitch, bounce + b pitch
    pitch = (sides[1] - sides[0]) / 2.6
    assert sides[0] + 1.2 * pitch + 0.3 * pitch == pytest.approx(forces[..., 4], rel=1e-9)


def test_the_mean_road_is_nearer_to_the_true_one_than_its_survey():
    """By what a Wiener filter leaves: the error's power times the share of the road in the survey's."""
    rng, error = np.random.default_rng(8), 2e-3
    true = truth.rough_road(rng, 9000, 1.0)
    known = Surveyed(true + error * rng.standard_normal(9000), error)
    left = error * np.sqrt(known.share(known.waves).mean())
    assert np.std(known.mean - true) == pytest.approx(left, rel=0.05)
    assert left < 0.6 * error
    sides = np.array(known.sides(3))
    assert sides.mean(axis=0) == pytest.approx(known.mean, abs=1e-12)
    assert np.std(sides - known.mean) == pytest.approx(left, rel=0.02)


def test_what_is_known_about_a_state_is_the_mean_over_finer_runs():
    """Against runs in steps a quarter as long over roads drawn from what the survey leaves open."""
    case = truth.make(np.random.default_rng(9), "effect", "survey loud", "friction")
    system, x, rng = HalfCar(case.record), NOMINAL.copy(), np.random.default_rng(10)
    x[INDEX["front friction"]] = 60.0
    here = system.about(x, (), np.log(np.full(len(system.levels), 3.0)))
    drawn = []
    for _ in range(20):
        spread = here.known.error * np.sqrt(here.known.share(here.known.waves))
        error = np.fft.irfft(np.fft.rfft(rng.standard_normal(len(case.record.road))) * spread, len(case.record.road))
        drawn += [here.run(x[None], (), 4, patch(here.known.mean + e))[0, :5] for e in (error, -error)]
    mean = here.frames.analyse(np.mean(drawn, axis=0))
    apart = [np.mean(np.abs(one - mean) ** 2) for one in (here.predict(x[None], ())[0][0], _plain(here, x))]
    assert apart[0] < 0.5 * apart[1]


def _plain(here: HalfCar, x: np.ndarray) -> np.ndarray:
    return here.frames.analyse(here.run(x[None], ())[0, :5])


def test_noise_and_readings_are_relative_to_sheet_and_channel():
    system = home()
    parts = system.covariances(NOMINAL, ())[0]
    x = NOMINAL.copy()
    x[INDEX[f"gain {CHANNELS[2]}"]] = np.log(1.01)
    reading = [level.name for level in system.levels].index(f"reading {CHANNELS[2]}")
    assert np.real(parts[reading, :, 2, 2]) == pytest.approx(1e4 * power(system, system, x)[:, 2], rel=1e-6)
    assert np.real(parts[1, :, 1, 1]) == pytest.approx(SHEET[1] ** 2)


def test_the_model_is_the_truth_where_the_build_is_exact():
    """Two integrators and two sets of equations differ by less than a quarter of the sensors' noise."""
    rng = np.random.default_rng(5)
    car: Any = truth.healthy_car(rng, "home")
    road = truth.rough_road(rng, 9200, 1.0)
    x, p = NOMINAL.copy(), physical(NOMINAL[None], ())[0]
    car.c[:9], car.c[22], car.gain[:], car.delay[:] = [*p[:4], *p[8:13]], 0.0, 1.0, 0.0
    car.q[:] = [[p[4 + i], p[6 + i], 0.1, 0.2, 20.0, 0.006, 40e3, 0.0, 0.0] for i in range(2)]
    car.rng = type("Still", (), {"standard_normal": lambda self, *size: np.zeros(*size) if size else 0.0})()
    ride = truth.ride(car, patch(road), 20.0, 200.0, 90.0)
    for end in ("front", "rear"):
        x[INDEX[f"{end} one-sidedness"]], x[INDEX[f"{end} square part"]], x[INDEX[f"{end} friction"]] = 0.1, 0.2, 20.0
    x = np.concatenate([x, np.log([0.006, 40e3, 0.006, 40e3])])
    effects = (EFFECTS["front stop"], EFFECTS["rear stop"])
    apart = ride - HalfCar(Record(ride, 200.0, 20.0, road, 90.0, 2e-4)).run(x[None], effects)[0, :5]
    assert (apart[:, 200:].std(axis=1) < 0.25 * SHEET).all()
    assert (ride.std(axis=1) > 20.0 * SHEET).all()


@pytest.mark.parametrize("name", [effect.name for effect in LIBRARY.effects if effect.family in ("tone", "dip")])
def test_tones_and_dips_are_looked_for_where_they_are(name: str):
    """Of a record that is the model's own, the first start lies at the effect."""
    system, effect = home(), EFFECTS[name]
    own = [np.log(9.3), 12.0, -16.0] if effect.family == "tone" else [6.4, 4e-3, np.log(0.6)]
    own[1] *= -1.0 if name == "bump" else 1.0
    x = np.concatenate([NOMINAL, own])
    noise = SHEET[:, None] * np.random.default_rng(6).standard_normal(system.record.seen.shape)
    seen = HalfCar(replace(system.record, seen=system.run(x[None], (effect,))[0, :5] + noise))
    base: Any = _left(seen)
    assert effect.seek is not None
    start = effect.seek(seen, base)[0]
    assert start[0] == pytest.approx(own[0], abs=0.001 if effect.family == "tone" else 0.02)
    if effect.family == "tone":
        turned = complex(start[1], start[2]) / complex(own[1], own[2])
        # a latent force on the body pitches it a little, a tone does not
        assert abs(turned) == pytest.approx(1.0, abs=0.3 if "body" in name else 0.1) and abs(np.angle(turned)) < 0.5
    else:
        assert start[1] == pytest.approx(own[1], rel=0.2) and start[2] == pytest.approx(own[2], abs=0.2)


def test_a_third_body_is_looked_for_at_its_frequency():
    system, effect = home(), EFFECTS["third body"]
    x = np.concatenate([NOMINAL, np.log([40.0, 7.3, 0.05])])
    noise = SHEET[:, None] * np.random.default_rng(6).standard_normal(system.record.seen.shape)
    seen = HalfCar(replace(system.record, seen=system.run(x[None], (effect,))[0, :5] + noise))
    assert effect.seek is not None
    assert np.exp(effect.seek(seen, _left(seen))[0][1]) == pytest.approx(7.3, rel=0.12)


def _left(system: HalfCar) -> Any:
    """What the exact build leaves, with healthy levels."""
    problem = Problem(system, Hypothesis(), Policy())
    return finish(problem, NOMINAL, middles(system.levels), problem.groups(NOMINAL, system.covariances(NOMINAL, ())))


def test_a_healthy_record_misses_nothing_and_is_not_asked_twice(tmp_path: Path):
    kind, case = case_of(7, 0)
    assert (kind, case.setting) == ("null", "home")
    said: list[str] = []
    for _ in range(2):
        run_benchmark(tmp_path, 7, range(1), said.append)
    assert said == ["0 null home : none"]
    (row,) = read_rows(tmp_path, NAME, 7)
    assert row["judged"] == "right" and "nulls right: home" in page("half car", [row], score([row], truth.SETTINGS))
    left, right = picture([row]).axes
    assert [one.get_text().split("\n")[1] for one in left.get_xticklabels()] == ["1 cases"]
    assert [one.get_text() for one in right.get_yticklabels()] == ["home\n1 of 1"]


def test_a_weak_damper_is_named_with_its_size():
    case = truth.make(np.random.default_rng(11), "effect", "home", "weak damper")
    verdict = infer(HalfCar(case.record), LIBRARY)
    row = answered("effect", case, verdict, np.random.default_rng(12))
    assert row["judged"] == "right" and row["table"][0][0] == case.effects[0]
    assert row["covered"] and max(abs(error) for error in row["covered"].values()) < 4.0


def test_what_is_missing_shows_in_sections_that_were_not_seen():
    case = truth.make(np.random.default_rng(11), "effect", "home", "tone")
    system, policy = HalfCar(case.record), Policy()
    none = healthy_fit(system, policy)
    effect = EFFECTS[case.effects[0]].sought(none)
    found = fit(Problem(system, Hypothesis((effect,)), policy), effect.begins(none.x, system.coordinates)[0])
    assert found is not None
    named, nuisances = held_out(found, system, policy), held_out(none, system, policy)
    assert named is not None and nuisances is not None
    assert named.power == pytest.approx(1.0, abs=0.15)
    assert named.gap < 1.18 and named.gap < 0.83 * nuisances.gap < untouched(system, NOMINAL, policy).gap


@pytest.mark.parametrize(
    ("kind", "action", "said"),
    [
        ("effect", Action("none"), "missed"),
        ("effect", Action("name", ("dip",)), "right"),
        ("effect", Action("name", ("tone",)), "wrong"),
        ("effect", Action("set", ("dip", "tone")), "in a set"),
        ("effect", Action("unknown", (), "body"), "refused"),
        ("effect", Action("pair", ("dip", "tone")), "half"),
        ("null", Action("none"), "right"),
        ("null", Action("unknown", (), "body"), "wrong"),
        ("foreign", Action("unknown", (), "body"), "refused elsewhere"),
        ("foreign", Action("unknown", (), "front suspension"), "right"),
        ("foreign", Action("name", ("dip",)), "wrong"),
        ("pair", Action("pair", ("dip", "gain")), "right"),
        ("pair", Action("name", ("gain",)), "half"),
    ],
)
def test_statements_are_judged(kind: str, action: Action, said: str):
    families = {"effect": ("dip",), "pair": ("dip", "gain")}.get(kind, ())
    assert judged(kind, families, "front suspension" if kind == "foreign" else None, action) == said


def test_records_that_levels_were_learned_from_are_refused(tmp_path: Path):
    with pytest.raises(InputError, match="the healthy levels were learned"):
        run_benchmark(tmp_path, 55, range(1), print)
