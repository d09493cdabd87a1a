"""Report: one page with its pictures inside, and a paragraph in plain words."""

from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments.discrepancy.result import pictures
from experiments.discrepancy.select.decide import ENOUGH
from experiments.discrepancy.workflow import Findings
from experiments.reporting import html

DPI = 110
REPORT = "report.html"


def write_report(folder: Path, name: str, findings: Findings, verdict: dict[str, Any], after: np.ndarray) -> Path:
    """Write report.html and its pictures as PNG files beside it; `after`: coefficients (k, f, c) with the effect."""
    figures = _figures(findings, after)
    parts = [f"<h1>{escape(name)}: {escape(verdict['status'])}</h1>"]
    parts.append(f'<p class="plain">{escape(in_words(verdict))}</p>')
    parts += [_gap_table(verdict), _elsewhere(verdict), _separated(verdict)]
    for key, (title, figure) in figures.items():
        parts.append(f"<h2>{escape(title)}</h2>{_picture(folder, key, figure)}")
    parts.append(_hypotheses(verdict))
    parts.append(_nuisances(verdict))
    (folder / REPORT).write_text(html.page(name, parts), encoding="utf-8")
    return folder / REPORT


def in_words(verdict: dict[str, Any]) -> str:
    """What a person would say."""
    return _finding(verdict) + _elsewhere_in_words(verdict) + _missing(verdict)


def _finding(verdict: dict[str, Any]) -> str:
    gap = verdict["gap"]
    numbers = (
        f"On sections that no fit has seen, the model as it stood was off by {gap['before']:.2f} times the stated "
        f"noise, by {gap['nuisance_only']:.2f} with tolerances of vehicle and sensors used up"
    )
    if verdict["status"] == "none":
        return f"Nothing is missing in the model: {verdict['reason']}. {numbers}; 1 is noise alone."
    if verdict["status"] == "unknown":
        where = f" It looks most like a {verdict['place']}." if verdict["place"] else ""
        table = f", and by {gap['after']:.2f} with a tabulated force there" if verdict["empirical"] else ""
        return f"Something is missing that has no name here: {verdict['reason']}.{where} {numbers}{table}."
    sizes = "; ".join(
        f"{name} {p['value']:.3g} {p['unit'] if p['unit'] != '-' else ''}".strip()
        + f" (between {p['low']:.3g} and {p['high']:.3g})"
        for name, p in verdict["parameters"].items()
    )
    effect = str(verdict["effect"]).replace("_", " ")
    found = f"The model lacks one thing: {effect} ({sizes}). {numbers}, and by {gap['after']:.2f} with it added."
    further = " and ".join(one["effect"].replace("_", " ") for one in verdict["further"])
    found += f" With it goes a further effect: {further}." if further else ""
    others = ", ".join(name.replace("_", " ") for name in verdict["alternatives"])
    if verdict["status"] == "ambiguous":
        return f"{found} But {others} would explain the recording nearly as well.{_advice(verdict)}"
    return found + (f" Nearly as good: {others}." if others else "")


def _elsewhere_in_words(verdict: dict[str, Any]) -> str:
    """The gap on recordings that took no part."""
    said = ""
    for one in verdict.get("held_out_recordings", []):
        there = one["gap"]
        said += f" In '{one['recording']}', which took no part, it is {there['before']:.2f} before, "
        said += f"{there['nuisance_only']:.2f} with tolerances only and {there['after']:.2f} with what was found."
    return said


def _missing(verdict: dict[str, Any]) -> str:
    """What of the recording could not be used."""
    said = f" Not used: {'; '.join(verdict['left_out'])}." if verdict.get("left_out") else ""
    shares = ", ".join(f"{name} in {share:.0%}" for name, share in verdict.get("lost_sections", {}).items())
    return said + (f" Sections with lost samples are left out for the channel: {shares}." if shares else "")


def _advice(verdict: dict[str, Any]) -> str:
    """What would tell them apart, where anything would."""
    options = verdict.get("separated_by", [])[1:]
    if not options:
        return " Other sensors or speeds may tell."
    if not options[0]["separates"]:
        return " No sensor of the library and no other speed that was tried would tell them apart."
    return f" They would come apart with: {'; or '.join(one['with'] for one in options[:3] if one['separates'])}."


