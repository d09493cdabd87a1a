"""Files of an answer: verdict.json, pictures, report.html, and the model with what was found."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from experiments.discrepancy.railway import pictures
from experiments.discrepancy.railway.answer import Answer
from experiments.discrepancy.railway.build import recorded_speed
from experiments.discrepancy.railway.elsewhere import Elsewhere
from experiments.discrepancy.railway.statement import FURTHER, STATUS, chance, in_words, statement
from experiments.reporting import html
from railsim.files import write_json
from railsim.track.files import write_track

DPI = 110
REPORT, VERDICT, MODEL, TRACK = "report.html", "verdict.json", "model.yaml", "track.csv"
ROWS = 20  # of the table of hypotheses


def write(answer: Answer, folder: Path, others: Sequence[Elsewhere] = ()) -> dict[str, Any]:
    """Write all files into a folder; gives what verdict.json holds. others : recordings that took no part."""
    told = statement(answer) | {"held_out_recordings": [one.plain() for one in others]}
    figures = {"where": pictures.where(answer), "evidence": pictures.evidence(answer)}
    if told["unknown"] and answer.unknown:
        figures["unknown"] = pictures.unknown(answer.unknown)
    images = {name: html.png(figure, DPI) for name, figure in figures.items()}
    for name, data in images.items():
        (folder / f"{name}.png").write_bytes(data)
    page = html.page("What is missing in the model", _parts(answer, told, images))
    (folder / REPORT).write_text(page, encoding="utf-8")
    model = _model(answer, told)
    told["model"] = MODEL if model else None
    if model:
        (folder / MODEL).write_text(answer.system.record.scenario.to_yaml(**model), encoding="utf-8")
        write_track(answer.track, folder / TRACK)
    write_json(folder / VERDICT, told)
    return told


def _parts(answer: Answer, told: dict[str, Any], images: dict[str, bytes]) -> list[str]:
    parts = [
        f"<h1>{escape(told['statement'].replace('_', ' '))}</h1>",
        f'<p class="plain">{escape(in_words(answer))}</p>',
    ]
    parts += ["<h2>Where each model lies off the recording</h2>", html.image("where", images["where"]), _held(told)]
    parts += ["<h2>What was compared</h2>", html.image("evidence", images["evidence"]), _hypotheses(told)]
    if "unknown" in images:
        parts += ["<h2>What the unknown is like</h2>", html.image("unknown", images["unknown"])]
    if told["parameters"]:
        parts += ["<h2>Sizes, with 90 % intervals</h2>", _sizes(told["parameters"])]
    if told["further"]:
        parts += ["<h2>What to record next</h2>", _further(told)]
    parts += ["<h2>Expected loss of each statement</h2>", _losses(told)]
    for title, key in (("Not tried", "not_tried"), ("Effects that are not in the library here", "not_shown"),
                       ("Channels that were not used", "left_out"), ("Steps of the search", "steps")):  # fmt: skip
        if told[key]:
            items = "".join(f"<li>{escape(one)}</li>" for one in told[key])
            parts.append(f"<h2>{title}</h2><details><summary>{len(told[key])}</summary><ul>{items}</ul></details>")
    return parts


def _held(told: dict[str, Any]) -> str:
    names = {"before": "nominal model", "nuisance_only": "tolerances used", "after": "as stated"}
    held = [(names[key], one) for key, one in told["held_out"].items() if one]
    rows = [[name, f"{one['gap']:.2f}", f"{one['power']:.2f}"] for name, one in held]
    titles = [
        "the last two of every six sections, held out",
        "gap over stated noise",
        "power over fitted levels (1 is right)",
    ]
    return html.table(titles, rows, [False, True, True]) + _elsewhere(told["held_out_recordings"])


def _elsewhere(others: list[dict[str, Any]]) -> str:
    rows = [[escape(one["recording"]), f"{one['speed']:.1f}", *map(_gap, one["gap"].values())] for one in others]
    titles = ["recording in which nothing was looked for", "speed [m/s]", "gap, nominal", "tolerances", "as stated"]
    return html.table(titles, rows, [False, *[True] * 4]) if others else ""


def _gap(value: float | None) -> str:
    return "no fit" if value is None else f"{value:.2f}"


def _hypotheses(told: dict[str, Any]) -> str:
    rows = [
        [
            escape(one["hypothesis"]), f"{one['evidence']:.1f}", f"{one['log_prior']:.1f}", chance(one["probability"]),
            escape(", ".join(f"{name} {value:+.1f}" for name, value in one["strained"].items())),
            escape(", ".join(f"{name} {value:.3g}" for name, value in one["loud"].items())),
        ]
        for one in told["hypotheses"][:ROWS]
    ]  # fmt: skip
    titles = ["hypothesis", "evidence [nats]", "log prior", "probability", "tolerances beyond 2 deviations",
              "latent levels beyond twice the healthy ones"]  # fmt: skip
    return html.table(titles, rows, [False, True, True, True, False, False])


def _sizes(found: dict[str, dict[str, Any]]) -> str:
    rows = [
        [escape(n), f"{v['value']:.10g}", f"{v['low']:.10g}", f"{v['high']:.10g}", escape(v["unit"])]
        for n, v in found.items()
    ]
    return html.table(["", "value", "low", "high", "unit"], rows, [False, True, True, True, False])


def _further(told: dict[str, Any]) -> str:
    rows = [[escape(one["recording"]), f"{one['nats']:.1f}", f"{one['loss']:.3g}", f"{one['loss_after']:.3g}"]
            for one in told["further"]]  # fmt: skip
    return html.table(list(FURTHER), rows, [False, True, True, True])


def _losses(told: dict[str, Any]) -> str:
    rows = [[escape(name), f"{value:.3g}"] for name, value in list(told["losses"].items())[:8]]
    return html.table(["statement", "expected loss"], rows, [False, True])


def _model(answer: Answer, told: dict[str, Any]) -> dict[str, Any] | None:
    """Fields of the nominal scenario with what was found, along the recording's way over the track that is expected,
    where it improves the held-out sections; None elsewhere.
    """
    best, held, record = answer.best, told["held_out"], answer.system.record
    missing = [one for one in best.hypothesis.effects if one.kind != "small"]
    if told["status"] not in STATUS.values() or not missing or not held["after"] or not held["nuisance_only"]:
        return None
    if held["after"]["gap"] >= held["nuisance_only"]["gap"]:
        return None
    made = [
        answer.found.made(effect, [one for one, *_ in numbers]).settings()
        for effect, numbers in answer.found.known(best)
        if effect in missing
    ]
    values = dict(zip([one.name for one in answer.system.coordinates], best.x.tolist(), strict=False))
    return {
        "effects": [*record.scenario.values()["effects"], *made],
        "track": TRACK,
        "start": record.registration.start + answer.system.ahead(values),
        "speed": recorded_speed(record, values).model_dump(mode="json"),
        "duration": record.duration,
    }
