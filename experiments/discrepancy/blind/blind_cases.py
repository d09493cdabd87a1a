"""Blind cases: recordings with a hidden effect, or none, made by Exudyn in a process of their own; labels are sealed.

`python -m experiments.discrepancy.blind.blind_cases MODEL FOLDER SEED NUMBER DURATION [LAWS]` writes
FOLDER/recordings/NUMBER (no truth) and FOLDER/sealed/NUMBER.json, which only the scoring opens. LAWS: a YAML file with
settings of effects that are in nobody's library, as tables.
"""

import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discrepancy.baseline.nuisances import Nuisance, built, most_of
from experiments.discrepancy.blind.blind_plan import kind_of, name_of, nominal_of, setting_of
from experiments.discrepancy.blind.oracle import acting, effect_of
from experiments.discrepancy.fit.candidates import Candidate, Context, candidates
from railsim.digests import write_marker
from railsim.effects.interface import Effect
from railsim.errors import InputError
from railsim.files import read_json, write_folder_atomically, write_json
from railsim.scenario import Scenario, load_scenario
from railsim.scratch import scratch_folder
from railsim.settings import load_yaml
from railsim.simulation import about_recording, measure, simulate

DRAWN = {"effect": 1, "withheld": 1, "pair": 2}
FASTSIM = 0.3  # of the cases with that creep law in place of Polach's
MOST_ODD = 1.9  # standard deviations of a healthy specimen's parameters
STATED_WRONG = (0.8, 1.25)  # true over stated sensor noise
SMALLEST = 1.0  # of the smallest size worth naming, from which sizes are drawn (logarithmically, to the bound)
TRIES = 20


