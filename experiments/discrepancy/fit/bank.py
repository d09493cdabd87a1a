"""Bank: derivatives and finite signatures at the nominal scenario, computed once and kept on disk by digest.

A recording of that scenario was made at nearly the same places at nearly the same times: what was computed for the
nominal run is moved to where the recording's sections are by a phase. Recordings that are not like their scenario
(another track, another speed) get a bank of their own.
"""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.forward import Forward, Prediction, Registration, forward_over
from experiments.discrepancy.baseline.frames import Frames, stack
from experiments.discrepancy.baseline.noise import PERTURBED, SEED, perturbed_tracks, propagated_track_error
from experiments.discrepancy.baseline.parallel import in_parallel
from experiments.discrepancy.baseline.surveyed import as_surveyed
from experiments.discrepancy.fit.candidates import Candidate, settings_of
from experiments.discrepancy.fit.stored import Stored, read_arrays, stored_arrays, write_arrays
from experiments.discrepancy.progress import Progress, silent
from railsim.cache import cache_folder
from railsim.errors import InputError
from railsim.scenario import digest_of
from railsim.simulation import code_digest
from railsim.track.track import Track

APART = 0.25  # s that a section may be off its nominal time to be moved by a phase
SPEED_APART = 0.02  # relative
TRACK_APART = 0.25  # of a quantity's own root mean square
FOLDER = "signatures"
KEPT = 30 * 86400.0  # s without use


@dataclass(frozen=True)
class Bank:
    """What the nominal run says, moved to a recording's sections.

    Attributes
    ----------
    frames : sections. delay : (k,) s by which the nominal run is later at the recording's places. columns : (n, k, f,
    c) derivatives by the nuisances. propagated : (k, f, c, c) of the track measurement's errors, None where there are
    none.
    """

    reference: Forward
    frames: Frames
    delay: np.ndarray
    folder: Path
    columns: np.ndarray
    propagated: np.ndarray | None
    _base: np.ndarray
    _kept: dict[str, np.ndarray | Stored | None] = field(default_factory=dict)

    def fill(self, jobs: Sequence[tuple[Candidate, dict[str, float]]], progress: Progress = silent) -> None:
        """Run what is not there yet, effect by effect; what was done is kept if it is stopped."""
        names = sorted({candidate.name for candidate, _ in jobs})
        truth = None
        for number, name in enumerate(names):
            mine = {settings_of(one.build(values)): (one, values) for one, values in jobs if one.name == name}
            path = self.folder / f"effect_{name}.arrays"
            known: dict[str, np.ndarray | Stored] = dict(stored_arrays(path))
            missing = [key for key in mine if key not in known]
            if missing:
                progress(f"signatures of the nominal scenario: {name} ({number + 1} of {len(names)})")
                if truth is None:
                    truth = self.reference.run(np.zeros(len(self.reference.nuisances)))[1]
                run, later = truth, cache(partial(self._later_base, truth))
                found = in_parallel(
                    lambda key, mine=mine, run=run, later=later: self._signature(*mine[key], run, later), missing
                )
                known |= {key: one if one is not None else np.zeros(0) for key, one in zip(missing, found, strict=True)}
                _write(path, known)
                known = known | stored_arrays(path)
            for key in mine:
                self._kept[key] = known[key] if known[key].size else None

    def under(self, law: str, progress: Progress = silent) -> "Bank":
        """The same with the derivatives of another creep law; signatures stay those of the scenario's own.

        Raises
        ------
        InputError : the nominal model does not run with that law.
        """
        path = self.folder / f"nominal_{law}.arrays"
        known = read_arrays(path)
        if not known:
            progress(f"derivatives of the nominal scenario under {law}, computed once")
            known = {"columns": _derivatives(self.reference.but(law=law), self.frames)[0]}
            _write(path, known)
        with suppress(OSError):
            os.utime(path)
        return replace(self, columns=self._moved(known["columns"]).astype(np.complex64))

    def signature(self, candidate: Candidate, values: dict[str, float]) -> np.ndarray | None:
        """(k, f, c) change of the coefficients by an effect of a finite size; None where the model cannot have it. Of
        what is sharp (rows, k, f, c): so many rows of truth later.
        """
        kept = self._kept[settings_of(candidate.build(values))]
        return None if kept is None else self._moved(np.asarray(kept), still=bool(candidate.phases))

    def kept(self, candidate: Candidate, values: dict[str, float]) -> np.ndarray | None:
        """The same; None too where it was not asked for in `fill`."""
        return self.signature(candidate, values) if settings_of(candidate.build(values)) in self._kept else None

    def _moved(self, coefficients: np.ndarray, still: bool = False) -> np.ndarray:
        delay = np.zeros_like(self.delay) if still else self.delay
        return coefficients * _phase(self.frames, delay)[..., None]

    def _signature(
        self, candidate: Candidate, values: dict[str, float], truth: Any, later_base: Callable[[int], np.ndarray]
    ) -> np.ndarray | None:
        forward, z = self.reference, np.zeros(len(self.reference.nuisances))
        try:
            effects = (candidate.build(values),)
            if candidate.of_sensor:
                found = [(forward.observe(forward.setup(z, effects), truth, z), self._base)]
            elif candidate.sharp:
                setup, blows = forward.run(z, effects)
                rows = range(rows_between(forward))
                found = [(forward.observe(setup, blows.later(late), z), later_base(late)) for late in rows]
            else:
                found = [(forward.predict(z, effects), self._base)]
        except InputError:
            return None
        change = np.stack([_stacked(forward, self.frames, prediction) - base for prediction, base in found])
        change = change if candidate.sharp else change[0]
        return change.astype(np.complex64) if np.isfinite(change).all() and change.any() else None

    def _later_base(self, truth: Any, rows: int) -> np.ndarray:
        """(k, f, c) of the nominal run, so many rows of truth later."""
        forward, z = self.reference, np.zeros(len(self.reference.nuisances))
        return _stacked(forward, self.frames, forward.observe(forward.setup(z), truth.later(rows), z))


