"""Which wheelset of a whole vehicle tells adhesion best: densities of the forces on all four, and their errors.

Ward et al. (2011), section 4.2 and figure 9, ask it of the half vehicle's two wheelsets. A level is told by a wheelset
where its density's peak falls from each level to the next worse one, on the same track at the same speed.
"""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from scipy.signal import welch

from estimators.adhesion.adhesion_creep_forces import AdhesionCreepForces
from estimators.adhesion.adhesion_creep_forces_profile import AdhesionCreepForcesProfile
from estimators.adhesion.adhesion_level import AdhesionLevel
from estimators.adhesion.channels import RATE, high_pass
from estimators.adhesion.classifier import LEVELS
from estimators.adhesion.creep_force_estimator import SETTLE
from experiments.figures.interface import Figure
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, above, at_least, at_most
from experiments.reporting.plots import BLUE, GREEN, ORANGE, PURPLE
from experiments.reporting.size import Size
from experiments.runs.adhesion import run, scenario, sensors
from experiments.runs.adhesion_unseen import DURATION, SPEEDS, TRACKS
from experiments.runs.unseen_tracks import write_unseen
from experiments.scoring.creep_forces import true_forces
from experiments.scoring.score import score
from railsim.measurements import Measurements
from railsim.scratch import scratch_folder
from railsim.truth import Truth
from railsim.vehicles.class175_whole import Class175Whole

VEHICLE, APART, FIRST = "class175_whole", 8.0, 60.0  # FIRST: m, where the leading bogie begins
PAYLOAD = {"payload": {"mass": 0.25 * Class175Whole().body_mass}}  # kg, of every second speed, unknown to the recording
WHEELSETS = (1, 2, 3, 4)
NAMES = {1: "1, leads in front", 2: "2, trails in front", 3: "3, leads behind", 4: "4, trails behind"}
LOWEST, HIGHEST, SEGMENT = 1.0, 12.0, 4.0  # Hz, Hz, s: as of figure 9
NET, MOMENT, CREEP, TRUE = "net lateral force", "yaw moment", "creep force, gravity taken out", "true creep force"
COLOURS = {NET: ORANGE, MOMENT: BLUE, CREEP: GREEN, TRUE: PURPLE}
FORCE_ERROR, FORCE_WITHIN = "lateral force rms error over load [-]", "lateral force within 2 std [-]"
MOMENT_ERROR, MOMENT_WITHIN = "yaw moment rms error over load [-]", "yaw moment within 2 std [-]"
RIGHT, TOLD = "level right [-]", "windows that count [-]"
ALLOWED, COVERED = 0.01, 0.85


class AdhesionWheelsets(Figure):
    """Forces on four wheelsets over unseen tracks, speeds and levels, half of the runs laden."""

    def compute(self, size: Size) -> pd.DataFrame:
        tracks, speeds = size.of((TRACKS, SPEEDS), (TRACKS[:2], SPEEDS[1:3]), (TRACKS[:1], SPEEDS[2:3]))
        rows: list[dict[str, float | str]] = []
        with scratch_folder() as folder:
            files = write_unseen(Path(folder))
            for place, (track, speed) in enumerate((track, speed) for track in tracks for speed in speeds):
                for number, level in enumerate(LEVELS):
                    truth, measured = _measured(str(files.get(track, track)), speed, level, 100 * place + number, size)
                    shared = {"track": track, "speed [m/s]": speed, "condition": level}
                    rows += [{**shared, **row} for row in _rows(truth, measured)]
        return pd.DataFrame(rows)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 8.4), layout="constrained")
        order, apart, error, within = picture.subplots(2, 2).ravel()
        _bars(order, {what: [float(np.mean(_ordered(table, n, what))) for n in WHEELSETS] for what in COLOURS})
        order.set(ylabel="pairs of neighbouring levels in order", ylim=(0.0, 1.05))
        picture.legend(*order.get_legend_handles_labels(), loc="outside upper center", ncols=4)
        _bars(apart, {what: [float(np.mean(_apart(table, n, what))) for n in WHEELSETS] for what in COLOURS})
        apart.set(ylabel="decades between the peaks of dry and very low")
        for axes, columns, limit, label in (
            (error, (FORCE_ERROR, MOMENT_ERROR), ALLOWED, "rms error over the load of a wheelset; dashed: at most"),
            (within, (FORCE_WITHIN, MOMENT_WITHIN), COVERED, "share within two stated deviations; dashed: at least"),
        ):
            kinds = zip((NET, MOMENT), columns, strict=True)
            _bars(axes, {what: [float(np.mean(_of(table, n, column))) for n in WHEELSETS] for what, column in kinds})
            axes.axhline(limit, color="black", lw=0.9, ls="--")
            axes.set(ylabel=label)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        for what in COLOURS:
            for number in WHEELSETS:
                shares = _ordered(table, number, what)
                name = f"{what}, wheelset {NAMES[number]}: pairs of neighbouring levels in order"
                held = at_least(0.95)
                interval = intervals.of_mean_share(shares)
                claims.append(Claim.sampled(name, float(np.mean(shares)), held, interval))
            for leading, where in ((1, "in front"), (3, "behind")):
                more = _apart(table, leading + 1, what) - _apart(table, leading, what)
                name = f"{what}: decades between dry and very low, trailing less leading wheelset {where}"
                claims.append(Claim.sampled(name, float(np.mean(more)), above(0.0), intervals.of_mean(more)))
        for number in WHEELSETS:
            for column, target in (
                (FORCE_ERROR, at_most(ALLOWED)),
                (MOMENT_ERROR, at_most(ALLOWED)),
                (FORCE_WITHIN, at_least(COVERED)),
                (MOMENT_WITHIN, at_least(COVERED)),
            ):
                values = _of(table, number, column)
                name = f"wheelset {NAMES[number]}: {column}"
                claims.append(Claim.sampled(name, float(np.mean(values)), target, intervals.of_mean(values)))
        right, told = _of(table, 1, RIGHT), _of(table, 1, TOLD)
        known = np.isfinite(right)
        shares, weights = right[known], told[known]
        value = float(np.average(shares, weights=weights)) if known.any() else None
        interval = intervals.of_mean_share(shares, weights)
        claims.append(Claim.sampled("level right, of the windows that are told", value, at_least(0.9), interval))
        name = "windows of which a level is told"
        return [*claims, Claim.sampled(name, float(np.mean(told)), at_least(0.9), intervals.of_mean_share(told))]


