"""Explain a recording: the whole workflow with what it writes."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from experiments.discrepancy.baseline.estimated_track import given_track
from experiments.discrepancy.baseline.evidence import NO_TRACK, Evidence, GivenTrack, gather
from experiments.discrepancy.baseline.parallel import one_thread_each
from experiments.discrepancy.baseline.registration import register
from experiments.discrepancy.fit.journal import Journal, journal_of
from experiments.discrepancy.progress import Progress
from experiments.discrepancy.result.adding import gaps, predicted_after, write_model
from experiments.discrepancy.result.elsewhere import named, run_elsewhere
from experiments.discrepancy.result.report import write_report
from experiments.discrepancy.result.separating import separating
from experiments.discrepancy.result.verdict import verdict
from experiments.discrepancy.workflow import Findings, investigate
from railsim.errors import InputError
from railsim.files import write_folder_atomically, write_json
from railsim.scenario import Scenario
from railsim.simulation import load_engine

VERDICT = "verdict.json"
DIGITS = 9


@one_thread_each
def explain(
    recording: Path,
    scenario: Scenario,
    folder: Path,
    progress: Progress,
    *,
    track: str | None = None,
    only: Sequence[str] | None = None,
    engine: str = "exudyn",
    further: Sequence[str] = (),
) -> dict[str, Any]:
    """Find, name and add what is missing; returns the verdict, which stands in the folder with model and report.

    Parameters
    ----------
    recording : folder; only its measured part is read. scenario : nominal, its effects are taken as known.
    track : file, or folder of an estimate, in place of the recording's own. only : effects that are considered.
    engine : of the last run, that of the gap with the effect added. further : recordings that take no part in any fit,
    on which the gap is stated too; each with its own track.csv, or over `track`.

    Raises
    ------
    InputError : the recording cannot say anything; one line that says why. No such engine.
    """
    load_engine(engine)  # before anything is fitted
    given = given_track(track) if track else NO_TRACK
    evidence = gather(recording, scenario, given)
    others = {name: _further(one, scenario, given) for name, one in named(further).items()}
    with _going_on(evidence, sorted(only or [])) as journal, write_folder_atomically(folder) as aside:
        findings = investigate(evidence, progress, only, journal=journal)
        progress(f"last run by the {engine} engine")
        after = predicted_after(findings, engine)
        whole, channels = gaps(findings, after)
        found = verdict(findings, whole, channels)
        found["held_out_recordings"] = [run_elsewhere(n, one, findings, progress).plain() for n, one in others.items()]
        found["separated_by"] = _separated(findings, progress)
        found = rounded(found)
        registration = findings.problem.forward.registration
        write_model(
            aside, evidence, registration.start, registration.scale, (*scenario.effects, *findings.final.effects)
        )
        write_json(aside / VERDICT, found)
        write_report(aside, recording.name, findings, found, after)
    return found


@contextmanager
def _going_on(evidence: Evidence, options: Sequence[str]) -> Iterator[Journal]:
    """The case's journal; a stop leaves what is done for the same command, and says so."""
    try:
        with journal_of(evidence, options) as journal:
            yield journal
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted; what is done is kept, the same command goes on from there") from None


def rounded(value: Any) -> Any:
    """Numbers to `DIGITS` significant digits: the last ones of sums depend on where arrays lie in memory."""
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def _further(recording: str, scenario: Scenario, given: GivenTrack) -> Evidence:
    """A recording that takes no part; what is wrong with it is said before anything is fitted."""
    try:
        evidence = gather(recording, scenario, given)
        register(evidence)
    except InputError as error:
        raise InputError(f"--held-out {recording}: {error}") from None
    return evidence


def _separated(findings: Findings, progress: Progress) -> list[dict[str, Any]]:
    """What would tell the classes of an ambiguous verdict apart; empty for others."""
    return [one.plain() for one in separating(findings, progress)] if findings.decision.status == "ambiguous" else []
