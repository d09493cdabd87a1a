"""Explain a recording: the whole workflow with what it writes."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from experiments.discrepancy.adding import gaps, predicted_after, write_model
from experiments.discrepancy.evidence import gather
from experiments.discrepancy.report import write_report
from experiments.discrepancy.verdict import verdict
from experiments.discrepancy.workflow import Tell, investigate
from railsim.files import write_folder_atomically, write_json
from railsim.scenario import Scenario
from railsim.track.track import Track

VERDICT = "verdict.json"


def explain(
    recording: Path,
    scenario: Scenario,
    folder: Path,
    tell: Tell,
    *,
    track: Track | None = None,
    only: Sequence[str] | None = None,
    fast: bool = False,
    engine: str = "exudyn",
) -> dict[str, Any]:
    """Find, name and add what is missing; returns the verdict, which stands in the folder with model and report.

    Parameters
    ----------
    recording : folder; only its measured part is read. scenario : nominal, its effects are taken as known.
    track : in place of the recording's own. only : effects that are considered. fast : one linearisation fewer.
    engine : of the last run, that of the gap with the effect added.

    Raises
    ------
    InputError : the recording cannot say anything; one line that says why.
    """
    evidence = gather(recording, scenario, track)
    with write_folder_atomically(folder) as aside:
        findings = investigate(evidence, tell, only, rounds=1 if fast else 2)
        best = findings.decision.best
        effects = best.hypothesis.fit.effects if best else ()
        tell(f"last run by the {engine} engine")
        after = predicted_after(findings, effects, engine)
        whole, channels = gaps(findings, after)
        found = verdict(findings, whole, channels)
        alignment = findings.problem.forward.alignment
        write_model(aside, evidence, alignment.start, alignment.scale, effects)
        write_json(aside / VERDICT, found)
        write_report(aside, recording.name, replace(findings), found, after)
    return found
