"""Every effect of the library at three sizes: how surely it is detected and named, expected and in blind runs."""

from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure as Picture

from experiments.discrepancy.fit.candidates import fitted_names
from experiments.figures.discrepancy_runs import SIZES, blind, detected, expected, named, rivals
from experiments.figures.interface import Figure
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, at_least, exactly
from experiments.reporting.logs import tell
from experiments.reporting.plots import BLACK, RED
from experiments.reporting.size import Size
from experiments.reporting.style import as_table
from railsim.scenario import load_scenario

MODEL = "yaw_dampers"
LONG, SHORT = 24.0, 14.0  # s of each recording
FEW = ("weak_yaw_damper", "yaw_damper_series_stiffness", "payload", "sensor_gain")
BLIND = (
    "weak_yaw_damper",
    "primary_vertical_stiffness",
    "conicity_change",
    "low_adhesion",
    "payload",
    "soft_track",
    "wheel_unbalance",
    "crosswind",
    "sensor_gain",
    "lateral_friction",
)
"""Effects that are also run blind, one or two of each part: suspension, wheel, contact, load, track, sensor."""
SEED = 20261  # of the blind runs: of no development case
SURE, HOPELESS = 0.95, 0.05
AGREED = 0.8  # share of blind runs that must turn out as expected
WORST = 5
ALIKE = 0.5  # likeness from which two effects are said to be confused
BANDS = (0.5, 0.8, 0.95)
COLOURS = ListedColormap(["#f0f0f0", "#bdd7e7", "#6baed6", "#08519c"])
MARKS = {
    "named": "✓",
    "wrong": "✗",
    "ambiguous": "≈",
    "unknown": "?",
    "none": "–",
    "refused": "r",
    "impossible": "",
    "": "",
}
IMPOSSIBLE = "/"


