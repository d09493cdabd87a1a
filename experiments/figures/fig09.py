"""Figure 9: densities of the estimated lateral forces on both wheelsets for four adhesion conditions.

One run is shown, as in the paper; `force_peaks` repeats it over wheel-rail pairs, tracks and speeds. Which wheelset of
a whole vehicle tells adhesion best is the figure `adhesion_wheelsets`.
"""

import itertools
from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from scipy.signal import welch

from estimators.adhesion.adhesion_creep_forces import AdhesionCreepForces
from estimators.adhesion.adhesion_creep_forces_profile import AdhesionCreepForcesProfile
from estimators.adhesion.channels import RATE, high_pass
from estimators.adhesion.classifier import LEVELS
from estimators.adhesion.creep_force_estimator import SETTLE
from experiments.figures import force_peaks
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, above
from experiments.reporting.plots import BLUE, GREEN, PURPLE, RED
from experiments.reporting.size import Size
from experiments.runs.adhesion import run, scenario, sensors
from experiments.scoring.creep_forces import true_forces
from railsim.measurements import Measurements
from railsim.truth import Truth

TRACK, VEHICLE, SPEED = "straight_erri_low", "class175", 30.0
DURATION, SHORT = 60.0, 30.0  # s
SEGMENT = 4.0  # s of Welch's method
LOWEST, HIGHEST = 1.0, 12.0  # Hz in which peaks are looked for; below, integrated noise of the sensors rises
WHEELSETS = {1: "leading", 2: "trailing"}
COLOURS = dict(zip(LEVELS, (GREEN, BLUE, RED, PURPLE), strict=True))
UNKNOWN, PROFILE, TRUE = "unknown input", "nominal profile known", "true creep force"
FREQUENCY = "frequency [Hz]"
LATERAL, MOMENT = "lateral force [N2/Hz]", "yaw moment [N2 m2/Hz]"
KINDS = ((UNKNOWN, LATERAL), (UNKNOWN, MOMENT), (PROFILE, LATERAL), (TRUE, LATERAL))
NAMES = [f"{kind}: {quantity}" for kind, quantity in KINDS]
"""Columns of the peaks over pairs, tracks and speeds."""


