"""Repeated passes over one track at 10, 20 and 40 m/s, and one after a defect has grown (section 3.4 of the paper)."""

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from estimators.speed.odometry import SPACING
from estimators.track.alignment_vertical import AlignmentVertical
from estimators.track.passes import changes, laid_on, match
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, at_least, at_most, exactly, near
from experiments.reporting.plots import BLUE, GREEN, GREY, ORANGE, RED
from experiments.reporting.size import Size
from experiments.reporting.units import MM
from experiments.runs.growing_defects import KINDS, growing_defects
from railsim import measure, simulate
from railsim.scenario import Scenario
from railsim.scratch import scratch_folder
from railsim.track.files import read_track, write_track
from railsim.track.track import Track

TRACK = "straight_erri_low"
BAND, WHOLE = "vertical_d1 [m]", "vertical [m]"
GROWN_AT, GROWN_BY, GROWN_OVER = 0.6, 1e-3, 2.5  # share of the run; m; m (half length at 1/e)
AGREE, NEAR = 0.3, 1.0  # mm rms; m
CLOSE = 30.0  # m to each side of the defect in the closer view
COLOURS = (BLUE, ORANGE, GREEN)


@dataclass(frozen=True)
class Pass:
    """One pass: speed m/s, error of its wheel's radius, where it starts (m), seed of its sensors, over which track."""

    speed: float
    radius_error: float
    start: float
    seed: int
    grown: bool = False

    @property
    def name(self) -> str:
        """How the table's columns call it."""
        return f"{self.speed:g} m/s{' later' if self.grown else ''}"


PASSES = (
    Pass(10.0, 0.012, 20.0, 1),
    Pass(20.0, -0.006, 8.0, 2),
    Pass(40.0, 0.004, 24.0, 3),
    Pass(20.0, 0.009, 14.0, 4, grown=True),
)
"""The first one is the reference on whose distance the others are laid."""


