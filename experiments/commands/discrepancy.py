"""`railsim discrepancy`: find what is missing in a model, name it, and add it to the model.

examples:
  railsim discrepancy recording --model default --out verdict
  railsim discrepancy recording --model whole_coach --out verdict
  railsim discrepancy recording --model default --method inference --out verdict
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.reporting.outcome import Outcome
from experiments.reporting.text import table
from railsim.errors import InputError

if TYPE_CHECKING:
    from railsim.scenario import Scenario

TIME_LIMIT = 900.0  # s


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
    parser.add_argument("--engine", default="exudyn", metavar="NAME", help="engine of the last run (default: exudyn)")
    parser.add_argument(
        "--method",
        choices=("stages", "inference"),
        help="stages: screening, then fits, for half vehicles;\n"
        "inference: one comparison of all hypotheses, for half and\nwhole vehicles (default: inference where the model "
        "is a\nwhole vehicle, else stages)",
    )
    parser.add_argument(
        "--time-limit",
        type=float,
        metavar="S",
        default=TIME_LIMIT,
        help=f"of the inference; it then says what was not tried\n(default: {TIME_LIMIT:g})",
    )


def execute(given: argparse.Namespace) -> Outcome:
    """Run the workflow, or with --plan say what a recording could show; progress goes to stderr."""
    from experiments.discrepancy.result.countdown import Countdown
    from experiments.discrepancy.result.explain import explain
    from railsim.scenario import load_scenario

    if given.plan:
        scenario = load_scenario(given.model)
        return (_plan if _method(given.method, scenario) == "stages" else _plan_inferred)(given, scenario)
    if not given.recording:
        raise InputError("give a RECORDING, or --plan to see what one could show")
    scenario = load_scenario(given.model)
    if _method(given.method, scenario) == "inference":
        return _inferred(given, scenario)
    countdown = Countdown(scenario.duration)
    verdict = explain(
        Path(given.recording),
        scenario,
        Path(given.out),
        countdown,
        track=given.track,
        only=_known(given.effects),
        engine=given.engine,
        further=given.held_out,
    )
    countdown.finish()
    return Outcome(verdict, _text(given.out, verdict))


def _method(asked: str | None, scenario: "Scenario") -> str:
    """The method that was asked for, else the one for the model's vehicle: the stages know half vehicles only."""
    from railsim.vehicles.whole_vehicle import WholeVehicle

    return asked or ("inference" if isinstance(scenario.vehicle, WholeVehicle) else "stages")


def _inferred(given: argparse.Namespace, scenario: "Scenario") -> Outcome:
    """By the inference."""
    from experiments.discrepancy.baseline.estimated_track import given_track
    from experiments.discrepancy.baseline.evidence import NO_TRACK, gather
    from experiments.discrepancy.baseline.parallel import one_thread_each
    from experiments.inference.railway.answer import answer
    from experiments.inference.railway.elsewhere import elsewhere, records
    from experiments.inference.railway.report import write
    from experiments.inference.railway.statement import FURTHER, chance, in_words
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


def _plan_inferred(given: argparse.Namespace, scenario: "Scenario") -> Outcome:
    """What a recording could show, by the inference."""
    from experiments.discrepancy.baseline.parallel import one_thread_each
    from experiments.inference.railway.plan import draw_plan, make_plan
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


def _plan(given: argparse.Namespace, scenario: "Scenario") -> Outcome:
    """What a recording could show, by the stages."""
    from experiments.discrepancy.result.countdown import Countdown
    from experiments.discrepancy.result.planning import draw_plan, make_plan
    from railsim.files import write_json

    plan = make_plan(scenario, Countdown(), _known(given.effects))
    folder = Path(given.out)
    folder.mkdir(parents=True, exist_ok=True)
    draw_plan(plan, folder / "confusability.png")
    pairs = [{"a": a, "b": b, "likeness": round(value, 3)} for a, b, value in plan.confusable()]
    result = {"detectable_size": plan.sizes, "confusable": pairs, "picture": f"{folder}/confusability.png"}
    write_json(folder / "plan.json", result)
    sizes = [
        [label, size["name"], size["value"], size["unit"], "not at any size" if size["beyond"] else ""]
        for label, size in plan.sizes.items()
    ]
    alike = [[pair["a"], pair["b"], pair["likeness"]] for pair in pairs[:12]]
    text = table(["effect", "smallest size detected", "value", "unit", ""], sizes)
    if alike:
        text += "\n\n" + table(["looks like", "", "likeness"], alike, decimals=2)
    return Outcome(result, f"{text}\n\n{folder}/plan.json, {folder}/confusability.png")


def _known(names: list[str] | None) -> list[str] | None:
    """The names, where each is an effect's."""
    from experiments.discrepancy.fit.candidates import effect_names

    known = effect_names()
    for name in names or []:
        if name not in known:
            raise InputError(f"--effects {name}: no such effect; there are: {', '.join(known)}")
    return names


def _text(folder: str, verdict: dict[str, Any]) -> str:
    from experiments.discrepancy.result.report import in_words

    gaps = {"all channels together": verdict["gap"], **verdict["channels"]}
    rows = [[name, gap["before"], gap["nuisance_only"], gap["after"]] for name, gap in gaps.items()]
    rows += [
        [f"{held_out['recording']} ({held_out['speed']:.1f} m/s), took no part", *held_out["gap"].values()]
        for held_out in verdict["held_out_recordings"]
    ]
    parts = [
        f"{verdict['status'].upper()}: {in_words(verdict)}",
        table(["gap on held-out sections", "before", "nuisances only", "after"], rows, decimals=2),
    ]
    if verdict["separated_by"]:
        separated = [[run["with"], run["nats"], "yes" if run["separates"] else "no"] for run in verdict["separated_by"]]
        parts.append(table(["would tell them apart", "nats expected", ""], separated[:8], decimals=1))
    return "\n\n".join([*parts, f"{folder}/report.html, {folder}/model.yaml, {folder}/verdict.json"])