class Fig09(Figure):
    """Peaks of the creep forces' density fall with worse adhesion; the trailing wheelset separates more."""

    def compute(self, size: Size) -> pd.DataFrame:
        columns: dict[str, np.ndarray] = {}
        for level in LEVELS:
            settings = {"track": TRACK, "vehicle": {"name": VEHICLE, "adhesion": level}}
            one = scenario(settings, SPEED, SHORT if size.reduced else DURATION, sensors("mems"))
            truth, measured = run(one, 9, "compiled" if size.reduced else "exudyn")
            columns |= _densities(truth, measured, level)
        peaks = force_peaks.sweep(size, VEHICLE, NAMES, _peaks)
        return pd.concat([pd.DataFrame(columns), peaks], ignore_index=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        table, peaks = _parts(table)
        picture = Picture(figsize=(10.0, 11.5), layout="constrained")
        axes = picture.subplots(3, 2)
        for number, wheelset in WHEELSETS.items():
            _draw(axes[0, number - 1], table, number, UNKNOWN, LATERAL)
            axes[0, number - 1].set_title(f"{wheelset} wheelset: lateral force, {UNKNOWN}")
            _draw(axes[1, number - 1], table, number, PROFILE, LATERAL)
            axes[1, number - 1].set_title(f"{wheelset} wheelset: creep force,\n{PROFILE} (dotted: true)")
            axes[1, number - 1].set_xlabel("frequency [Hz]")
        axes[0, 0].legend(ncols=2)
        force_peaks.draw_ratios(axes[2, 0], peaks, NAMES)
        axes[2, 0].legend(fontsize=8, loc="lower left")
        axes[2, 0].set_title("over wheel-rail pairs: all tracks and speeds, mean")
        force_peaks.draw_order(axes[2, 1], peaks, NAMES)
        picture.suptitle(f"Class 175-like, no braking; spectra: {TRACK}, {SPEED:g} m/s")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        table, pairs = _parts(table)
        for kind, quantity in KINDS:
            what = f"{quantity.partition(' [')[0]}, {kind}"
            peaks = {number: [_peak(table, number, kind, quantity, level) for level in LEVELS] for number in WHEELSETS}
            for number, values in peaks.items():
                least = min(better / worse for better, worse in itertools.pairwise(values))
                name = f"{what}, {WHEELSETS[number]}: peak over that of the next worse adhesion, least of three"
                claims.append(Claim.definite(name, least, above(1.0)))
            apart = [values[0] / values[-1] for values in peaks.values()]
            name = f"{what}: peak dry over very low, trailing over leading"
            claims.append(Claim.definite(name, apart[1] / apart[0], above(1.0)))
            name = f"{what}: peak dry over very low, both wheelsets"
            claims.append(Claim.definite(name, min(apart), above(1.0)))
        return [*claims, *force_peaks.claims(pairs, NAMES, NAMES[-1])]


def _parts(table: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Densities of the run that is shown, and peaks over pairs, tracks and speeds."""
    peaks = table[force_peaks.PAIR].notna().to_numpy()
    return table.loc[~peaks], table.loc[peaks]


def _peaks(truth: Truth, measured: Measurements) -> Iterator[tuple[int, str, float]]:
    """Wheelset, kind and largest density of a run."""
    table = pd.DataFrame(_densities(truth, measured, ""))
    for (kind, quantity), name in zip(KINDS, NAMES, strict=True):
        for number in WHEELSETS:
            yield number, name, _peak(table, number, kind, quantity, "")


def _densities(truth: Truth, measured: Measurements, level: str) -> dict[str, np.ndarray]:
    """Densities of both estimators' forces and of the true creep force, by column."""
    densities: dict[str, np.ndarray] = {}
    plain = AdhesionCreepForces()
    for kind, estimator in ((UNKNOWN, plain), (PROFILE, AdhesionCreepForcesProfile())):
        series = estimator.estimate(measured).series
        valid = series["valid [-]"].to_numpy(float) > 0.5
        for number in WHEELSETS:
            for quantity, name in ((LATERAL, "lateral_creep_force [N]"), (MOMENT, "creep_yaw_moment [N m]")):
                values = series[f"wheelset{number}.{name}"].to_numpy(float)[valid]
                densities[FREQUENCY], densities[_column(number, kind, quantity, level)] = _density(values, RATE)
    for number in WHEELSETS:
        true = high_pass(true_forces(truth, number)["creep"], plain.corner, rate=truth.rate)
        frequency, density = _density(true[round(SETTLE * truth.rate) :], truth.rate)
        densities[_column(number, TRUE, LATERAL, level)] = np.interp(densities[FREQUENCY], frequency, density)
    return densities


def _density(values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    frequency, density = welch(values, rate, nperseg=round(SEGMENT * rate))
    kept = (frequency > 0.0) & (frequency <= 20.0)
    return frequency[kept], density[kept]


def _column(number: int, kind: str, quantity: str, level: str) -> str:
    return f"wheelset{number}, {kind}, {level}: {quantity}"


def _peak(table: pd.DataFrame, number: int, kind: str, quantity: str, level: str) -> float:
    frequency = table[FREQUENCY].to_numpy(float)
    inside = (frequency >= LOWEST) & (frequency <= HIGHEST)
    return float(table[_column(number, kind, quantity, level)].to_numpy(float)[inside].max())


def _draw(axes: Axes, table: pd.DataFrame, number: int, kind: str, quantity: str) -> None:
    frequency = table[FREQUENCY].to_numpy(float)
    for level, colour in COLOURS.items():
        values = table[_column(number, kind, quantity, level)].to_numpy(float)
        axes.plot(frequency, values, color=colour, lw=1.6, label=level)
        if kind == PROFILE:
            true = table[_column(number, TRUE, quantity, level)].to_numpy(float)
            axes.plot(frequency, true, color=colour, lw=1.1, ls=":")
    axes.set(xlim=(0.5, HIGHEST), ylim=(1e3, 1e7), yscale="log", ylabel="density [N²/Hz]")
