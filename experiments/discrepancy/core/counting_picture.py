"""Picture of answered cases: whether stated probabilities come true, and healthy ones right in each setting."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.reporting.intervals import of_share
from railsim.plots.style import BLACK, BLUE, ORANGE

BINS = (0.0, 0.6, 0.8, 0.9, 0.97, 0.99, 1.0)  # of the stated probability
AIM = 0.97  # of healthy ones right in each setting


def picture(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Reliability to the left, settings to the right; bars are 95 % (Clopper and Pearson). Drawn inside `styled`."""
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    _reliability(left, rows)
    _settings(right, [row for row in rows if row["kind"] == "null"])
    return figure


def _reliability(panel: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    """Share that is true beside the mean of what is stated, by bins of the statement."""
    bins = [(low, high, [row for row in rows if low < row["stated"] <= high]) for low, high in pairwise(BINS)]
    bins = [one for one in bins if one[2]]
    for place, (_, _, here) in enumerate(bins):
        _share(panel, place, [row["leads"] for row in here], upright=True)
    stated = [float(np.mean([row["stated"] for row in here])) for _, _, here in bins]
    panel.plot(range(len(bins)), stated, "_", color=ORANGE, ms=26, mew=2.0, label="stated, mean")
    panel.plot([], [], "o", color=BLUE, ms=5, label="came true, 95 %")
    panel.set_xticks(
        range(len(bins)), [f"{low:g} to {high:g}\n{len(here)} cases" for low, high, here in bins], fontsize=8
    )
    panel.set_xlim(-0.5, len(bins) - 0.5)
    panel.set_ylim(0.0, 1.05)
    panel.set_xlabel("stated probability of what leads")
    panel.set_ylabel("share")
    panel.set_title("Do stated probabilities come true?")
    panel.legend(loc="lower right")


def _settings(panel: Axes, nulls: Sequence[Mapping[str, Any]]) -> None:
    """Share of healthy ones that are called healthy."""
    names, labels = list(dict.fromkeys(row["setting"] for row in nulls)), []
    for place, name in enumerate(names):
        hits = [row["judged"] == "right" for row in nulls if row["setting"] == name]
        _share(panel, place, hits, upright=False)
        labels.append(f"{name}\n{sum(hits)} of {len(hits)}")
    panel.axvline(AIM, color=BLACK, lw=1.0, ls="--", label=f"aim {AIM:g}")
    panel.set_yticks(range(len(names)), labels, fontsize=8)
    panel.set_ylim(len(names) - 0.4, -0.6)
    panel.set_xlabel("share of healthy records that are called healthy, 95 %")
    panel.set_title("Healthy records by setting")
    panel.legend(loc="lower left")


def _share(panel: Axes, place: float, hits: Sequence[bool], *, upright: bool) -> None:
    """A share with its interval."""
    found = np.array(hits, bool)
    share, interval = float(found.mean()), of_share(found)
    ends = [[share - interval.low], [interval.high - share]]
    if upright:
        panel.errorbar(place, share, yerr=ends, fmt="o", ms=5, color=BLUE, capsize=3)
    else:
        panel.errorbar(share, place, xerr=ends, fmt="o", ms=5, color=BLUE, capsize=3)
