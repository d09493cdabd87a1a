"""Explain a recording: the whole workflow with what it writes."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.discrepancy.adding import gaps, predicted_after, write_model
from experiments.discrepancy.evidence import Evidence, gather
from experiments.discrepancy.hypothesis import Tell
from experiments.discrepancy.journal import journal_of
from experiments.discrepancy.report import write_report
from experiments.discrepancy.verdict import verdict
from experiments.discrepancy.workflow import Findings, investigate
from railsim.files import write_folder_atomically, write_json
from railsim.scenario import Scenario
from railsim.track.track import Track

VERDICT = "verdict.json"


def answer(evidence: Evidence, withheld: Sequence[str] = ()) -> tuple[dict[str, Any], Findings]:
    """The verdict, by the compiled engine, and what it rests on; `withheld`: classes of effects to do without."""
    findings = investigate(evidence, lambda text: None, withheld=withheld)
    whole, channels = gaps(findings, predicted_after(findings, "compiled"))
    return verdict(findings, whole, channels), findings


def explain(
    recording: Path,
    scenario: Scenario,
    folder: Path,
    tell: Tell,
    *,
    track: Track | None = None,
    only: Sequence[str] | None = None,
    engine: str = "exudyn",
) -> dict[str, Any]:
    """Find, name and add what is missing; returns the verdict, which stands in the folder with model and report.

    Parameters
    ----------
    recording : folder; only its measured part is read. scenario : nominal, its effects are taken as known.
    track : in place of the recording's own. only : effects that are considered.
    engine : of the last run, that of the gap with the effect added.

    Raises
    ------
    InputError : the recording cannot say anything; one line that says why.
    """
    evidence = gather(recording, scenario, track)
    with write_folder_atomically(folder) as aside:
        findings = _found(evidence, tell, only)
        tell(f"last run by the {engine} engine")
        after = predicted_after(findings, engine)
        whole, channels = gaps(findings, after)
        found = verdict(findings, whole, channels)
        alignment = findings.problem.forward.alignment
        write_model(aside, evidence, alignment.start, alignment.scale, (*scenario.effects, *findings.final.effects))
        write_json(aside / VERDICT, found)
        write_report(aside, recording.name, findings, found, after)
    return found


def _found(evidence: Evidence, tell: Tell, only: Sequence[str] | None) -> Findings:
    """What the workflow finds out; a stop leaves what is done for the same command."""
    try:
        with journal_of(evidence, sorted(only or [])) as journal:
            return investigate(evidence, tell, only, journal=journal)
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted; what is done is kept, the same command goes on from there") from None