def open_bank(evidence: Evidence, registration: Registration, frames: Frames, progress: Progress = silent) -> Bank:
    """The bank of a recording's nominal scenario, from the disk where it was computed before.

    Raises
    ------
    InputError : the nominal model does not run.
    """
    reference, delay = _reference(evidence, registration, frames)
    folder = cache_folder().parent / FOLDER / _digest(reference, frames)
    path = folder / "nominal.arrays"
    known = read_arrays(path)
    if not known:
        progress("derivatives of the nominal scenario, computed once")
        known = _nominal(reference, frames)
        _write(path, known)
    with suppress(OSError):
        os.utime(path)
    passed = known["propagated"] if known["propagated"].size else None
    bank = Bank(reference, frames, delay, folder, np.zeros(0), passed, known["base"])
    return replace(bank, columns=bank._moved(known["columns"]).astype(np.complex64))


def rows_between(forward: Forward) -> int:
    """Rows of truth between two samples of the slowest channel."""
    return max(1, round(forward.evidence.scenario.output_rate / min(forward.evidence.rates.values())))


def _reference(evidence: Evidence, registration: Registration, frames: Frames) -> tuple[Forward, np.ndarray]:
    """The run whose bank serves: the scenario's own where the recording is like it, else the recording's."""
    scenario = evidence.scenario
    time_, measured, scale = evidence.speed
    nominal = np.interp(time_, *scenario.speed.knots(evidence.duration))
    measured = registration.scale * measured
    here = registration.start + _way(time_, measured)
    there = scenario.start + _way(time_, nominal)
    late = np.interp(frames.middles, time_, (here - there) / np.maximum(nominal, 0.5))
    alike = np.abs(measured / np.maximum(nominal, 0.1) - 1.0).max() < SPEED_APART and np.abs(late).max() < APART
    if alike and _same_track(evidence.track, scenario.geometry, here[0], here[-1]):
        track = scenario.geometry
        if not _the_file(evidence, track):
            track = as_surveyed(track, evidence.track_errors, SEED)
        plain = replace(evidence, track=track, speed=(time_, nominal, scale))
        return forward_over(plain, Registration(scenario.start)), late
    return forward_over(evidence, registration), np.zeros_like(late)


def _the_file(evidence: Evidence, nominal: Track) -> bool:
    """Whether the nominal scenario runs over the very file that the recording has."""
    file = evidence.track
    return file.s.size == nominal.s.size and all(
        np.allclose(values, nominal.columns()[name], rtol=1e-6, atol=1e-9)
        for name, values in file.columns().items()
        if name in nominal.columns()
    )