class DiscrepancySizes(Figure):
    """Detection and naming of every effect against its size on the nominal scenario `yaw_dampers`.

    "Expected" is by evidence: the signature of the nominal run with all nuisances free to follow, the noise as stated;
    the nearest rival is the other class that imitates it best. "Blind" is the workflow itself on a recording that
    Exudyn made of a random build, whole library.
    """

    def compute(self, size: Size) -> pd.DataFrame:
        """Rows: effect and size; what is done is kept on disk, so that a stopped run goes on."""
        only = FEW if size.reduced else None
        scenario = load_scenario(MODEL, {"duration": SHORT if size.reduced else LONG})
        sized_effects = expected(scenario, only, tell)
        rows = []
        for sized, rival in zip(sized_effects, rivals(sized_effects), strict=True):
            row = {
                "effect": sized.candidate.name,
                "class": sized.candidate.equivalence,
                "acts on": sized.candidate.kind.acts_on,
                "size": sized.size,
                "parameter": sized.name,
                "value": sized.value,
                "unit": sized.unit,
                "absent": sized.absent,
                "possible": bool(sized.own.size),
                "expected evidence [nats]": sized.gain,
                "detected, expected": detected(sized.gain),
                "named, expected": named(sized, rival),
                "nearest rival": rival.name if rival else "",
                "likeness": rival.likeness if rival else 0.0,
                "apart [nats]": rival.apart if rival else 0.0,
                "blind status": "",
                "blind effect": "",
                "blind class": "",
            }
            if row["possible"] and _is_blind(sized.candidate.name, sized.size, size):
                said = blind(scenario, sized, SEED, only, tell)
                row |= {f"blind {key}": said[key] or "" for key in ("status", "effect", "class")}
            rows.append(row)
        return pd.DataFrame(rows)

    def draw(self, table: pd.DataFrame) -> Picture:
        """A table in colours: effects down, sizes across, detection and naming side by side, blind runs as marks."""
        order = _order(table)
        picture = Picture(figsize=(9.0, 1.9 + 0.21 * len(order)), layout="constrained")
        detection, naming, rival = picture.subplots(1, 3, width_ratios=(1.0, 1.0, 2.2))
        image = _cells(detection, table, order, "detected, expected", "detected")
        _cells(naming, table, order, "named, expected", "named right")
        _marks(naming, table, order)
        detection.set_yticks(range(len(order)), order, fontsize=9)
        naming.set_yticks([])
        _rivals(rival, table, order)
        bar = picture.colorbar(image, ax=[detection, naming], location="bottom", shrink=1.0, pad=0.012, aspect=40)
        bar.set_ticks([0.125, 0.375, 0.625, 0.875], labels=["< 0.5", "0.5 to 0.8", "0.8 to 0.95", "> 0.95"])
        bar.ax.tick_params(labelsize=8)
        bar.set_label("expected probability", fontsize=9)
        picture.supxlabel(
            "Blind runs: ✓ right, ≈ ambiguous, ? unknown, ✗ wrong name, – none; / cannot be run.\n"
            "Red: the pairs with the least evidence between them.",
            fontsize=9,
        )
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        """Whether all was computed, sizes speak louder the larger they are, and blind runs turn out as expected."""
        rows = [one for one in table.to_dict("records") if one["possible"]]
        gains = {(one["effect"], one["size"]): one["expected evidence [nats]"] for one in rows}
        names = set(table["effect"])
        whole = len(table) == len(SIZES) * len(names) and names in (set(FEW), set(fitted_names()))
        library = replace(exactly(len(names) if whole else len(fitted_names())), words="all of the library")
        both = [name for name in names if {(name, SIZES[0]), (name, SIZES[2])} <= set(gains)]
        grows = [gains[name, SIZES[2]] >= gains[name, SIZES[0]] for name in both]
        ran = [one for one in rows if one["blind status"] not in ("", "impossible")]
        outcomes = {
            "surely detectable are detected": [_seen(one) for one in ran if one["detected, expected"] > SURE],
            "surely nameable are named right": [_right(one) for one in ran if one["named, expected"] > SURE],
            "hopeless are left alone or named right": [
                not _seen(one) or _right(one) for one in ran if one["detected, expected"] < HOPELESS
            ],
        }
        claims = [
            Claim.definite("effects at three sizes each", float(len(names)), library),
            _all("effects whose largest size brings most evidence", grows),
            *(_share(f"blind runs that are {text}", held, AGREED) for text, held in outcomes.items()),
            _share(
                "blind runs without a wrong name", [one["blind status"] != "named" or _right(one) for one in ran], 0.97
            ),
        ]
        return [claim for claim in claims if claim is not None]

    def notes(self) -> list[str]:
        """What the numbers rest on."""
        return [
            "expected: first variant of each effect (one side, wheelset, channel), noise as stated, nominal build",
            f"blind: {len(BLIND)} effects, one recording at each size, random build, FASTSIM in 30 %",
            "a damper that blows off ever earlier ends as a weaker one, which tolerances imitate: it shows most before",
        ]


def _is_blind(name: str, of_effect: str, size: Size) -> bool:
    return size.of(name in BLIND, name == FEW[0] and of_effect == SIZES[2], False)


def _seen(row: dict[Hashable, Any]) -> bool:
    return row["blind status"] in ("named", "ambiguous", "unknown")


def _right(row: dict[Hashable, Any]) -> bool:
    return row["blind status"] == "named" and row["blind class"] == row["class"]


def _share(text: str, hits: Sequence[bool], least: float) -> Claim | None:
    """A claim on a share; none where no case counts."""
    if not hits:
        return None
    interval = intervals.of_share(np.array(hits))
    return Claim.sampled(f"{text} ({len(hits)})", float(np.mean(hits)), at_least(least), interval)


def _all(text: str, hits: Sequence[bool]) -> Claim | None:
    """A claim on all cases that there are; none where no case counts."""
    if not hits:
        return None
    return Claim.definite(f"{text} ({len(hits)})", float(np.mean(hits)), exactly(1.0), len(hits))


