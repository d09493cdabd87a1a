"""Report of a sweep: one HTML page with its pictures inside."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from experiments.reporting import html
from experiments.reporting.text import cell
from experiments.sweep import analysis, pictures
from experiments.sweep.analysis import Frame
from experiments.sweep.contents import Contents, read_contents
from experiments.sweep.store import REPORT, TABLE, read_settings, task_facts
from railsim.files import read_json, replace_file

DPI = 110
NUMBERS = {
    "value": "with the cheapest set",
    "cost": "its cost",
    "its value": "with the cheapest set near the best",
    "its cost": "cost of that",
}
"""Columns of `analysis.smallest_sets`, in words."""
MOST_ROWS = 60  # of a table on the page; the Parquet table holds all


def write_report(folder: Path) -> Path:
    """Write report.html, and its pictures once more as PNG files in `pictures/`; returns the page's path.

    Raises
    ------
    InputError : the folder holds no finished sweep, or cannot be written.
    """
    settings = read_settings(folder)
    factors = list(settings["factors"])
    contents = read_contents(folder / TABLE, factors)
    page, scored = _Page(folder), contents.scored
    _head(page, settings, contents)
    names = analysis.responses(scored, settings["responses"])
    means = {name: analysis.per_point(scored, name, factors) for name in names}
    _sensor_sets(page, settings, contents)
    if names:
        _responses(page, means, factors)
        _indices(page, settings, scored, factors, names)
        _extremes(page, scored, factors, names)
    _messages(page, contents.bad)
    _speed(page, folder)
    replace_file(folder / REPORT, page.text(settings["name"]).encode())
    return folder / REPORT


def numbers(folder: Path) -> dict[str, dict[str, float]]:
    """By quantity and estimator "value": the score with the cheapest set of sensors, with the cheapest near best, and
    their costs. Empty for a sweep without sets of a stated cost.
    """
    settings = read_settings(folder)
    costs = _costs(settings)
    if not costs:
        return {}
    contents = read_contents(folder / TABLE, list(settings["factors"]))
    panels = settings.get("panels") or _own_panels(contents.scored)
    rows = analysis.smallest_sets(contents.estimators, contents.bad, contents.scored, costs, panels).to_dict("records")
    return {
        f"{_whose(one)}: {words}": {"value": float(one[key])}
        for one in rows
        for key, words in NUMBERS.items()
        if not pd.isna(one.get(key))
    }


def _whose(row: Mapping[Any, Any]) -> str:
    return ", ".join(str(row[key]) for key in ("quantity", "estimator", "score") if row[key])


class _Page:
    """Parts of the page in their order."""

    def __init__(self, folder: Path) -> None:
        self._parts: list[str] = []
        self._pictures = folder / "pictures"
        self._pictures.mkdir(exist_ok=True)

    def heading(self, text: str) -> None:
        self._parts.append(f"<h2>{escape(text)}</h2>")

    def line(self, text: str) -> None:
        self._parts.append(f"<p>{escape(text)}</p>")

    def table(self, rows: Frame, decimals: int = 4) -> None:
        cut = rows.head(MOST_ROWS)
        cells = [[_shown(value, decimals) for value in row] for row in cut.itertuples(index=False, name=None)]
        numeric = [all(_is_number(value) for value in cut.iloc[:, i]) for i in range(cut.shape[1])]
        self._parts.append(html.table([escape(str(name)) for name in cut.columns], cells, numeric))
        if len(rows) > len(cut):
            self._parts.append(f'<p class="note">{len(rows) - len(cut)} further rows are left out.</p>')

    def picture(self, name: str, figure: Figure) -> None:
        data = html.png(figure, DPI)
        replace_file(self._pictures / f"{name}.png", data)
        self._parts.append(html.image(name, data))

    def text(self, title: str) -> str:
        return html.page(title, [f"<h1>Sweep {escape(title)}</h1>", *self._parts])


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, float | int) and not isinstance(value, bool))


def _shown(value: Any, decimals: int) -> str:
    """A cell; empty for what is missing."""
    missing = value is None or value != value
    return "" if missing else escape(cell(value, decimals))


def _head(page: _Page, settings: Mapping[str, Any], contents: Contents) -> None:
    if settings["description"]:
        page.line(settings["description"])
    statuses = ", ".join(f"{count} {name}" for name, count in contents.status.items())
    page.line(
        f"Scenario {settings['scenario']}, engine {settings['engine']}; design {settings['design']['kind']} over "
        f"{', '.join(settings['factors'])}: {settings['design']['points']} points, {settings['tasks']} simulated runs; "
        f"estimators {', '.join(settings['estimators'])}; {len(settings['seeds'])} noise seeds; "
        f"{contents.rows} rows ({statuses})."
    )


def _responses(page: _Page, means: Mapping[str, Frame], factors: Sequence[str]) -> None:
    page.heading("Responses")
    page.line(
        "Median over everything else with the band of 10 to 90 %; values are means over the noise seeds, "
        "failed runs are left out."
    )
    for number, (name, table) in enumerate(means.items()):
        page.picture(f"response{number + 1}", pictures.main_effects(table, name, factors))
        crossed = pictures.interaction(table, name, factors)
        if crossed is not None:
            page.picture(f"interaction{number + 1}", crossed)


def _indices(
    page: _Page, settings: Mapping[str, Any], scored: Frame, factors: Sequence[str], names: Sequence[str]
) -> None:
    parts = [(name, *analysis.indices(scored, name, factors, settings["design"])) for name in names]
    if not any(len(table) or notes for _, table, notes in parts):
        return
    page.heading("Sensitivity: Sobol' indices")
    page.line(
        "Share of the variance by a factor alone (first) and with all its interactions (total), with 95 % bootstrap "
        "intervals."
    )
    for number, (name, table, notes) in enumerate(parts):
        if len(table):
            page.picture(f"indices{number + 1}", pictures.index_bars(table, name))
            page.table(table.assign(response=name))
        for note in notes:
            page.line(note)


def _extremes(page: _Page, scored: Frame, factors: Sequence[str], names: Sequence[str]) -> None:
    page.heading("Best and worst points")
    for name in names:
        page.line(name)
        page.table(analysis.extremes(scored, name, factors))


def _sensor_sets(page: _Page, settings: Mapping[str, Any], contents: Contents) -> None:
    scored = contents.scored
    costs = _costs(settings)
    if not costs:
        return
    page.heading("Sets of sensors")
    sets = [
        {"set": name, "cost class": chosen["cost"], "channels": ", ".join(chosen["channels"])}
        | _positions(chosen.get("at", {}))
        for name, chosen in settings["sensors"].items()
    ]
    page.table(pd.DataFrame(sets))
    panels = settings.get("panels") or _own_panels(scored)
    tables = {
        title: (panel["score"], analysis.by_set(analysis.chosen_points(scored, panel["at"]), panel["score"], costs))
        for title, panel in panels.items()
    }
    tables = {title: (score, table) for title, (score, table) in tables.items() if len(table)}
    if tables:
        page.picture("pareto", pictures.pareto(tables))
    page.line(
        "By quantity and estimator: the cheapest set that serves it, and the cheapest with a score within 10 % of its "
        "best. Values are means over points and seeds, of errors the mean size."
    )
    page.table(analysis.smallest_sets(contents.estimators, contents.bad, scored, costs, panels))
    for title, (score, table) in tables.items():
        positions = "; ".join(_positions(panels[title]["at"]).values())
        page.line(f"{title}: {score}{f' ({positions})' if positions else ''}")
        wide = table.pivot(index="sensors", columns="estimator", values="value")
        page.table(wide.reindex([name for name in costs if name in wide.index]).reset_index())


def _costs(settings: Mapping[str, Any]) -> dict[str, float]:
    return {name: chosen["cost"] for name, chosen in settings["sensors"].items() if chosen["cost"] is not None}


def _own_panels(scored: Frame) -> dict[str, dict[str, Any]]:
    """A panel a score that stands for an estimator."""
    return {name: {"score": name, "at": {}} for name in dict.fromkeys(analysis.main_responses(scored).values())}


def _positions(at: Mapping[str, Any]) -> dict[str, str]:
    """Where a set or a panel counts, in words; empty for everywhere."""
    return {"at": "; ".join(f"{name} {', '.join(map(str, one))}" for name, one in at.items())} if at else {}


def _messages(page: _Page, rows: Frame) -> None:
    bad = analysis.messages(rows)
    page.heading("Failures and notes")
    if bad.empty:
        page.line("None.")
    else:
        page.table(bad)


def _speed(page: _Page, folder: Path) -> None:
    page.heading("Speed and memory")
    path = folder / "throughput.json"
    if path.exists():
        rows = [{"": name, "value": value} for name, value in read_json(path, "the folder of a sweep").items()]
        page.table(pd.DataFrame(rows), 3)
        page.line(
            "Of the last session: rate without the start of the workers; efficiency: rate over that of as many workers "
            "as fast as one that has the machine for itself (some tasks were run again alone to measure it)."
        )
    else:
        page.line("Too few tasks in the last session to measure its speed.")
    series, growth = analysis.memory(task_facts(folder))
    if series:
        page.picture("memory", pictures.memory_plot(series))
    if growth is not None:
        page.line(
            f"Largest growth of a worker's memory after the first {analysis.SETTLED} tasks: {100 * growth:.1f} %."
        )
