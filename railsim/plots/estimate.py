"""Picture of one estimate: every quantity with two stated deviations, what is not valid shaded, events marked."""

import textwrap
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from railsim.plots.style import COLOURS, GREY, MOST_LINES, MOST_PANELS, RED, SHOWN, Picture, frame, legend, thin

MANY_ROWS, MANY_EVENTS = 100_000, 200
"""Beyond these, rows are drawn by their outline and events in one piece."""
FEW_ROWS = 40
"""Below this many rows, each is marked and bears its deviation."""
NAMED = 5
"""Columns that are named where they are not drawn."""
APART = ("s", "time", "valid")
FIRST = ("vertical_d1", "vertical_d2", "lateral_d1", "lateral_d2", "cross_level_d1", "cross_level_d2")
"""Names that come first where there are more than fit."""


PICTURE = "estimate.png"
"""Name of the file in an estimate's folder."""


class Estimated(Protocol):
    """What is drawn of an estimate."""

    @property
    def name(self) -> str:
        """Of the estimator."""
        ...

    @property
    def series(self) -> pd.DataFrame:
        """First column `"time [s]"` or `"s [m]"`, then quantities and their deviations."""
        ...

    @property
    def about(self) -> dict[str, Any]:
        """Warnings and events, if any."""
        ...


def writer(estimate: Estimated) -> Callable[[Path], None]:
    """What draws an estimate into a file."""
    return lambda path: estimate_picture(estimate).savefig(path, dpi=110)


class Panel(NamedTuple):
    """A label, and the columns in it by name."""

    label: str
    columns: tuple[str, ...]


def estimate_picture(estimate: Estimated) -> Picture:
    """Panels over distance or time, those with a stated deviation first.

    Quantities of one unit without a deviation share a panel; one that is withheld throughout has none. What the
    estimate warns of stands below its name.
    """
    series = estimate.series
    panels = panels_of([str(name) for name in series.columns if _is_drawn(series, str(name))])
    shown, left_out = panels[:MOST_PANELS], [name for panel in panels[MOST_PANELS:] for name in panel.columns]
    figure, axes = frame((1.5,) * max(1, len(shown)), _title(estimate, left_out))
    x, label = _along(estimate)
    for number, (panel, place) in enumerate(zip(shown, axes[:, 0], strict=False)):
        _draw(place, estimate, panel, x)
        legend(place, number == 0 or len(panel.columns) > 1)
    axes[-1, 0].set_xlabel(label)
    return figure


def panels_of(columns: list[str]) -> list[Panel]:
    """A panel for each quantity that has a deviation, then one for each unit of the others."""
    banded = [name for name in columns if _deviation(name) in columns]
    others: dict[str, list[str]] = {}
    for name in columns:
        plain, _, unit = name.partition(" [")
        if plain not in APART and name not in banded and not plain.endswith("_std"):
            others.setdefault(unit.removesuffix("]"), []).append(name)
    if len(banded) > MOST_PANELS:
        banded.sort(key=lambda name: name.partition(" [")[0] not in FIRST)
    panels = [Panel(_label(name), (name,)) for name in banded]
    for unit, names in others.items():
        for first in range(0, len(names), MOST_LINES):
            panels.append(Panel(f"[{SHOWN.get(unit, (unit, 1.0))[0]}]", tuple(names[first : first + MOST_LINES])))
    return panels


def _is_drawn(series: pd.DataFrame, name: str) -> bool:
    """Whether a column holds numbers, and any at all."""
    return series[name].dtype.kind in "fiub" and not np.isnan(series[name].to_numpy(dtype=float)).all()