def worst(table: pd.DataFrame) -> list[dict[Hashable, Any]]:
    """The confusions with the least evidence between two classes, of effects that are surely detected and look alike;
    one a pair.
    """
    rows = table.to_dict("records")
    sure = [one for one in rows if one["detected, expected"] > SURE and one["likeness"] > ALIKE]
    confusions: dict[frozenset[str], dict[Hashable, Any]] = {}
    for one in sorted(sure, key=lambda one: one["apart [nats]"]):
        confusions.setdefault(frozenset((one["effect"], one["nearest rival"])), one)
    return list(confusions.values())[:WORST]


def _order(table: pd.DataFrame) -> list[str]:
    """Effects by what they act on, then by how well they are named."""
    score: dict[str, tuple[str, float, float, str]] = {}
    for row in table.to_dict("records"):
        name = str(row["effect"])
        _, told, seen, _ = score.get(name, ("", 0.0, 0.0, ""))
        score[name] = (str(row["acts on"]), told - row["named, expected"], seen - row["detected, expected"], name)
    return sorted(score, key=lambda name: score[name])


def _cells(panel: Axes, table: pd.DataFrame, order: Sequence[str], column: str, title: str):
    wide = table.pivot(index="effect", columns="size", values=column).loc[list(order), list(SIZES)].to_numpy(float)
    banded = np.searchsorted(BANDS, wide, side="right") / 4.0 + 0.125
    image = panel.imshow(banded, aspect="auto", cmap=COLOURS, vmin=0.0, vmax=1.0)
    panel.set_xticks(range(3), SIZES, fontsize=7.5)
    panel.xaxis.tick_top()
    panel.set_title(title)
    panel.set_yticks(np.arange(-0.5, len(order)), minor=True)
    panel.set_xticks(np.arange(-0.5, 3), minor=True)
    as_table(panel)
    panel.grid(which="minor", color="white", linewidth=1.0)
    return image


def _marks(panel: Axes, table: pd.DataFrame, order: Sequence[str]) -> None:
    for row in table.to_dict("records"):
        status = str(row["blind status"])
        wrong = status == "named" and row["blind class"] != row["class"]
        mark = MARKS["wrong" if wrong else status] if row["possible"] else IMPOSSIBLE
        if mark:
            at = SIZES.index(str(row["size"])), list(order).index(str(row["effect"]))
            colour = "white" if row["named, expected"] > SURE else BLACK
            panel.text(*at, mark, ha="center", va="center", fontsize=11, fontweight="bold", color=colour)


def _rivals(panel: Axes, table: pd.DataFrame, order: Sequence[str]) -> None:
    """At the middle size: the class that looks most like it, and how much evidence stays between."""
    middle = {str(row["effect"]): row for row in table.to_dict("records") if row["size"] == SIZES[1]}
    bad = [{str(row["effect"]), str(row["nearest rival"])} for row in worst(table)]
    panel.set(xlim=(0.0, 1.0), ylim=(len(order) - 0.5, -0.5))
    panel.axis("off")
    panel.set_title("middle size; nearest rival (likeness), nats between", fontsize=9, loc="left")
    for line, name in enumerate(order):
        entry = middle[name]
        text = "this vehicle or run cannot have it"
        if entry["possible"]:
            unit = str(entry["unit"]).split(" of ")[0].split(",")[0].strip("-")
            size = f"{entry['parameter']} {entry['value']:.3g} {unit}".strip()
            text = f"{size}; {entry['nearest rival']} ({entry['likeness']:.2f}), {entry['apart [nats]']:.3g}"
        hard = {name, str(entry["nearest rival"])} in bad
        panel.text(
            0.0,
            line,
            text,
            va="center",
            fontsize=8.5,
            color=RED if hard else BLACK,
            fontweight="bold" if hard else None,
        )
