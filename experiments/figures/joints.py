"""Joints on 2 km of jointed track: what is found, and how well its size is known, from 15 km/h to 45 m/s."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture
from scipy.special import erf

from estimators.track.dipped_joints import DippedJoints
from experiments.bounds.joints import bounds
from experiments.figures.interface import Figure
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, at_least, at_most, below, between
from experiments.reporting.plots import BLACK, BLUE, GREEN, GREY, ORANGE, RED
from experiments.reporting.size import Size
from experiments.scoring.joints import matched
from railsim import measure, simulate
from railsim.analysis.statistics import root_mean_square
from railsim.scenario import Scenario

SPEEDS = (4.2, 8.0, 15.0, 30.0, 45.0)  # m/s; 4.2 is 15 km/h
SLOW = 10.0  # m/s; below it the compiled engine runs in any case: Exudyn would need ten minutes
SEEDS = (1, 2, 3)
LENGTH = 2000.0  # m
SENSORS: dict[str, tuple[str, ...]] = {
    "gyros, accelerometer": ("roll", "pitch", "z"),
    "gyros": ("roll", "pitch"),
    "pitch gyro": ("pitch",),
}
COLOURS = {"gyros, accelerometer": BLUE, "gyros": ORANGE, "pitch gyro": RED}
FULL = "gyros, accelerometer"
PRECISION = RECALL = 0.95
DEPTH = 0.15


class Joints(Figure):
    """MEMS sensors on the bogie, tachometer 1 % wrong; joints abreast and staggered; three seeds of noise each."""

    def compute(self, size: Size) -> pd.DataFrame:
        tables = []
        for speed in size.of(SPEEDS, SPEEDS[2::2], SPEEDS[-1:]):
            scenario = Scenario.build(_values(speed, FULL))
            truth = simulate(scenario, engine="compiled" if size.reduced or speed < SLOW else "exudyn")
            for sensors in SENSORS:
                suite = Scenario.build(_values(speed, sensors))
                for seed in SEEDS[:1] if size.reduced else SEEDS:
                    measured = measure(truth, suite, seed=seed).measurements
                    found = matched(DippedJoints().estimate(measured), truth)
                    found = bounds(found, truth, measured, speed)
                    tables.append(found.assign(**{"speed [m/s]": speed, "sensors": sensors, "seed [-]": seed}))
        return pd.concat(tables, ignore_index=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 4.8), layout="constrained")
        counts, errors, scatter = picture.subplots(1, 3, width_ratios=(1, 1, 1.15))
        for sensors, colour in COLOURS.items():
            parts = {speed: _part(table, sensors, speed) for speed in _speeds(table)}
            speeds = list(parts)
            counts.plot(speeds, [_recall(part) for part in parts.values()], "o-", color=colour, label=sensors)
            counts.plot(speeds, [_precision(part) for part in parts.values()], "x:", color=colour)
            errors.plot(
                speeds, [100 * root_mean_square(_depth_error(part)) for part in parts.values()], "o-", color=colour
            )
            errors.plot(speeds, [100 * _stated(part) for part in parts.values()], "_", color=colour, ms=16, mew=2)
            errors.plot(
                speeds, [100 * root_mean_square(_hits(part)["bound [-]"]) for part in parts.values()], ":", color=colour
            )
        counts.plot([], [], "x:", color=GREY, label="precision (line: recall)")
        counts.axhline(RECALL, color=BLACK, lw=0.8, ls="--")
        counts.set(ylim=(0.8, 1.01), xlabel="speed [m/s]", ylabel="recall, precision [-]")
        counts.legend(loc="lower left", frameon=False, fontsize=8)
        errors.plot([], [], "_", color=GREY, ms=16, mew=2, label="stated standard deviation")
        errors.plot([], [], ":", color=GREY, label="Cramer-Rao bound")
        errors.axhline(100 * DEPTH, color=BLACK, lw=0.8, ls="--")
        errors.set(ylim=(0.0, 22.0), xlabel="speed [m/s]", ylabel="rms error of depth [%]")
        errors.legend(loc="lower left", frameon=False, fontsize=8)
        part = _part(table, FULL, max(_speeds(table)))
        both = part["true side"] == "both"
        for which, colour, name in ((both, BLUE, "joints abreast"), (~both, GREEN, "one rail alone")):
            scatter.plot(
                1e3 * part["true depth [m]"][which], 1e3 * part["depth [m]"][which], "o", ms=3, color=colour, label=name
            )
        line = np.array([0.0, 6.5])
        for factor in (1 - DEPTH, 1.0, 1 + DEPTH):
            scatter.plot(line, factor * line, color=BLACK, lw=0.7, ls="-" if factor == 1 else "--")
        scatter.set(xlim=(0, 6.5), ylim=(0, 7.5), xlabel="true depth, mean of both rails [mm]", ylabel="found [mm]")
        scatter.set_title(f"{max(_speeds(table)):g} m/s, {FULL}", fontsize=10)
        scatter.legend(loc="upper left", frameon=False, fontsize=8)
        picture.suptitle(f"Dipped joints on {LENGTH:g} m of jointed track, MEMS sensors on the bogie")
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        for speed in _speeds(table):
            part, where = _part(table, FULL, speed), f"{speed:g} m/s, {FULL}"
            claims += [
                Claim.sampled(f"{where}: precision", _precision(part), at_least(PRECISION), _precise(part)),
                Claim.sampled(f"{where}: recall", _recall(part), at_least(RECALL), _recalled(part)),
                _rms_claim(f"{where}: rms error of depth", [part], DEPTH),
            ]
        for sensors in tuple(SENSORS)[1:]:
            parts = [_part(table, sensors, speed) for speed in _speeds(table)]
            worst = min(min(_precision(part), _recall(part)) for part in parts)
            each = intervals.least([found for part in parts for found in (_precise(part), _recalled(part))])
            claims += [
                Claim.sampled(f"{sensors}: worst precision or recall of all speeds", worst, at_least(RECALL), each),
                _rms_claim(f"{sensors}: worst rms error of depth", parts, DEPTH),
            ]
        return claims + _quality([_part(table, FULL, speed) for speed in _speeds(table)])


def _quality(parts: list[dict[str, np.ndarray]]) -> list[Claim]:
    """What else is said of a joint, worst of all speeds."""
    hits = [_hits(part) for part in parts]
    closest = max(root_mean_square(_depth_error(part)) / root_mean_square(_hits(part)["bound [-]"]) for part in parts)
    allowed, drawn = (max(_allowed(part, name) for part in parts) for name in ("bound [-]", "bound as drawn [-]"))
    single = [(part, np.abs(_depth_error(part)) <= DEPTH) for part in parts]
    sides = [(part, part["side"] == part["true side"]) for part in hits]
    inside = [(part, _deviation(part) <= 2.0) for part in parts]
    worst = max(inside, key=lambda pair: abs(float(np.mean(pair[1])) - 0.95))
    position = [_by_joint(part, part["s [m]"] - part["true s [m]"]) for part in hits]
    return [
        _least_share("joints whose depth is within 15 %, each by itself: least share", single),
        Claim.definite("the same for an estimator at the Cramer-Rao bound, rough below 1 m too", allowed, below(0.95)),
        Claim.definite("the same, track smooth below 1 m as the shipped one is", drawn, at_least(0.95)),
        Claim.sampled(
            "rms error of depth over the bound, largest of all speeds",
            closest,
            at_most(1.5),
            intervals.largest(
                [_scaled(_depth_interval(part), 1.0 / root_mean_square(_hits(part)["bound [-]"])) for part in parts]
            ),
        ),
        Claim.sampled(
            "depths within two stated standard deviations: share",
            float(np.mean(worst[1])),
            between(0.90, 0.98),
            _share_interval(*worst),
        ),
        Claim.sampled(
            "rms error of position",
            max(root_mean_square(part["s [m]"] - part["true s [m]"]) for part in hits),
            at_most(0.125, "m"),
            intervals.largest([intervals.of_rms(values) for values in position]),
        ),
        _least_share("rail named rightly: least share", sides),
    ]


def _by_joint(part: dict[str, np.ndarray], values: np.ndarray) -> np.ndarray:
    """Root mean square of a value over the seeds, for each joint: what one joint shows by several seeds is alike."""
    joints = _hits(part)["true s [m]"]
    return np.array([root_mean_square(values[joints == joint]) for joint in np.unique(joints)])


def _share_interval(part: dict[str, np.ndarray], hits: np.ndarray) -> intervals.Interval:
    """Of a share of the joints that were found; a case is a joint."""
    joints = _hits(part)["true s [m]"]
    cases = [hits[joints == joint] for joint in np.unique(joints)]
    return intervals.of_mean_share(np.array([case.mean() for case in cases]), np.array([len(case) for case in cases]))


def _least_share(text: str, shares: list[tuple[dict[str, np.ndarray], np.ndarray]]) -> Claim:
    worst = min(float(np.mean(hits)) for _, hits in shares)
    return Claim.sampled(text, worst, at_least(0.95), intervals.least([_share_interval(*pair) for pair in shares]))


def _depth_interval(part: dict[str, np.ndarray]) -> intervals.Interval:
    return intervals.of_rms(_by_joint(part, _depth_error(part)))


def _scaled(interval: intervals.Interval, factor: float) -> intervals.Interval:
    return intervals.Interval(factor * interval.low, factor * interval.high, interval.cases)


def _rms_claim(text: str, parts: list[dict[str, np.ndarray]], limit: float) -> Claim:
    """Rms error of the depth, the worst of several speeds."""
    worst = max(root_mean_square(_depth_error(part)) for part in parts)
    return Claim.sampled(text, worst, at_most(limit), intervals.largest([_depth_interval(part) for part in parts]))


def _recalled(part: dict[str, np.ndarray]) -> intervals.Interval:
    """Of the recall: a case is a joint, met once by each seed."""
    joints = part["true s [m]"][np.isfinite(part["true s [m]"])]
    found = np.isfinite(part["s [m]"])[np.isfinite(part["true s [m]"])]
    return intervals.of_mean_share(np.array([found[joints == joint].mean() for joint in np.unique(joints)]))


def _precise(part: dict[str, np.ndarray]) -> intervals.Interval:
    """Of the precision: a case is an event."""
    return intervals.of_share(np.isfinite(part["true s [m]"])[np.isfinite(part["s [m]"])])


def _values(speed: float, sensors: str) -> dict[str, Any]:
    axes = SENSORS[sensors]
    common = {"name": "bogie", "body": "bogie", "rate": 256, "errors": "mems"}
    fitted: list[dict[str, Any]] = [{"kind": "gyro", "axes": [one for one in axes if one != "z"], **common}]
    if "z" in axes:
        fitted.append({"kind": "accelerometer", "axes": ["z"], **common})
    fitted.append({"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.01})
    return {
        "track": "jointed_60ft",
        "vehicle": "class175",
        "speed": {"kind": "constant", "speed": speed},
        "start": 40.0,
        "duration": round(LENGTH / speed, 2),
        "sensors": fitted,
    }


def _speeds(table: pd.DataFrame) -> list[float]:
    return sorted({float(speed) for speed in np.asarray(table["speed [m/s]"])})


def _part(table: pd.DataFrame, sensors: str, speed: float) -> dict[str, np.ndarray]:
    """Columns of all seeds of one speed and choice of sensors."""
    rows = (np.asarray(table["sensors"]) == sensors) & (np.asarray(table["speed [m/s]"]) == speed)
    return {str(name): np.asarray(table[name])[rows] for name in table.columns}


def _hits(part: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    both = np.isfinite(part["true s [m]"]) & np.isfinite(part["s [m]"])
    return {name: values[both] for name, values in part.items()}


def _recall(part: dict[str, np.ndarray]) -> float:
    return float(np.mean(np.isfinite(part["s [m]"])[np.isfinite(part["true s [m]"])]))


def _precision(part: dict[str, np.ndarray]) -> float:
    return float(np.mean(np.isfinite(part["true s [m]"])[np.isfinite(part["s [m]"])]))


def _depth_error(part: dict[str, np.ndarray]) -> np.ndarray:
    """Relative, of the joints that were found."""
    hits = _hits(part)
    return hits["depth [m]"] / hits["true depth [m]"] - 1


def _deviation(part: dict[str, np.ndarray]) -> np.ndarray:
    """Error of the depth over its stated standard deviation."""
    hits = _hits(part)
    return np.abs(hits["depth [m]"] - hits["true depth [m]"]) / hits["depth_std [m]"]


def _stated(part: dict[str, np.ndarray]) -> float:
    """Root mean square of the stated relative standard deviation."""
    hits = _hits(part)
    return root_mean_square(hits["depth_std [m]"] / hits["true depth [m]"])


def _allowed(part: dict[str, np.ndarray], name: str) -> float:
    """Share of the joints that an estimator which reaches the bound would have within `DEPTH`."""
    return float(np.mean(erf(DEPTH / np.sqrt(2) / _hits(part)[name])))