def make_case(model: str, folder: Path, seed: int, number: int, duration: float, laws: str = "") -> None:
    """Draw, simulate, measure and seal one case.

    Raises
    ------
    InputError : no draw could be run; the laws cannot be read.
    """
    rng = np.random.default_rng([seed, number])
    setting, kind = setting_of(seed, number), kind_of(seed, number)
    nominal = nominal_of(model, setting, duration)
    foreign = read_laws(laws) if laws else []
    kind = "withheld" if kind == "foreign" and not foreign else kind
    target = folder / "recordings" / f"{number:04d}"
    for attempt in range(TRIES):
        effects = _drawn(nominal, kind, foreign, None if attempt > TRIES // 2 else (seed, number), rng)
        scores = specimen_scores(nominal, kind == "decoy", rng)
        law = "fastsim" if rng.random() < FASTSIM else str(getattr(nominal.vehicle, "adhesion").law)  # noqa: B009
        try:
            acted = [acting(nominal.setup, effect) for effect in effects]
            scenario = build_specimen(nominal, effects, scores, law, rng)
            with write_folder_atomically(target) as aside:
                record_blind(scenario, nominal, aside)
                label = {"kind": kind, "setting": setting, "effects": [effect.settings() for effect in effects]}
                label |= {"acting": acted, "classes": [type(effect).equivalence() for effect in effects]}
                _seal(folder / "sealed" / f"{number:04d}.json", label | {"law": law, "specimen": scores})
            break
        except InputError:  # an effect that this vehicle cannot have, or a run that leaves the rails: draw again
            continue
    else:
        raise InputError(f"case {number}: no draw could be run; take another seed")


def read_laws(path: str) -> list[Effect]:
    """Effects of a YAML list of settings.

    Raises
    ------
    InputError : no such file, or what is in it is no list of effects.
    """
    try:
        found = load_yaml(Path(path).read_text(encoding="utf-8"), "it")
        return [effect_of(settings) for settings in found]
    except (OSError, UnicodeDecodeError, KeyError, TypeError, InputError) as error:
        raise InputError(f"--laws {path}: {error}; give a YAML list of effects' settings") from None


def _seal(path: Path, label: dict[str, Any]) -> None:
    """Whole, before the recording is there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    write_json(part, label)
    part.replace(path)


def _drawn(
    nominal: Scenario, kind: str, foreign: list[Effect], case: tuple[int, int] | None, rng: np.random.Generator
) -> list[Effect]:
    """The hidden effects of a case; the first is dealt by the case's number where that is given."""
    if kind == "foreign":
        return [foreign[int(rng.integers(len(foreign)))].but(scale=float(rng.uniform(0.5, 2.0)))]
    found: list[Effect] = []
    for _ in range(DRAWN.get(kind, 0)):
        found.append(drawn_effect(nominal, None if found else case, rng))
    return found


def drawn_effect(nominal: Scenario, case: tuple[int, int] | None, rng: np.random.Generator) -> Effect:
    """An effect, each as likely as any other (`case`: dealt by its number); variant, size, place, phase at random."""
    end = nominal.start + (nominal.distance or 0.0)
    names = tuple(
        name.split(" [")[0]
        for sensor in nominal.sensors
        if sensor.kind in ("accelerometer", "gyro", "displacement")
        for name in sensor.channels()
    )
    context = Context(names, (nominal.start + 20.0, end - 20.0), (2.0, nominal.duration - 3.0), ((0.0, 0.0),))
    found = candidates(context)
    names = sorted({one.name for one in found})
    name = str(rng.choice(names)) if case is None else name_of(*case, names)
    variants = [one for one in found if one.name == name]
    candidate: Candidate = variants[int(rng.integers(len(variants)))]
    return candidate.build(_drawn_values(candidate, rng))


def _drawn_values(candidate: Candidate, rng: np.random.Generator) -> dict[str, float]:
    values = {}
    for name, one in candidate.parameters.items():
        if one.absent is None:
            values[name] = float(rng.uniform(one.low, one.high)) if not np.isfinite(one.prior.std) else one.default
            continue
        near = abs((one.smallest if one.smallest is not None else one.default) - one.absent) * SMALLEST
        up = (one.smallest if one.smallest is not None else one.default) >= one.absent
        far = abs((one.high if up else one.low) - one.absent)
        size = float(np.exp(rng.uniform(np.log(max(near, 1e-12)), np.log(max(far, near, 1e-12)))))
        values[name] = one.absent + (size if up else -size)
    return values


def specimen_scores(nominal: Scenario, decoy: bool, rng: np.random.Generator) -> dict[str, float]:
    """How many standard deviations each build parameter is off, by its label."""
    odd = built(nominal.vehicle)
    strained = set(rng.choice(len(odd), 2, replace=False).tolist()) if decoy else set()
    found = {}
    for place, nuisance in enumerate(odd):
        z = float(np.clip(rng.standard_normal(), -MOST_ODD, MOST_ODD))
        found[nuisance.label] = float(rng.choice([-1.0, 1.0]) * rng.uniform(2.0, 3.0)) if place in strained else z
    return found


def build_specimen(
    nominal: Scenario,
    effects: list[Effect],
    scores: dict[str, float],
    law: str,
    rng: np.random.Generator,
    substeps: int | None = 2,
) -> Scenario:
    """A vehicle as built, with its creep law, its sensors' real noise, its own start."""
    changes: dict[str, Any] = {"effects": [effect.settings() for effect in effects]}
    for nuisance in built(nominal.vehicle):
        changes[_key(nuisance)] = _moved(nominal, nuisance, scores[nuisance.label])
    changes["vehicle.adhesion.law"] = law
    for place, sensor in enumerate(nominal.sensors):
        density = sensor.errors.noise_density
        if density > 0.0:
            errors = sensor.errors.model_dump() | {"noise_density": density * float(rng.uniform(*STATED_WRONG))}
            changes[f"sensors.{place}.errors"] = errors
    changes["start"] = nominal.start + float(rng.uniform(0.0, 1.0))
    changes["seed"] = int(rng.integers(2**31))
    changes["duration"] = nominal.duration
    changes["substeps"] = substeps
    source = nominal.to_yaml()
    with scratch_folder() as aside:
        path = Path(aside) / f"{nominal.name}.yaml"
        path.write_text(source, encoding="utf-8")
        return load_scenario(path, changes)


def _key(nuisance: Nuisance) -> str:
    return f"vehicle.{'' if nuisance.kind == 'vehicle' else nuisance.kind + '.'}{nuisance.name}"


def _moved(nominal: Scenario, nuisance: Nuisance, z: float) -> float:
    owner = nominal.vehicle if nuisance.kind == "vehicle" else getattr(nominal.vehicle, nuisance.kind)
    value = float(getattr(owner, nuisance.name) * np.exp(nuisance.std * z))
    return min(value, most_of(owner, nuisance.name))


def record_blind(scenario: Scenario, nominal: Scenario, target: Path) -> None:
    """Exudyn, sensors, and then only what the field would have: the nominal vehicle and the stated data sheets."""
    with scratch_folder() as aside:
        truth = simulate(scenario, folder=Path(aside) / "truth")
        measured = Path(aside) / "measured"
        measure(truth, scenario, folder=measured)
        shutil.rmtree(measured / "truth")
        shutil.copytree(measured, target, dirs_exist_ok=True)
    about = read_json(target / "about.json", "a recording")
    write_json(target / "about.json", about | about_recording(nominal))
    write_marker(target)


if __name__ == "__main__":
    make_case(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), float(sys.argv[5]), *sys.argv[6:7])