class Passes(Figure):
    """Vertical D1 from the pitch rate with MEMS sensors and wrong odometers, laid on the first pass by correlation.

    Below: four kinds of defects of several sizes, ten seeds each (rows whose "seed [-]" is given).
    """

    def compute(self, size: Size) -> pd.DataFrame:
        return pd.concat([self._compared(size.reduced), growing_defects(size.reduced)], ignore_index=True)

    def _compared(self, fast: bool) -> pd.DataFrame:
        length = 600.0 if fast else 1900.0
        first = PASSES[0]
        columns: dict[str, np.ndarray] = {}
        heights: dict[str, np.ndarray] = {}
        with scratch_folder() as folder:
            grown = _grown(Path(folder), first.start + GROWN_AT * length)
            estimates = {one.name: _ride(one, length, grown, fast) for one in PASSES}
        reference = estimates[first.name][BAND].to_numpy()
        distance = SPACING * np.arange(len(reference))
        columns["s [m]"] = distance
        for ride in PASSES:
            values = estimates[ride.name][BAND].to_numpy()
            pairing = match(reference, values, SPACING)
            columns[f"{ride.name} [mm]"] = MM * laid_on(values, SPACING, pairing, distance)
            columns[f"lag {ride.name} [m]"] = pairing.other_distance(distance) - distance
            heights[ride.name] = MM * laid_on(estimates[ride.name][WHOLE].to_numpy(), SPACING, pairing, distance)
        later = f"{PASSES[-1].name} [mm]"
        before = np.mean([columns[f"{one.name} [mm]"] for one in PASSES[:-1]], axis=0)
        columns["before [mm]"] = before
        *earlier, last = heights.values()
        columns["height change [mm]"] = last - np.mean(earlier, axis=0)
        columns["change [mm]"] = columns[later] - before
        events = changes(before / MM, columns[later] / MM, SPACING)
        mark = np.full(len(distance), np.nan)
        for event in events:
            mark[round(event["s [m]"] / SPACING)] = MM * event["change [m]"]
        columns["found [mm]"] = mark
        columns["true place [m]"] = np.full(len(distance), GROWN_AT * length * (1.0 + first.radius_error))
        return pd.DataFrame(columns)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 11.0), layout="constrained")
        *panels, last = picture.subplots(4, 1, height_ratios=(1.0, 1.4, 1.0, 1.0))
        _draw_shares(last, table)
        table = _distance_rows(table)
        distance = table["s [m]"].to_numpy()
        at = float(table["true place [m]"].iloc[0])
        near = np.abs(distance - at) < CLOSE
        for ride, colour in zip(PASSES, (*COLOURS, RED), strict=True):
            style = {"color": colour, "lw": 1.4, "ls": "--" if ride.grown else "-"}
            panels[0].plot(distance, table[f"lag {ride.name} [m]"], label=ride.name, **style)
            panels[1].plot(distance[near], table[f"{ride.name} [mm]"][near], label=ride.name, **style)
        panels[2].plot(
            distance, table["change [mm]"], color=GREY, lw=1.0, label="later pass less mean of the first three"
        )
        found = table["found [mm]"].notna()
        panels[2].plot(distance[found], table["found [mm]"][found], "o", color=RED, label="reported as change")
        panels[2].axvline(at, color=RED, lw=0.8, ls=":", label="where the defect grew")
        titles = ("Odometer against the first pass", "Vertical alignment D1 around the defect", "What has changed")
        labels = ("difference [m]", "D1 [mm]", "change of D1 [mm]")
        for axes, title, label in zip(panels, titles, labels, strict=True):
            axes.set(title=title, xlabel="distance by the first pass's odometer [m]", ylabel=label)
            axes.margins(x=0.0)
            axes.legend(ncols=4, frameon=False, fontsize=9, loc="upper left")
            low, high = axes.get_ylim()
            axes.set_ylim(low, high + 0.25 * (high - low))
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = _study_claims(table)
        table = _distance_rows(table)
        for first, second in itertools.combinations([one.name for one in PASSES if not one.grown], 2):
            error = table[f"{first} [mm]"].to_numpy() - table[f"{second} [mm]"].to_numpy()
            rms = float(np.sqrt(np.nanmean(error**2)))
            claims.append(Claim.definite(f"D1 at {first} and {second}: difference", rms, at_most(AGREE, "mm rms")))
        compared = float(np.mean(np.isfinite(table["change [mm]"].to_numpy())))
        reported = table.loc[np.isfinite(table["found [mm]"].to_numpy())]
        away = np.abs(reported["s [m]"].to_numpy() - reported["true place [m]"].to_numpy())
        nearest = float(away.min()) if len(away) else np.inf
        others, target = int(np.sum(away > NEAR)), MM * GROWN_BY
        growth = near(target, 0.3 * target, "mm")
        return [
            *claims,
            Claim.definite("share of the way that could be compared", compared, at_least(0.85)),
            Claim.definite("defect that grew by 1 mm: found how far away", nearest, at_most(NEAR, "m")),
            Claim.definite("changes reported elsewhere", float(others), exactly(0.0)),
            Claim.definite("its growth in the 70 m alignment", _growth(table, reported, away), growth),
        ]


def _distance_rows(table: pd.DataFrame) -> pd.DataFrame:
    """The rows over distance."""
    return table.loc[table["seed [-]"].isna().to_numpy()].reset_index(drop=True)


def _share(table: pd.DataFrame, kind: str, size: float) -> float:
    """Of the defects of that kind and size that are reported within `NEAR`."""
    rows = ((table["defect"] == kind) & (table["size [mm]"] == size)).to_numpy()
    return float(np.mean(np.isfinite(table["away [m]"].to_numpy()[rows])))


def _elsewhere(table: pd.DataFrame) -> int:
    return int(np.sum((table["seed [-]"].notna() & ~table["defect"].isin(KINDS)).to_numpy()))


