"""Part of figure 9: how far apart the peaks of the creep forces stand, by wheel-rail pair, over tracks and speeds."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from estimators.adhesion.classifier import LEVELS
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, above, at_least, between
from experiments.reporting.plots import BLUE, GREEN, ORANGE, PURPLE
from experiments.reporting.size import Size
from experiments.runs.adhesion import run, scenario, sensors
from experiments.runs.adhesion_unseen import DURATION, SPEEDS, TRACKS
from experiments.runs.unseen_tracks import write_unseen
from railsim.measurements import Measurements
from railsim.scratch import scratch_folder
from railsim.truth import Truth

LENGTH = 1200.0  # m of a run at most
ARCS, SHALLOW, S1002 = "arcs", "shallow arcs", "S1002"
PAIRS: Mapping[str, Mapping[str, Any]] = {
    ARCS: {"kind": "smooth"},
    SHALLOW: {"kind": "smooth", "wheel_profile_radius": 1.5},
    S1002: {"kind": "profiles", "wheel": "s1002", "rail": "uic60_40"},
}
"""Wheel-rail pairs. Arcs of the wheel of 0.5 m change the contact angle by 5 rad/m of shift, shallow ones of 1.5 m by
0.83 rad/m, at the same conicity of 0.125; new S1002 wheels run on UIC 60 rails at 1:40.
"""
EXPECTED = {ARCS: (0.95, 1.23), SHALLOW: (7.0, 10.0), S1002: (0.2, 0.4)}
"""The trailing wheelset's peak of the creep force, dry over very low, over that of the leading one: what was seen of
these kinds of pairs on single tracks before, and is tried here on others.
"""
PAIR, WHEELSET = "pair", "wheelset"
COLOURS = (ORANGE, BLUE, GREEN, PURPLE)
SHOWN = 1e-2, 1e2  # of the ratio


def sweep(
    size: Size, vehicle: str, kinds: list[str], peaks: Callable[[Truth, Measurements], Iterator[tuple[int, str, float]]]
) -> pd.DataFrame:
    """Peaks of all runs, compiled engine.

    Parameters
    ----------
    kinds : what there are peaks of. peaks : wheelset, kind and largest density of a run.

    Returns
    -------
    A row a pair, track, speed, level and wheelset, a column a kind.
    """
    tracks, speeds = size.of((TRACKS, SPEEDS), (TRACKS[:1], SPEEDS[2:3]))
    rows = []
    with scratch_folder() as folder:
        files = write_unseen(Path(folder))
        runs = itertools.product(PAIRS, tracks, speeds)
        for number, (pair, track, speed) in enumerate(runs):
            for place, level in enumerate(LEVELS):
                settings = {"name": vehicle, "adhesion": level, "pair": PAIRS[pair]}
                duration = min(size.of(DURATION, DURATION, 16.0), LENGTH / speed)
                given = {"track": str(files.get(track, track)), "vehicle": settings}
                truth, measured = run(scenario(given, speed, duration, sensors("mems")), 9000 + 10 * number + place)
                about = {PAIR: pair, "track": track, "speed [m/s]": speed, "condition": level}
                found: dict[int, dict[str, float]] = {}
                for wheelset, kind, value in peaks(truth, measured):
                    found.setdefault(wheelset, {})[kind] = value
                rows += [about | {WHEELSET: float(wheelset)} | found[wheelset] for wheelset in found]
    return pd.DataFrame(rows, columns=[PAIR, "track", "speed [m/s]", "condition", WHEELSET, *kinds])


def claims(table: pd.DataFrame, kinds: list[str], true: str) -> Iterator[Claim]:
    """For each pair and kind: peaks in order, and the trailing wheelset's separation over that of the leading one."""
    for pair, kind in itertools.product(PAIRS, kinds):
        for number, name in ((1, "leading"), (2, "trailing")):
            shares = _ordered(table, pair, number, kind)
            what = f"{pair}, {name}: {_short(kind)}: pairs of neighbouring levels whose peaks are in order"
            yield Claim.sampled(what, float(np.mean(shares)), at_least(0.95), intervals.of_mean_share(shares))
        ratio, interval = _ratio(table, pair, kind)
        what = f"{pair}: {_short(kind)}: peak dry over very low, trailing over leading (geometric mean)"
        yield Claim.sampled(what, ratio, above(1.0), interval)
    for pair, ends in EXPECTED.items():
        ratio, interval = _ratio(table, pair, true)
        what = f"{pair}: {_short(true)}: that ratio as seen before on single tracks"
        yield Claim.sampled(what, ratio, between(*ends), interval)


