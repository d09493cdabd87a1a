"""Claims of the figure `track_accuracy`."""

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from experiments.reporting import intervals
from experiments.reporting.claims import HONEST, Claim, at_least, at_most
from experiments.runs.track import noise_limit
from experiments.runs.track_accuracy import (
    ACCELEROMETER,
    AXLEBOXES,
    DISPLACEMENT,
    FUSED,
    GRADES,
    GYRO,
    PLAIN,
    WITH_AXLEBOXES,
)
from railsim.analysis.statistics import root_mean_square
from railsim.sensors.accelerometer import AXLEBOX

LIMIT = 0.2  # mm rms, vertical D1 and D2 by the fused estimate above 8 m/s
APART = 0.3  # mm rms, left and right rail with axleboxes
BETTER = 1.5  # illustrative: error of the accelerometer over that of the gyro at the lowest speed
LOST = 0.5  # of a band's true size: an error above it leaves nothing of use
JUDGED = ("vertical", "cross_level", "lateral")


def pick(table: pd.DataFrame, **wanted: Any) -> pd.DataFrame:
    """Rows with those values."""
    chosen = np.ones(len(table), dtype=bool)
    for name, value in wanted.items():
        chosen &= table[name].eq(value).to_numpy()
    return where(table, chosen)


def where(table: pd.DataFrame, chosen: Any) -> pd.DataFrame:
    """Rows that are chosen."""
    return table.loc[np.asarray(chosen)]


def cases(rows: pd.DataFrame) -> Iterator[tuple[str, float, pd.DataFrame]]:
    """Track, speed and rows of each run of the coverage."""
    for track in dict.fromkeys(rows["track"]):
        of_track = pick(rows, track=track)
        for speed in sorted(set(of_track["speed [m/s]"])):
            yield str(track), float(speed), pick(of_track, **{"speed [m/s]": speed})


def share(rows: pd.DataFrame) -> float:
    """Share of points within two standard deviations."""
    return float(np.average(rows["within 2 std [-]"], weights=rows["points"]))


def accuracy_claims(table: pd.DataFrame) -> Iterator[Claim]:
    """What the table of errors must bear out."""
    rows = pick(table, part="accuracy")
    speeds = sorted(set(rows["speed [m/s]"]))
    yield from _fused(rows)
    yield from _gyro(rows, speeds[0])
    yield from _by_position(pick(table, part="place", band="d1", quantity="vertical"))
    yield from _long_waves(rows, (speeds[0], speeds[-1]))
    for speed in speeds:
        yield from _lateral(pick(rows, grade="mems", band="d1", quantity="lateral", **{"speed [m/s]": speed}), speed)
    for speed in speeds:
        yield from _rails(pick(rows, grade="mems", band="d1", **{"speed [m/s]": speed}), speed)


def honesty_claims(table: pd.DataFrame) -> Iterator[Claim]:
    """How many points lie within two standard deviations."""
    every = where(table, table["part"].eq("coverage") & table["engine"].ne("exudyn"))
    for quantity, band in itertools.product(JUDGED, ("d1", "d2")):
        rows = pick(every, quantity=quantity, band=band)
        name = f"{quantity.replace('_', ' ')} {band.upper()} within two standard deviations"
        for track, speed, case in cases(rows):
            yield _honest(f"{name}, {track}, {speed:g} m/s", case)
        yield _honest(f"{name}, all tracks and speeds", rows)


def _honest(text: str, rows: pd.DataFrame) -> Claim:
    """A case is a vehicle on a track."""
    interval = intervals.of_mean_share(rows["within 2 std [-]"].to_numpy(), rows["points"].to_numpy())
    return Claim.sampled(text, share(rows), HONEST, interval)


def _only(rows: pd.DataFrame, column: str = "rms error [mm]", **wanted: Any) -> float:
    """The value of the one row that is meant."""
    return float(pick(rows, **wanted)[column].to_numpy(float)[0])