def _draw(axes: Axes, estimate: Estimated, panel: Panel, x: np.ndarray) -> None:
    series, ranges = estimate.series, list[np.ndarray]()
    for name, colour in zip(panel.columns, cycle(COLOURS), strict=False):
        factor = _unit(name)[1]
        values = factor * series[name].to_numpy(dtype=float)
        if _deviation(name) in series:
            around = 2.0 * factor * series[_deviation(name)].to_numpy(dtype=float)
            places, low, high = _outline(x, values - around, values + around)
            axes.fill_between(places, low, high, color=colour, alpha=0.25, lw=0, label="2 deviations")
            if len(x) < FEW_ROWS:  # a band has no width at a value that stands alone
                axes.errorbar(x, values, around, fmt="none", color=colour, lw=0.8, capsize=2)
                ranges += [values - around, values + around]
        style: dict[str, Any] = {"marker": "."} if len(x) < FEW_ROWS else {}
        axes.plot(*thin(x, values), color=colour, lw=1.0, label=name.partition(" [")[0], **style)
        ranges.append(values)
    _keep_to(axes, np.concatenate(ranges))
    axes.set_ylabel(panel.label, fontsize=8)
    if "valid [-]" in series:
        lost = (series["valid [-]"].to_numpy(dtype=float) < 0.5).astype(float)
        places, _, lost = _outline(x, lost, lost)
        bad = lost > 0.5
        axes.fill_between(
            places, 0.0, 1.0, where=bad.tolist(), color=GREY, alpha=0.2, lw=0, transform=axes.get_xaxis_transform(),
            label="not valid" if bad.any() else None,
        )  # fmt: skip
    events = _events(estimate)
    if len(events) > MANY_EVENTS:
        axes.vlines(events, 0.0, 1.0, color=RED, lw=0.3, alpha=0.3, transform=axes.get_xaxis_transform())
        return
    for event in events:
        axes.axvline(event, color=RED, lw=0.7, alpha=0.7)


def _outline(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, lowest and highest values; of more than `MANY_ROWS` those of as many stretches."""
    if len(x) <= MANY_ROWS:
        return x, low, high
    firsts = np.arange(0, len(x), -(-len(x) // MANY_ROWS))
    return x[firsts], np.fmin.reduceat(low, firsts), np.fmax.reduceat(high, firsts)


def _keep_to(axes: Axes, values: np.ndarray) -> None:
    """Limits by what is known, so that wide deviations at the ends do not press the curve flat."""
    known = values[np.isfinite(values)]
    if known.size and np.ptp(known) > 0.0:
        low, high = (float(one) for one in np.quantile(known, [0.002, 0.998]))
        reach = 0.6 * (high - low) if high > low else 1.0
        axes.set_ylim(low - reach, high + reach)


def _along(estimate: Estimated) -> tuple[np.ndarray, str]:
    first = str(estimate.series.columns[0])
    values = estimate.series[first].to_numpy(dtype=float)
    if first == "s [m]" and values.size and np.ptp(values) > 3000.0:
        return values / 1e3, "distance [km]"
    return values, "distance [m]" if first == "s [m]" else "time [s]"


def _events(estimate: Estimated) -> list[float]:
    """Places of events along the picture's axis, of joints and switches for example."""
    along = str(estimate.series.columns[0])
    scale = 1e-3 if _along(estimate)[1].endswith("[km]") else 1.0
    events = estimate.about.get("events")
    found = [one.get(along) for one in events if isinstance(one, dict)] if isinstance(events, list) else []
    return [scale * float(place) for place in found if isinstance(place, int | float)]


def _title(estimate: Estimated, left_out: list[str]) -> str:
    lines = [estimate.name]
    warnings = estimate.about.get("warnings")
    for warning in warnings[:3] if isinstance(warnings, list) else []:
        lines += textwrap.wrap(f"warning: {warning}", 120)[:2]
    if left_out:
        more = f" and {len(left_out) - NAMED} more" if len(left_out) > NAMED else ""
        lines.append(f"not drawn: {', '.join(left_out[:NAMED])}{more}")
    return "\n".join(lines)


def _deviation(name: str) -> str:
    """Name of a quantity's deviation."""
    plain, _, unit = name.partition(" [")
    return f"{plain}_std [{unit}"


def _unit(name: str) -> tuple[str, float]:
    unit = name.partition(" [")[2].removesuffix("]")
    return SHOWN.get(unit, (unit, 1.0))


def _label(name: str) -> str:
    words = name.partition(" [")[0].replace("_", " ")
    return "\n".join([*textwrap.wrap(words, 18), f"[{_unit(name)[0]}]"])
