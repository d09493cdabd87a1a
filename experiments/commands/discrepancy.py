"""`railsim discrepancy`: find what is missing in a model, name it, and add it to the model.

examples:
  railsim discrepancy recording --model default --out verdict
  railsim discrepancy recording --model whole_coach --out verdict
  railsim discrepancy --plan --model default --out plan
"""

import argparse
from typing import TYPE_CHECKING

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError

if TYPE_CHECKING:
    from railsim.scenario import Scenario

TIME_LIMIT = 1800.0  # s


def configure(parser: argparse.ArgumentParser) -> None:
    """Recording, model, folder and what to consider."""
    parser.add_argument("recording", metavar="RECORDING", nargs="?", help="folder; its truth is never read")
    parser.add_argument("--plan", action="store_true", help="without a recording: what one could show")
    parser.add_argument("--model", metavar="SCENARIO", required=True, help="nominal scenario: a name or a YAML file")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of verdict.json, model.yaml, report.html")
    parser.add_argument(
        "--track",
        metavar="FILE",
        help="measured track in place of the recording's: a CSV\nfile, or the folder of an estimate of it",
    )
    parser.add_argument(
        "--held-out",
        nargs="+",
        default=[],
        metavar="REC",
        help="recordings in which nothing is looked for; their gaps are told",
    )
    parser.add_argument("--effects", nargs="+", metavar="NAME", help="consider only these (default: the whole library)")
    parser.add_argument(
        "--time-limit",
        type=float,
        metavar="S",
        default=TIME_LIMIT,
        help=f"seconds of the search; it then says what was not tried (default: {TIME_LIMIT:g})",
    )


def execute(given: argparse.Namespace) -> Outcome:
    """Compare all hypotheses, or with --plan say what a recording could show; progress goes to stderr."""
    from railsim.scenario import load_scenario

    if given.plan:
        return _plan(given, load_scenario(given.model))
    if not given.recording:
        raise InputError("give a RECORDING, or --plan to see what one could show")
    return _verdict(given, load_scenario(given.model, elsewhere=True))


def _verdict(given: argparse.Namespace, scenario: "Scenario") -> Outcome:
    """What is missing in the model."""
    from experiments.discrepancy.railway.answer import answer
    from experiments.discrepancy.railway.elsewhere import elsewhere, records
    from experiments.discrepancy.railway.report import write
    from experiments.discrepancy.railway.runs import one_thread_each
    from experiments.discrepancy.railway.statement import FURTHER, chance, in_words
    from experiments.discrepancy.recording.estimated_track import given_track
    from experiments.discrepancy.recording.evidence import NO_TRACK, gather
    from experiments.reporting.logs import tell
    from railsim.files import write_folder_atomically

    if given.time_limit <= 0.0:
        raise InputError(f"--time-limit {given.time_limit:g}: give a positive number of seconds")
    track = given_track(given.track) if given.track else NO_TRACK
    evidence = gather(given.recording, scenario, track)
    others = records(given.held_out, scenario, track)
    with write_folder_atomically(given.out) as folder:
        found = one_thread_each(answer)(evidence, _known(given.effects), limit=given.time_limit, say=tell)
        told = write(found, folder, one_thread_each(elsewhere)(found, others, tell))
    rows = [[one["hypothesis"], one["evidence"], chance(one["probability"])] for one in told["hypotheses"][:10]]
    gaps = [[name, *one.values()] for name, one in told["channels"].items()]
    gaps += [[f"{one['recording']}, took no part", *one["gap"].values()] for one in told["held_out_recordings"]]
    more = [list(one.values()) for one in told["further"]]
    parts = [
        f"{told['status'].upper()}: {in_words(found)}",
        table(["hypothesis", "evidence [nats]", "probability"], rows, decimals=3),
        table(["gap of the channels", "nominal", "tolerances used", "as stated"], gaps, decimals=2),
        *([table(list(FURTHER), more, decimals=2)] if more else []),
        ", ".join(f"{given.out}/{name}" for name in ("report.html", "verdict.json", told["model"]) if name),
    ]
    return Outcome(told, "\n\n".join(parts))


def _plan(given: argparse.Namespace, scenario: "Scenario") -> Outcome:
    """What a recording could show."""
    from experiments.discrepancy.railway.plan import draw_plan, make_plan
    from experiments.discrepancy.railway.runs import one_thread_each
    from experiments.reporting.logs import tell
    from railsim.files import write_folder_atomically, write_json

    plan = one_thread_each(make_plan)(scenario, _known(given.effects), tell)
    result = plan.plain()
    with write_folder_atomically(given.out) as folder:
        draw_plan(plan, folder / "confusability.png")
        write_json(folder / "plan.json", result)
    sizes = [[one["effect"], one["name"], one["value"], one["unit"]] for one in result["detectable_size"]]
    text = table(["effect", "smallest size that is named", "value", "unit"], sizes)
    if alike := [list(one.values()) for one in result["confusable"][:12]]:
        text += "\n\n" + table(["effect", "may be taken for", "nats apart"], alike, decimals=2)
    return Outcome(result, f"{text}\n\n{given.out}/plan.json, {given.out}/confusability.png")


def _known(names: list[str] | None) -> list[str] | None:
    """The names, where each is an effect's."""
    from railsim.effects.interface import EFFECTS

    known = sorted(name for name, kind in EFFECTS.classes().items() if kind.named)
    for name in names or []:
        if name not in known:
            apart = "set names apart by spaces; " if "," in name else ""
            raise InputError(f"--effects {name}: no such effect; {apart}there are: {', '.join(known)}")
    return names
