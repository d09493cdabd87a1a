"""Pictures of a sweep: responses over factors, indices, cost against score, memory."""

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from experiments.sweep.analysis import Frame
from railsim.plots.style import BLACK, BLUE, COLOURS, GREY, SKY, dress

MARKERS = "osD^vPX*"
MOST_PANELS = 6
MOST_LEVELS = 12  # of a factor; more are gathered into bins
BINS = 8
SPREAD = (0.1, 0.9)  # quantiles of the band


def main_effects(means: Frame, response: str, factors: Sequence[str]) -> Figure:
    """Median of a response over each factor by estimator, with the band of 10 to 90 % over everything else."""
    shown = list(factors)[:MOST_PANELS]
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(1.0 + 4.2 * columns, 0.9 + 3.2 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    labels = list(dict.fromkeys(means["estimator"]))
    for panel, factor in zip(panels, shown, strict=False):
        for number, label in enumerate(labels):
            _effect(panel, means[means["estimator"] == label], factor, number, len(labels), label)
        panel.set_xlabel(_named(factor))
        dress(panel)
    for panel in panels[len(shown) :]:
        panel.set_axis_off()
    for panel in panels[::columns]:
        panel.set_ylabel(response)
    _scale(panels[0], means["value"].to_numpy())
    handles, names = panels[0].get_legend_handles_labels()
    room = max(1, int(figure.get_figwidth() / 2.4))
    figure.legend(handles, names, loc="outside upper center", ncols=min(room, len(names)), frameon=False)
    return figure


def interaction(means: Frame, response: str, factors: Sequence[str]) -> Figure | None:
    """A response over the numeric factor with most levels, a line a level of the next, a row of panels a level of the
    third; a column an estimator. None where there are no two factors to cross.
    """
    numeric = [name for name in factors if pd.api.types.is_numeric_dtype(means[name])]
    levels = {name: list(dict.fromkeys(means[name])) for name in factors}
    crossed = [name for name in factors if 1 < len(levels[name]) <= MOST_LEVELS]
    over = max((name for name in numeric if name in crossed), key=lambda name: len(levels[name]), default=None)
    others = [name for name in crossed if name != over]
    if over is None or not others:
        return None
    second, third = others[0], others[1] if len(others) > 1 else None
    rows: list[Any] = levels[third][:4] if third else [None]
    labels = list(dict.fromkeys(means["estimator"]))[:4]
    figure = Figure(figsize=(1.2 + 3.6 * len(labels), 1.0 + 2.7 * len(rows)), layout="constrained")
    panels = figure.subplots(len(rows), len(labels), squeeze=False, sharex=True, sharey=True)
    for panel_row, level in zip(panels, rows, strict=True):
        for panel, label in zip(panel_row, labels, strict=True):
            part = means[means["estimator"] == label]
            part = part if level is None else part[part[third] == level]
            for number, line in enumerate(levels[second]):
                value = part[part[second] == line].groupby(over)["value"].mean()
                colour = COLOURS[number % len(COLOURS)]
                panel.plot(
                    value.index, value, marker=MARKERS[number % 8], ms=4, lw=1.4, color=colour, label=_text(line)
                )
            if part["value"].dropna().empty:
                panel.text(0.5, 0.5, "no value in any run", transform=panel.transAxes, ha="center", color="0.4")
            panel.set_title(label if level is None else f"{label}, {_short(third)} {_text(level)}", fontsize=9)
            dress(panel)
        panel_row[0].set_ylabel(response, fontsize=9)
    for panel in panels[-1]:
        panel.set_xlabel(_named(over))
    _scale(panels[0, 0], means["value"].to_numpy())
    handles, names = panels[0, 0].get_legend_handles_labels()
    room = max(1, int(figure.get_figwidth() / 1.3))
    figure.legend(handles, names, title=second, loc="outside upper center", ncols=min(room, len(names)), frameon=False)
    return figure


def index_bars(table: Frame, response: str) -> Figure:
    """First and total order indices with their 95 % intervals, a panel an estimator."""
    groups = list(table.groupby(["estimator", "sensors"], sort=False))
    figure = Figure(figsize=(1.0 + 4.0 * len(groups), 3.6), layout="constrained")
    panels = figure.subplots(1, len(groups), squeeze=False, sharey=True)[0]
    for panel, ((label, _), part) in zip(panels, groups, strict=True):
        positions = np.arange(len(part))
        for shift, order, colour in ((-0.2, "first", SKY), (0.2, "total", BLUE)):
            mean = part[order].to_numpy(float)
            reach = [mean - part[f"{order}_low"].to_numpy(float), part[f"{order}_high"].to_numpy(float) - mean]
            panel.bar(positions + shift, mean, 0.38, color=colour, label=f"{order} order")
            panel.errorbar(positions + shift, mean, np.maximum(reach, 0.0), fmt="none", ecolor=BLACK, capsize=3, lw=1)
        panel.set_xticks(positions, [_short(str(name)) for name in part["factor"]], rotation=20, ha="right")
        panel.set_title(str(label), fontsize=10)
        dress(panel)
    panels[0].set_ylabel(f"Sobol' index of\n{response}")
    panels[0].legend(frameon=False, fontsize=9)
    return figure


def pareto(tables: Mapping[str, tuple[str, Frame]]) -> Figure:
    """Score over cost of the sensor sets, a panel a quantity; the Pareto front is the step line, its
    sets are numbered.

    `tables`: by title the score and what `analysis.by_set` gives of it.
    """
    columns = min(2, len(tables))
    rows = -(-len(tables) // columns)
    figure = Figure(figsize=(0.6 + 4.8 * columns, 0.6 + 4.2 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel, (title, (response, table)) in zip(panels, tables.items(), strict=False):
        _cloud(panel, table, response, "" if title == response else title)
    for panel in panels[len(tables) :]:
        panel.set_axis_off()
    return figure


def memory_plot(series: Mapping[str, np.ndarray]) -> Figure:
    """Resident memory of each worker over the finished tasks."""
    figure = Figure(figsize=(8.0, 2.8), layout="constrained")
    panel = figure.subplots()
    for number, points in enumerate(series.values()):
        panel.plot(points[:, 0] + 1, points[:, 1] / 2**20, lw=1.2, color=COLOURS[number % len(COLOURS)])
    panel.set(xlabel="finished tasks", ylabel="memory [MiB]")
    panel.set_ylim(bottom=0.0)
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    dress(panel)
    return figure


def _effect(panel: Axes, part: Frame, factor: str, number: int, of: int, label: str) -> None:
    """One line of a main effect: over numbers with a band, over names as points with bars."""
    colour = COLOURS[number % len(COLOURS)]
    if pd.api.types.is_numeric_dtype(part[factor]):
        values = part[factor].to_numpy(float)
        groups = _binned(values) if len(np.unique(values)) > MOST_LEVELS else values
        spread = part["value"].groupby(groups)
        middle = spread.median()
        panel.fill_between(
            middle.index, spread.quantile(SPREAD[0]), spread.quantile(SPREAD[1]), color=colour, alpha=0.15, lw=0
        )
        panel.plot(middle.index, middle, marker=MARKERS[number % 8], ms=4, lw=1.6, color=colour, label=label)
        return
    names = list(dict.fromkeys(part[factor]))
    spread = part.groupby(factor)["value"]
    middle = spread.median().reindex(names)
    low, high = (spread.quantile(share).reindex(names) for share in SPREAD)
    positions = np.arange(len(names)) + 0.5 * (number - 0.5 * (of - 1)) / max(of, 2)
    panel.errorbar(
        positions, middle, [middle - low, high - middle], fmt=MARKERS[number % 8], ms=5, color=colour, capsize=3,
        lw=1.2, label=label,
    )  # fmt: skip
    long = max((len(_text(name)) for name in names), default=0) > 8
    panel.set_xticks(range(len(names)), [_text(name) for name in names], rotation=20 if long else 0,
                     ha="right" if long else "center")  # fmt: skip


def _binned(values: np.ndarray) -> np.ndarray:
    """Each value's bin as the mean of the values in it; bins hold equally many."""
    edges = np.quantile(values, np.linspace(0, 1, BINS + 1)[1:-1])
    bins = np.searchsorted(edges, values)
    return np.array([values[bins == own].mean() for own in bins])


def _cloud(panel: Axes, table: Frame, response: str, title: str) -> None:
    for number, (label, part) in enumerate(table.groupby("estimator", sort=False)):
        colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % 8]
        panel.plot(part["cost"], part["value"], marker, ms=6, color=colour, label=str(label), alpha=0.85, mew=0)
    pareto_front = table[table["front"]].sort_values(["cost", "value"])
    pareto_front = pareto_front.drop_duplicates("cost")
    right = 1.08 * float(table["cost"].max())
    panel.step(
        [*pareto_front["cost"], right],
        [*pareto_front["value"], *pareto_front["value"].tail(1)],
        where="post",
        color=GREY,
        lw=1.2,
    )
    for number, (cost, value) in enumerate(zip(pareto_front["cost"], pareto_front["value"], strict=True), 1):
        panel.annotate(str(number), (cost, value), (4, 4), textcoords="offset points", fontsize=9, color=BLACK)
    names = "\n".join(f"{number}  {name}" for number, name in enumerate(pareto_front["sensors"], 1))
    panel.text(0.0, -0.2, names, transform=panel.transAxes, va="top", fontsize=9, color=BLACK)
    panel.set(xlabel="cost class of the sensor set", ylabel=textwrap.fill(response, 30), xlim=(0.0, 1.05 * right))
    _scale(panel, table["value"].to_numpy())
    if panel.get_yscale() == "linear" and float(table["value"].min()) >= 0.0:
        panel.set_ylim(0.0, 1.2 * max(float(table["value"].max()), 1e-12))
    dress(panel)
    columns = 2
    panel.legend(
        frameon=False, fontsize=9, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, title=title or None,
        title_fontproperties={"weight": "bold", "size": 10}, alignment="left", handletextpad=0.2, borderaxespad=0.1,
        columnspacing=0.8,
    )  # fmt: skip


def _scale(panel: Axes, values: np.ndarray) -> None:
    """Logarithmic where positive values span more than a factor of 30."""
    good = values[np.isfinite(values)]
    if good.size and good.min() > 0 and good.max() > 30 * good.min():
        panel.set_yscale("log")
        panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.yaxis.set_major_formatter("{x:g}")
        panel.yaxis.set_minor_formatter(NullFormatter())


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _named(key: str) -> str:
    """A key as the label of an axis: effects, which are numbered from 0 there, in words."""
    found = re.fullmatch(r"effects\.(\d+)\.(.+)", key)
    return f"{found[2].replace('_', ' ')} of effect {int(found[1]) + 1}" if found else key


def _short(name: str | None) -> str:
    """Last part of a dotted key."""
    return (name or "").rpartition(".")[2]
