"""`railsim discrepancy`: what is missing in a model, found from a recording, named, added."""

import argparse
from pathlib import Path
from typing import Any

from experiments.commands.interface import Outcome, table
from experiments.discrepancy.fit.candidates import effect_names
from experiments.discrepancy.result.countdown import Countdown
from experiments.discrepancy.result.explain import explain
from experiments.discrepancy.result.planning import draw_plan, make_plan
from experiments.discrepancy.result.report import in_words
from railsim.errors import InputError
from railsim.files import write_json
from railsim.scenario import load_scenario


def execute(given: argparse.Namespace) -> Outcome:
    """Run the workflow, or with --plan say what a recording could show; progress goes to stderr."""
    if given.plan:
        return _plan(given)
    if not given.recording:
        raise InputError("give a RECORDING, or --plan to see what one could show")
    scenario = load_scenario(given.model)
    countdown = Countdown(scenario.duration)
    found = explain(
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
    return Outcome(found, _text(given.out, found))


def _plan(given: argparse.Namespace) -> Outcome:
    plan = make_plan(load_scenario(given.model), Countdown(), _known(given.effects))
    folder = Path(given.out)
    folder.mkdir(parents=True, exist_ok=True)
    draw_plan(plan, folder / "confusability.png")
    pairs = [{"a": a, "b": b, "likeness": round(value, 3)} for a, b, value in plan.confusable()]
    result = {"detectable_size": plan.sizes, "confusable": pairs, "picture": f"{folder}/confusability.png"}
    write_json(folder / "plan.json", result)
    sizes = [
        [label, one["name"], one["value"], one["unit"], "not at any size" if one["beyond"] else ""]
        for label, one in plan.sizes.items()
    ]
    alike = [[one["a"], one["b"], one["likeness"]] for one in pairs[:12]]
    text = table(["effect", "smallest size detected", "value", "unit", ""], sizes)
    if alike:
        text += "\n\n" + table(["looks like", "", "likeness"], alike, decimals=2)
    return Outcome(result, f"{text}\n\n{folder}/plan.json, {folder}/confusability.png")


def _known(names: list[str] | None) -> list[str] | None:
    """The names, where each is an effect's."""
    known = effect_names()
    for name in names or []:
        if name not in known:
            raise InputError(f"--effects {name}: no such effect; there are: {', '.join(known)}")
    return names


def _text(folder: str, found: dict[str, Any]) -> str:
    rows = [
        [name, one["before"], one["nuisance_only"], one["after"]]
        for name, one in {"all channels together": found["gap"], **found["channels"]}.items()
    ]
    rows += [
        [f"{one['recording']} ({one['speed']:.1f} m/s), took no part", *one["gap"].values()]
        for one in found["held_out_recordings"]
    ]
    parts = [
        f"{found['status'].upper()}: {in_words(found)}",
        table(["gap on held-out sections", "before", "nuisances only", "after"], rows, decimals=2),
    ]
    if found["separated_by"]:
        separated = [[one["with"], one["nats"], "yes" if one["separates"] else "no"] for one in found["separated_by"]]
        parts.append(table(["would tell them apart", "nats expected", ""], separated[:8], decimals=1))
    return "\n\n".join([*parts, f"{folder}/report.html, {folder}/model.yaml, {folder}/verdict.json"])