def _fused(rows: pd.DataFrame) -> Iterator[Claim]:
    for grade, band in itertools.product(GRADES, ("d1", "d2")):
        fused = pick(rows, estimator=FUSED, quantity="vertical", band=band, grade=grade)
        fused = where(fused, fused["speed [m/s]"] >= 8.0)
        at = int(np.argmax(fused["rms error [mm]"].to_numpy()))
        worst, bound = (float(fused[name].to_numpy()[at]) for name in ("rms error [mm]", "bound [mm]"))
        what = f"fused vertical {band.upper()}, {grade}, 8 m/s and above: largest rms error (bound {bound:.3f} mm)"
        yield Claim.definite(what, worst, at_most(LIMIT, "mm"))
    fused = pick(rows, estimator=FUSED, quantity="vertical", grade="mems")
    fused = where(fused, fused["band"].isin(["d1", "d2"]) & fused["speed [m/s]"].le(15.0))
    ratio = float(np.max(fused["rms error [mm]"].to_numpy() / fused["bound [mm]"].to_numpy()))
    what = "fused vertical D1 and D2, mems, up to 15 m/s: rms error over the Cramer-Rao bound, largest"
    yield Claim.definite(what, ratio, at_most(1.3))


def _gyro(rows: pd.DataFrame, speed: float) -> Iterator[Claim]:
    """The paper's claim: at low speed a pitch gyro beats an accelerometer of the same grade."""
    for grade in GRADES:
        both = pick(rows, grade=grade, quantity="vertical", band="d2", **{"speed [m/s]": speed})
        pair = [
            [_only(both, column, estimator=name) for name in (ACCELEROMETER, GYRO)]
            for column in ("rms error [mm]", "bound [mm]")
        ]
        ratio = pair[0][0] / pair[0][1]
        what = (
            f"{speed:g} m/s, vertical D2, {grade}: accelerometer's error over the gyro's "
            f"({pair[0][0]:.2f} and {pair[0][1]:.2f} mm; bounds {pair[1][0]:.2f} and {pair[1][1]:.2f})"
        )
        yield Claim.definite(what, ratio, at_least(BETTER))


def _by_position(rows: pd.DataFrame) -> Iterator[Claim]:
    for name, target in ((ACCELEROMETER, at_least(1.3)), (GYRO, at_most(1.2))):
        one = pick(rows, estimator=name)
        errors = [root_mean_square(group["rms error [mm]"]) for _, group in one.groupby("place [m]")]
        ratio = max(errors) / min(errors)
        what = f"vertical D1 over places on the bogie, largest error over smallest: {name}"
        yield Claim.definite(what, ratio, target)


def _long_waves(rows: pd.DataFrame, speeds: tuple[float, float]) -> Iterator[Claim]:
    for speed in speeds:
        peak = 2e-3 * (2.0 * np.pi * speed / 30.0) ** 2  # of a wave of 2 mm and 30 m
        noise = noise_limit(AXLEBOX.noise_density, speed, "vertical", "D2", 2)
        for name, grade, lost in (
            (AXLEBOXES, "mems", True),
            (DISPLACEMENT, "industrial", False),
            (DISPLACEMENT, "mems", False),
        ):
            row = pick(rows, estimator=name, grade=grade, quantity="vertical", band="d2", **{"speed [m/s]": speed})
            error, true, bound = (_only(row, one) for one in ("rms error [mm]", "true rms [mm]", "bound [mm]"))
            of = f"±100 g {name}" if lost else f"{name}, {grade}"
            what = f"{of}, {speed:g} m/s: error of D2 over its true size (bound {bound / true:.2f}"
            what += f"; 2 mm at 30 m is {peak:.3f} m/s2, noise alone {1e3 * noise:.2f} mm)" if lost else ")"
            target = at_least(LOST, meaning="lost") if lost else at_most(LOST, meaning="kept")
            yield Claim.definite(what, error / true, target)


def _lateral(rows: pd.DataFrame, speed: float) -> Iterator[Claim]:
    plain = _only(rows, estimator=PLAIN)
    for name in ("alignment_lateral", FUSED):
        error, bound = (_only(rows, column, estimator=name) for column in ("rms error [mm]", "bound [mm]"))
        what = f"lateral D1, {speed:g} m/s: {name}'s error over the bogie's path's ({error:.2f} mm, bound {bound:.2f})"
        yield Claim.definite(what, error / plain, at_most(0.5))


def _rails(rows: pd.DataFrame, speed: float) -> Iterator[Claim]:
    for name in (WITH_AXLEBOXES, AXLEBOXES):
        sides = where(rows, rows["estimator"].eq(name) & rows["quantity"].isin(["left_vertical", "right_vertical"]))
        worst, bound = (float(np.max(sides[column].to_numpy(float))) for column in ("rms error [mm]", "bound [mm]"))
        what = f"{name}, {speed:g} m/s: D1 of the worse rail (bound {bound:.2f} mm)"
        yield Claim.definite(what, worst, at_most(APART, "mm"))