def _way(time_: np.ndarray, speed: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time_))])


def _same_track(measured: Track, nominal: Track, first: float, last: float) -> bool:
    """Whether two tracks differ by no more than errors of a survey."""
    s = np.arange(first, last, 0.5)
    for name, values in nominal.columns().items():
        other = measured.columns().get(name)
        if other is None:
            continue
        want, have = np.interp(s, nominal.s, values), np.interp(s, measured.s, other)
        size = float(np.sqrt(np.mean(want**2)))
        if float(np.sqrt(np.mean((have - want) ** 2))) > TRACK_APART * size + _SMALL.get(name, 1e-4):
            return False
    return True


_SMALL = {"curvature": 1e-5, "stiffness": np.inf, "friction": 0.02, "gradient": 1e-3}


def _nominal(reference: Forward, frames: Frames) -> dict[str, np.ndarray]:
    columns, base, prediction = _derivatives(reference, frames)
    tracks = perturbed_tracks(reference.evidence, SEED, PERTURBED)
    z = np.zeros(len(reference.nuisances))
    passed = propagated_track_error(reference, frames, z, (), prediction, tracks)
    return {"base": base, "columns": columns, "propagated": np.zeros(0) if passed is None else passed}


def _derivatives(reference: Forward, frames: Frames) -> tuple[np.ndarray, np.ndarray, Prediction]:
    """(n, k, f, c) by the nuisances, (k, f, c) of the nominal run, and that run."""
    z = np.zeros(len(reference.nuisances))
    setup, truth = reference.run(z)
    prediction = reference.observe(setup, truth, z)
    base = _stacked(reference, frames, prediction)

    def column(number: int) -> np.ndarray:
        moved = z.copy()
        step = reference.nuisances[number].step(0.0)
        moved[number] = step
        if reference.nuisances[number].of_sensor:
            changed = reference.observe(setup, truth, moved)
        else:
            changed = reference.predict(moved)
        return ((_stacked(reference, frames, changed) - base) / step).astype(np.complex64)

    return np.stack(in_parallel(column, range(len(z)))), base, prediction


def _stacked(forward: Forward, frames: Frames, prediction: dict[str, np.ndarray]) -> np.ndarray:
    return stack(frames, forward.evidence.channels, prediction, forward.evidence.rates)


def _phase(frames: Frames, delay: np.ndarray) -> np.ndarray:
    """(k, f) of a signal that comes so much earlier [s]."""
    return np.exp(2j * np.pi * frames.frequencies * delay[:, None]).astype(np.complex64)


def _digest(reference: Forward, frames: Frames) -> str:
    """Of all that shapes the bank."""
    e = reference.evidence
    return digest_of(
        {
            "code": code_digest(e.scenario),
            "vehicle": e.scenario.vehicle.model_dump(mode="json"),
            "effects": [effect.settings() for effect in e.scenario.effects],
            "traction": [one.model_dump(mode="json") for one in e.scenario.traction],
            "rate": e.scenario.output_rate,
            "track": reference.track.digest(),
            "track_errors": e.track_errors.model_dump(mode="json"),
            "track_estimated": e.track_estimated,
            "speed": [np.round(one, 6).tolist() for one in e.speed[:2]] + [e.speed[2]],
            "start": [reference.registration.start, reference.registration.scale],
            "sensors": [sensor.model_dump(mode="json") for sensor in e.sensors],
            "channels": [[name, e.rates[name]] for name in e.channels],
            "frames": [len(frames.starts), frames.length, len(frames.frequencies)],
            "steps": [one.step(0.0) for one in reference.nuisances],
        }
    )


def _write(path: Path, known: Mapping[str, np.ndarray | Stored]) -> None:
    """Keep them; a disk that cannot be written only costs the time."""
    with suppress(OSError, InputError):
        path.parent.mkdir(parents=True, exist_ok=True)
        _tidy(path.parent.parent)
        write_arrays(path, known)


def _tidy(folder: Path) -> None:
    """Remove banks that were not used for long."""
    for path in folder.glob("*/*"):
        if time.time() - path.stat().st_mtime > KEPT:
            path.unlink(missing_ok=True)