def _measured(track: str, speed: float, level: str, seed: int, size: Size) -> tuple[Truth, Measurements]:
    """One run, laden at every second speed."""
    vehicle = {"name": VEHICLE, "adhesion": level}
    real = vehicle | (PAYLOAD if SPEEDS.index(speed) % 2 else {})
    duration, suite = size.of(DURATION, DURATION, 16.0), sensors("mems", apart=APART)
    true, stated = (
        scenario({"track": track, "start": FIRST, "vehicle": one}, speed, min(duration, 1200.0 / speed), suite)
        for one in (real, vehicle)
    )
    return run(true, seed, stated=stated)


def _rows(truth: Truth, measured: Measurements) -> Iterator[dict[str, float | str]]:
    """One row a wheelset."""
    net, creep, level = (
        one.estimate(measured) for one in (AdhesionCreepForces(), AdhesionCreepForcesProfile(), AdhesionLevel(hop=1.0))
    )
    scores, levels = score(net, truth), score(level, truth)
    for number in WHEELSETS:
        name = f"wheelset{number}"
        true = high_pass(true_forces(truth, number)["creep"], 0.3, rate=truth.rate)[round(SETTLE * truth.rate) :]
        row: dict[str, float | str] = {
            "wheelset": float(number),
            f"{NET} [N2/Hz]": _peak(_valid(net.series, f"{name}.lateral_creep_force [N]"), RATE),
            f"{MOMENT} [N2 m2/Hz]": _peak(_valid(net.series, f"{name}.creep_yaw_moment [N m]"), RATE),
            f"{CREEP} [N2/Hz]": _peak(_valid(creep.series, f"{name}.lateral_creep_force [N]"), RATE),
            f"{TRUE} [N2/Hz]": _peak(true, truth.rate),
            RIGHT: levels.get(RIGHT, np.nan),
            TOLD: levels[TOLD],
        }
        judged = (FORCE_ERROR, FORCE_WITHIN, MOMENT_ERROR, MOMENT_WITHIN)
        yield row | {column: scores[f"{name} {column}"] for column in judged}


def _valid(series: pd.DataFrame, column: str) -> np.ndarray:
    return series[column].to_numpy(float)[series["valid [-]"].to_numpy(float) > 0.5]


def _peak(values: np.ndarray, rate: float) -> float:
    """Largest density, as figure 9 has it."""
    frequency, density = welch(values, rate, nperseg=round(SEGMENT * rate))
    return float(density[(frequency >= LOWEST) & (frequency <= HIGHEST)].max())


def _of(table: pd.DataFrame, number: int, column: str) -> np.ndarray:
    """Values of one wheelset by the runs."""
    return table.loc[table["wheelset"] == number, column].to_numpy(float)


def _peaks(table: pd.DataFrame, number: int, what: str) -> np.ndarray:
    """Logarithms (10) of the peaks by track and speed, and by level, (cases, 4)."""
    unit = "[N2 m2/Hz]" if what == MOMENT else "[N2/Hz]"
    return np.log10(_of(table, number, f"{what} {unit}")).reshape(-1, len(LEVELS))


def _ordered(table: pd.DataFrame, number: int, what: str) -> np.ndarray:
    """Share of the three pairs of neighbouring levels whose peak falls, by track and speed."""
    peaks = _peaks(table, number, what).T
    return np.mean([better > worse for better, worse in pairwise(peaks)], axis=0)


def _apart(table: pd.DataFrame, number: int, what: str) -> np.ndarray:
    """Decades between the peaks of the best and the worst level, by track and speed."""
    peaks = _peaks(table, number, what)
    return peaks[:, 0] - peaks[:, -1]


def _bars(axes: Axes, groups: dict[str, list[float]]) -> None:
    """One group of bars a wheelset."""
    width = 0.8 / len(groups)
    for place, (what, values) in enumerate(groups.items()):
        at = np.arange(len(WHEELSETS)) + (place - (len(groups) - 1) / 2.0) * width
        axes.bar(at, values, 0.92 * width, color=COLOURS[what], label=what)
    labels = ["wheelset " + NAMES[number].replace(", ", ",\n") for number in WHEELSETS]
    axes.set_xticks(range(len(WHEELSETS)), labels, fontsize=8)