def states_of(findings: Findings, after: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Coefficients of the nominal model, with nuisances only, with the effect."""
    problem = findings.problem
    nominal = problem.stacked(problem.forward.predict(np.zeros(len(findings.null.fit.z))))
    states = [("nominal model", nominal), ("nuisances only", findings.null.fit.stacked)]
    return [*states, ("effect added", after)] if findings.final is not findings.null.fit else states


def _figures(findings: Findings, after: np.ndarray) -> dict[str, tuple[str, Figure]]:
    problem = findings.problem
    states = states_of(findings, after)
    white = [(title, problem.whitened(problem.measured - one)) for title, one in states]
    figures = {
        "where": ("Where it disagrees: channel and band", pictures.heat_maps(problem, states)),
        "along": ("Along the track", pictures.along_track(problem, problem.evidence.track, distance(findings), white)),
        "spectra": ("Spectra of what is not explained", pictures.spectra(problem, states)),
    }
    if findings.judged:
        figures["candidates"] = ("What was tried", pictures.candidates(findings.judged, ENOUGH))
    if any(len(one.curve) for one in findings.latent):
        figures["latent"] = (
            "The missing force, without a name for it",
            pictures.latent([one for one in findings.latent if len(one.curve)]),
        )
    return figures


def distance(findings: Findings) -> np.ndarray:
    """Distance of the middle of each frame [m]."""
    time, speed, _ = findings.problem.evidence.speed
    registration = findings.problem.forward.registration
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    return registration.start + registration.scale * np.interp(findings.problem.frames.middles, time, way)


def _picture(folder: Path, name: str, figure: Figure) -> str:
    data = html.png(figure, DPI)
    (folder / f"{name}.png").write_bytes(data)
    return html.image(name, data)


def _gap_table(verdict: dict[str, Any]) -> str:
    rows = {"all channels together": verdict["gap"], **verdict["channels"]}
    return "<h2>Gap on held-out sections (1 = stated noise only)</h2>" + _table(
        ["", "nominal model", "nuisances only", "effect added"],
        [[name, *(f"{one[key]:.2f}" for key in ("before", "nuisance_only", "after"))] for name, one in rows.items()],
    )


def _elsewhere(verdict: dict[str, Any]) -> str:
    rows = [
        [one["recording"], f"{one['speed']:.1f}", *(f"{value:.2f}" for value in one["gap"].values())]
        for one in verdict.get("held_out_recordings", [])
    ]
    if not rows:
        return ""
    header = ["", "m/s", "nominal model", "nuisances only", "effect added"]
    return "<h2>Recordings that took no part (held-out sections)</h2>" + _table(header, rows)


def _separated(verdict: dict[str, Any]) -> str:
    rows = [
        [one["with"], f"{one['nats']:.1f}", "yes" if one["separates"] else "no"]
        for one in verdict.get("separated_by", [])
    ]
    if not rows:
        return ""
    return "<h2>What would tell them apart</h2>" + _table(["the same run with", "nats expected", "enough"], rows)


def _hypotheses(verdict: dict[str, Any]) -> str:
    rows = [
        [one["effect"], one["class"], f"{one['evidence']:.1f}", f"{one['held_out']:.1f}", f"{one['probability']:.3f}"]
        for one in verdict["hypotheses"]
    ]
    if not rows:
        return ""
    return "<h2>Hypotheses</h2>" + _table(["effect", "class", "evidence", "held out", "probability"], rows)


def _nuisances(verdict: dict[str, Any]) -> str:
    rows = [[name, f"{z:+.1f}"] for name, z in sorted(verdict["nuisances"].items(), key=lambda one: -abs(one[1]))]
    if not rows:
        return ""
    return "<h2>Tolerances used (standard deviations of the data sheet, from 1)</h2>" + _table(["", "score"], rows)


def _table(titles: list[str], rows: list[list[str]]) -> str:
    """A table of texts; all columns but the first are numbers."""
    cells = [[escape(text) for text in row] for row in rows]
    return html.table([escape(title) for title in titles], cells, [i > 0 for i in range(len(titles))])
