"""Pictures of an answer: the evidence of what was compared, and where each model lies off the recording."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.discrepancy.railway.answer import Answer
from experiments.discrepancy.railway.gaps import BANDS, left
from experiments.discrepancy.railway.laws import VELOCITY
from experiments.discrepancy.railway.statement import chance
from experiments.discrepancy.railway.unknown import Unknown
from experiments.reporting.plots import BLUE, GREY

SHOWN = 12  # hypotheses
LOUDEST = 10.0  # of the scale of colours


def evidence(answer: Answer) -> Figure:
    """Evidence of the likeliest hypotheses over `none`, and the probability of each."""
    rows = list(answer.verdict.rows[:SHOWN])
    figure = Figure(figsize=(8.5, 0.36 * len(rows) + 1.3), layout="constrained")
    axes = figure.subplots()
    places = np.arange(len(rows))
    best = answer.best.hypothesis.name
    colours = [BLUE if row.fit.hypothesis.name == best else GREY for row in rows]
    values = [row.evidence for row in rows]
    axes.barh(places, values, 0.7, color=colours)
    axes.set_yticks(places, [row.fit.hypothesis.name.replace("_", " ") for row in rows], fontsize=9)
    low, high = min(0.0, *values), max(1.0, *values)
    for place, row in enumerate(rows):
        axes.text(
            max(row.evidence, 0.0) + 0.01 * (high - low), place, f" {chance(row.posterior)}", va="center", fontsize=9
        )
    axes.set_xlim(low, high + 0.4 * (high - low))
    axes.axvline(0.0, color="black", linewidth=0.8)
    figure.supxlabel("evidence over 'none' [nats]; beside each bar: its probability", fontsize=9)
    axes.invert_yaxis()
    return figure


def where(answer: Answer) -> Figure:
    """What is left of each channel in each band: nominal model, tolerances used, what is stated."""
    f, levels = answer.system.record.frequencies, answer.system.levels
    models = {"nominal model": answer.nominal, "tolerances used": answer.none.groups}
    if answer.best is not answer.none:
        models["as stated"] = answer.best.groups
    channels = [name.partition(" [")[0] for name in answer.system.record.channels]
    figure = Figure(figsize=(3.0 + 2.4 * len(models), 0.3 * len(channels) + 1.9), layout="constrained")
    panels = figure.subplots(1, len(models), sharey=True, squeeze=False)[0]
    for axes, (title, groups) in zip(panels, models.items(), strict=True):
        _map(axes, left(groups, levels, f).T, title)
    panels[0].set_yticks(range(len(channels)), channels, fontsize=8)
    figure.supxlabel("frequency [Hz]; numbers: rms of what is left over noise and track errors as stated", fontsize=9)
    return figure


def unknown(one: Unknown) -> Figure:
    """Something unknown: its course, its power over what acts there, and its curves over the motion there."""
    figure = Figure(figsize=(8.5, 5.5), layout="constrained")
    above, under = np.ravel(np.asarray(figure.subfigures(2, 1)))
    course, below = above.subplots(), under.subplots(1, 1 + len(one.curves), squeeze=False)[0]
    course.plot(one.time, one.values, color=BLUE, linewidth=0.6)
    course.set_xlabel("time [s]")
    course.set_ylabel(f"missing [{one.unit}]")
    course.set_title(f"{one.place}: {one.words}", fontsize=10)
    below[0].semilogy(one.frequencies, one.power, color=BLUE, linewidth=1.0)
    below[0].set_xlabel("frequency [Hz]")
    below[0].set_ylabel("power over what acts there [-]", fontsize=9)
    base = "rad" if one.unit == "N m" else "m"
    for axes, (name, curve) in zip(below[1:], one.curves.items(), strict=True):
        axes.plot(curve.state, curve.mean, "o-", color=BLUE, markersize=4, linewidth=1.0)
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.set_xlabel(f"{name} [{base}{'/s' if name == VELOCITY else ''}]")
        axes.set_title(f"explains {max(0.0, 100.0 * curve.share):.0f} %", fontsize=9)
        axes.locator_params(axis="x", nbins=4)
    return figure


def _map(axes: Axes, values: np.ndarray, title: str) -> None:
    axes.imshow(np.log(np.maximum(values, 1.0)), vmin=0.0, vmax=np.log(LOUDEST), cmap="Blues", aspect="auto")
    for row, column in np.ndindex(values.shape):
        value = values[row, column]
        if np.isfinite(value):
            dark = value > 0.5 * LOUDEST
            text = f"{value:.1f}" if value < LOUDEST else f"{value:.0f}"
            axes.text(column, row, text, ha="center", va="center", fontsize=7, color="white" if dark else "black")
    axes.set_xticks(range(len(BANDS)), [f"{low:g}-{high:g}" for low, high in BANDS], fontsize=7)
    axes.set_title(title, fontsize=10)
