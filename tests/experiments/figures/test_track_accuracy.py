"""Claims of the figure of track accuracy: held by good numbers, not held by bad ones."""

import pandas as pd
import pytest

from experiments.figures.accuracy_claims import JUDGED
from experiments.figures.track_accuracy import TrackAccuracy
from experiments.runs.track import POSITIONS, noise_limit
from experiments.runs.track_accuracy import (
    ACCELEROMETER,
    AXLEBOXES,
    DISPLACEMENT,
    FUSED,
    GRADES,
    GYRO,
    LENGTHS,
    PLACED,
    PLAIN,
    RUNS,
    WITH_AXLEBOXES,
    alone,
    scenario,
)
from railsim import measure, simulate
from railsim.sensors.accelerometer import AXLEBOX


def _table(error: float, share: float) -> pd.DataFrame:
    """Every row that the claims look at, with one error [mm] and one share of points within two deviations."""
    common = {"estimator": FUSED, "quantity": "vertical", "points": 1000, "rms error [mm]": error, "true rms [mm]": 1.0}
    common |= {"std [mm]": 0.1, "bound [mm]": 0.1, "within 2 std [-]": share}
    rows = [
        common | {"part": "accuracy", "speed [m/s]": speed, "grade": grade, "band": band}
        for speed in LENGTHS
        for grade in GRADES
        for band in ("d1", "d2", "d3")
    ]
    good = error < 0.2
    long = {ACCELEROMETER: 2 * error if good else error, GYRO: error}
    long |= {AXLEBOXES: 0.9 if good else 0.1, DISPLACEMENT: 0.1 if good else 0.9}
    rows += [
        rows[1] | {"speed [m/s]": speed, "grade": grade, "estimator": name, "band": "d2", "rms error [mm]": value}
        for speed in LENGTHS
        for grade in GRADES
        for name, value in long.items()
    ]
    others = [(PLAIN, "lateral", 0.5), (FUSED, "lateral", error), ("alignment_lateral", "lateral", error)]
    others += [(name, f"{side}_vertical", error) for name in (WITH_AXLEBOXES, AXLEBOXES) for side in ("left", "right")]
    rows += [
        rows[0] | {"speed [m/s]": speed, "estimator": name, "quantity": quantity, "rms error [mm]": value}
        for speed in LENGTHS
        for name, quantity, value in others
    ]
    uneven, even = (2.0, 1.0) if good else (1.0, 2.0)
    rows += [
        rows[0]
        | {"part": "place", "speed [m/s]": PLACED, "estimator": name, "place [m]": x}
        | {"rms error [mm]": 0.1 * (factor if x > 0.0 else 1.0)}
        for x in POSITIONS
        for name, factor in ((ACCELEROMETER, uneven), (GYRO, even))
    ]
    rows += [
        common
        | {
            "quantity": quantity,
            "part": "coverage",
            "speed [m/s]": speed,
            "grade": "mems",
            "band": band,
            "track": track,
            "seed": seed,
            "engine": "compiled",
            "within 2 std [-]": share + 1e-3 * seed,
        }
        for track, (_, _, speeds) in RUNS.items()
        for speed in speeds
        for seed in range(3)
        for band in ("d1", "d2")
        for quantity in JUDGED
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(("error", "share", "held"), [(0.12, 0.95, True), (0.31, 0.99, False), (0.31, 0.8, False)])
def test_claims_follow_the_numbers(error: float, share: float, held: bool):
    claims = TrackAccuracy().check(_table(error, share))
    in_all = 2 * len(GRADES) + 1 + len(GRADES) + 2 + 2 * 3
    assert len(claims) == in_all + 4 * len(LENGTHS) + 2 * len(JUDGED) * (9 + 1)
    assert {claim.held for claim in claims} == {held}


def test_coverage_of_a_single_vehicle_is_undecided():
    table = _table(0.12, 0.99)
    claims = TrackAccuracy().check(table.loc[~table["seed"].isin([1, 2]).to_numpy()])
    single = [claim for claim in claims if "two standard deviations" in claim.claim and "all tracks" not in claim.claim]
    assert {(claim.held, claim.cases) for claim in single} == {(None, 1)}


def test_picture_shows_every_panel():
    panels = TrackAccuracy().draw(_table(0.12, 0.95)).axes
    assert len(panels) == 8
    assert all(axes.get_title() for axes in panels)


def test_bound_of_axleboxes_is_the_noise_limit_where_the_track_is_large():
    """At high speed the prior knowledge of the track tells nothing that the sensors do not tell better."""
    run = scenario("manchester", 45.0, "mems", "all", duration=6.0)
    found = alone(measure(simulate(run, engine="compiled"), run).measurements)
    limit = noise_limit(AXLEBOX.noise_density / 2**0.5, 45.0, "vertical", "D1", 2)
    assert found[AXLEBOXES, "vertical", "d1"] == pytest.approx(limit, rel=0.1)
    assert found[AXLEBOXES, "left_vertical", "d1"] > found[AXLEBOXES, "vertical", "d1"]