def _sizes(table: pd.DataFrame) -> list[float]:
    sizes = table["size [mm]"].to_numpy()
    return sorted({float(size) for size in sizes[np.isfinite(sizes)]})


def _draw_shares(axes: Axes, table: pd.DataFrame) -> None:
    sizes = _sizes(table)
    width = 0.8 / len(KINDS)
    for number, (kind, colour) in enumerate(zip(KINDS, (BLUE, ORANGE, GREEN, RED), strict=True)):
        at = np.arange(len(sizes)) + width * (number - 0.5 * (len(KINDS) - 1))
        axes.bar(at, [_share(table, kind, size) for size in sizes], 0.9 * width, color=colour, label=kind)
    axes.set_xticks(range(len(sizes)), [f"{size:g}" for size in sizes])
    passes = len(table.loc[table["seed [-]"].notna().to_numpy(), ["seed [-]", "size [mm]"]].drop_duplicates())
    axes.set(title=f"{passes} later passes: share found; reported elsewhere: {_elsewhere(table)}", ylim=(0.0, 1.1))
    axes.set(xlabel="growth of the defect [mm]", ylabel="share found [-]")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _study_claims(table: pd.DataFrame) -> list[Claim]:
    seeds = len(set(table["seed [-]"].dropna()))
    passes = len(table.loc[table["seed [-]"].notna().to_numpy(), ["seed [-]", "size [mm]"]].drop_duplicates())
    elsewhere = "all passes of all seeds and sizes: changes reported elsewhere"
    return [
        *(
            Claim.definite(
                f"{kind} that grew by 1 mm, all seeds: share found within 1 m",
                _share(table, kind, 1.0),
                exactly(1.0),
                seeds,
            )
            for kind in KINDS
        ),
        Claim.definite(elsewhere, float(_elsewhere(table)), exactly(0.0), passes),
    ]


def _growth(table: pd.DataFrame, reported: pd.DataFrame, away: np.ndarray) -> float:
    """How much deeper the track is at the nearest change than around it, mm; D1 shows a part of so long a dip only."""
    if not len(away):
        return 0.0
    at = float(reported["s [m]"].iloc[int(away.argmin())])
    distance = np.abs(table["s [m]"].to_numpy() - at)
    change = table["height change [mm]"].to_numpy()
    around = (distance > 3.0 * GROWN_OVER) & (distance < 5.0 * GROWN_OVER)
    return float(np.nanmean(change[around]) - np.nanmean(change[distance < 0.5]))


def _ride(ride: Pass, length: float, grown: Path, fast: bool) -> pd.DataFrame:
    """The estimate's series."""
    values = {
        "track": str(grown) if ride.grown else TRACK,
        "vehicle": "manchester",
        "speed": {"kind": "constant", "speed": ride.speed},
        "start": ride.start,
        "duration": round((length + 20.0 - ride.start) / ride.speed, 1),
        "seed": ride.seed,
        "sensors": [
            {"kind": "gyro", "name": "bogie", "body": "bogie", "axes": ["pitch"], "rate": 256, "errors": "mems"},
            {
                "kind": "tachometer",
                "name": "wheelset1",
                "body": "wheelset1",
                "rate": 64,
                "radius_error": ride.radius_error,
            },
        ],
    }
    scenario = Scenario.build(values)
    truth = simulate(scenario, engine="compiled" if fast else "exudyn")
    return AlignmentVertical(compensate=True).estimate(measure(truth, scenario).measurements).series


def _grown(folder: Path, at: float) -> Path:
    """The track with a dip `GROWN_BY` deeper at that place, both rails."""
    track = read_track(TRACK)
    dip = GROWN_BY * np.exp(-(((track.s - at) / GROWN_OVER) ** 2))
    columns = dict(track.columns())
    columns["vertical"] = track.vertical - dip
    path = folder / "grown.csv"
    write_track(Track(track.s, columns, "grown", track.comments), path)
    return path
