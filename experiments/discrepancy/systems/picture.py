"""Pictures of verdicts: evidence of every record, and the curves of what was missing."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.discrepancy.systems.laboratory import Told

WIDTH, HEIGHT, LAWS = 8.0, 0.5, 3.6  # inches: of the picture, of a record, of the laws


def picture(told: Sequence[Told]) -> Figure:
    """Evidence; below it the laws of the rate, where there are any. Drawn inside `styled`."""
    laws = [one for one in told if one.law is not None]
    high = HEIGHT * len(told) + 1.0
    figure = Figure(figsize=(WIDTH, high + (LAWS if laws else 0.0)), layout="constrained")
    axes = figure.subplots(2 if laws else 1, 1, squeeze=False, height_ratios=[high, LAWS] if laws else [1.0])[:, 0]
    _evidence(axes[0], told)
    if laws:
        _laws(axes[1], laws)
    return figure


def _evidence(axes: Axes, told: Sequence[Told]) -> None:
    places = np.arange(len(told))
    groups = {"whole library": [one.verdict for one in told], "without what is missing": [one.withheld for one in told]}
    for shift, (title, verdicts) in zip((-0.19, 0.19), groups.items(), strict=True):
        values = [max(row.evidence for row in verdict.rows) for verdict in verdicts]
        axes.barh(places + shift, values, 0.36, label=title)
        for place, value, verdict in zip(places, values, verdicts, strict=True):
            axes.text(value, place + shift, f" {verdict.action}", va="center", fontsize=9)
    axes.set_yticks(places, [one.name.replace("_", " ") for one in told])
    axes.set_xlabel("evidence of the best hypothesis over none [nats]")
    axes.set_xlim(0.0, 1.6 * axes.get_xlim()[1])
    axes.invert_yaxis()
    axes.legend(loc="lower right")
    axes.grid(axis="y", visible=False)


def _laws(axes: Axes, told: Sequence[Told]) -> None:
    for one in told:
        if one.law is None:
            continue
        (line,) = axes.plot(one.law.states, one.law.mean, label=one.name.replace("_", " "))
        low, high = one.law.mean - 2.0 * one.law.deviation, one.law.mean + 2.0 * one.law.deviation
        axes.fill_between(one.law.states, low, high, color=line.get_color(), alpha=0.12, linewidth=0.0)
    axes.set_xlabel("rate [rad/s]")
    axes.set_ylabel("what was missing [rad/s2],\nwith two deviations")
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
