"""Add: the effect goes into a new scenario, and what the gap was before, with nuisances only, and is after."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.select.decide import rms
from experiments.discrepancy.workflow import Findings
from railsim.effects.interface import Effect
from railsim.settings import dump_yaml
from railsim.speed import Profile
from railsim.track.files import write_track

MODEL, TRACK = "model.yaml", "track.csv"


@dataclass(frozen=True)
class Gaps:
    """Root mean square of the whitened held-out residual: 1 where only the stated noise is left."""

    before: float
    nuisance_only: float
    after: float

    def plain(self) -> dict[str, float]:
        """For the verdict."""
        return {"before": self.before, "nuisance_only": self.nuisance_only, "after": self.after}


def gaps(findings: Findings, after: np.ndarray) -> tuple[Gaps, dict[str, Gaps]]:
    """Over all channels together (whitened), and of each channel over its own stated noise.

    `after`: coefficients (k, f, c) that the model with the effect predicts.
    """
    problem = findings.problem
    nominal = problem.stacked(problem.forward.predict(np.zeros(len(findings.null.fit.z))))
    null = findings.null.fit.stacked
    states = (nominal, null, after)
    whole = Gaps(*(rms(problem, problem.whitened(problem.measured - one)) for one in states))
    if problem.white is None:
        raise ValueError("state the noise first")
    marginal = [problem.white.marginal(problem.measured - one)[problem.test] for one in states]
    channels = {
        name: Gaps(*(float(np.sqrt(np.nanmean(one[..., place]))) for one in marginal))
        for place, name in enumerate(problem.evidence.channels)
        if np.isfinite(marginal[0][..., place]).any()
    }
    return whole, channels


def predicted_after(findings: Findings, engine: str) -> np.ndarray:
    """Coefficients of the model that is handed over (of nuisances alone where nothing is added), by an engine."""
    problem: Problem = findings.problem
    final = findings.final
    return problem.stacked(problem.forward.but(engine=engine).predict(final.z, final.effects))


def write_model(folder: Path, evidence: Evidence, start: float, scale: float, effects: Sequence[Effect]) -> Path:
    """The nominal scenario over the expected track at the measured speed, with the effects, as a scenario file."""
    write_track(evidence.surveyed.expected, folder / TRACK)
    time, speed, _ = evidence.speed
    profile = Profile(kind="profile", time=tuple(time.tolist()), speed=tuple((scale * speed).round(4).tolist()))
    reach = float(evidence.track.s[-1]) - start - evidence.scenario.overhang[1]
    way = np.concatenate([[0.0], np.cumsum(0.5 * scale * (speed[1:] + speed[:-1]) * np.diff(time))])
    duration = min(evidence.duration, float(np.interp(reach, way, time)) if way[-1] > reach else evidence.duration)
    values = evidence.scenario.values() | {
        "name": f"{evidence.scenario.name}_explained",
        "track": TRACK,
        "speed": profile.model_dump(mode="json"),
        "start": round(float(start), 4),
        "duration": np.floor(10.0 * duration) / 10.0,
        "effects": [effect.settings() for effect in effects],
    }
    path = folder / MODEL
    plain = dump_yaml(_native(values))
    path.write_text("# The nominal scenario with the effect that was found added.\n" + plain, encoding="utf-8")
    return path


def _native(value: object) -> object:
    """Plain Python numbers all through."""
    if isinstance(value, dict):
        return {str(key): _native(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_native(inner) for inner in value]
    return value.item() if isinstance(value, np.generic) else value