def draw_ratios(axes: Axes, table: pd.DataFrame, kinds: list[str]) -> None:
    """Trailing over leading wheelset, by pair and kind, with intervals and every run."""
    for place, (kind, colour) in enumerate(zip(kinds, COLOURS, strict=True)):
        for at, pair in enumerate(PAIRS):
            x = at + 0.18 * (place - 1.5)
            each = np.clip(10.0 ** _decades(table, pair, kind), *SHOWN)
            axes.plot(np.full(len(each), x), each, ".", color=colour, ms=3, alpha=0.4)
            mean, (low, high, _) = _ratio(table, pair, kind)
            ends = [[mean - low], [high - mean]] if np.isfinite([low, high]).all() else None
            label = _short(kind) if at == 0 else None
            axes.errorbar([x], [mean], ends, fmt="o", color=colour, ms=5, capsize=3, label=label)
    axes.axhline(1.0, color="black", lw=0.8, ls="--")
    axes.set(yscale="log", ylim=SHOWN, ylabel="peak dry over very low, trailing over leading")
    _by_pair(axes)


def draw_order(axes: Axes, table: pd.DataFrame, kinds: list[str]) -> None:
    """Share of neighbouring levels in order, leading (hollow) and trailing wheelset (filled)."""
    for place, (kind, colour) in enumerate(zip(kinds, COLOURS, strict=True)):
        for (at, pair), number in itertools.product(enumerate(PAIRS), (1, 2)):
            shares = _ordered(table, pair, number, kind)
            face = colour if number == 2 else "white"
            x = at + 0.18 * (place - 1.5) + 0.06 * (number - 1.5)
            low, high, _ = intervals.of_mean_share(shares)
            mean = float(np.mean(shares))
            ends = [[max(mean - low, 0.0)], [max(high - mean, 0.0)]] if np.isfinite([low, high]).all() else None
            axes.errorbar([x], [mean], ends, fmt="o", color=colour, mfc=face, ms=5, capsize=2)
    axes.axhline(0.95, color="black", lw=0.8, ls="--")
    axes.set(ylim=(0.0, 1.05), ylabel="neighbouring levels in order (filled: trailing)")
    _by_pair(axes)


def _by_pair(axes: Axes) -> None:
    axes.set_xticks(range(len(PAIRS)), list(PAIRS))


def _peaks(table: pd.DataFrame, pair: str, number: int, kind: str) -> np.ndarray:
    """Logarithms (10) of the peaks, (levels, runs)."""
    chosen = (table[PAIR].eq(pair) & table[WHEELSET].eq(float(number))).to_numpy()
    return np.log10(table.loc[chosen, kind].to_numpy(dtype=float)).reshape(-1, len(LEVELS)).T


def _ordered(table: pd.DataFrame, pair: str, number: int, kind: str) -> np.ndarray:
    """Share of the three pairs of neighbouring levels whose peak falls, by track and speed."""
    return np.mean([better > worse for better, worse in itertools.pairwise(_peaks(table, pair, number, kind))], axis=0)


def _decades(table: pd.DataFrame, pair: str, kind: str) -> np.ndarray:
    """Decades by which the peaks of dry and very low stand apart, trailing less leading wheelset, by the runs."""
    leading, trailing = (_peaks(table, pair, number, kind) for number in (1, 2))
    return (trailing[0] - trailing[-1]) - (leading[0] - leading[-1])


def _ratio(table: pd.DataFrame, pair: str, kind: str) -> tuple[float, intervals.Interval]:
    """Geometric mean of the ratio over the runs, and its interval."""
    decades = _decades(table, pair, kind)
    low, high, cases = intervals.of_mean(decades)
    return 10.0 ** float(np.mean(decades)), intervals.Interval(float(10.0**low), float(10.0**high), cases)


def _short(kind: str) -> str:
    return kind.partition(" [")[0]
