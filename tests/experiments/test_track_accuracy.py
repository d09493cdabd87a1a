"""Claims of the figure of track accuracy: held by good numbers, not held by bad ones."""

import pandas as pd
import pytest

from experiments.figures.track_accuracy import (
    FUSED,
    GRADES,
    JUDGED,
    LENGTHS,
    PLAIN,
    RUNS,
    WITH_AXLEBOXES,
    TrackAccuracy,
)


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
    others = [(PLAIN, "lateral", 0.5), (FUSED, "lateral", error)]
    others += [(WITH_AXLEBOXES, f"{side}_vertical", error) for side in ("left", "right")]
    rows += [
        rows[0] | {"speed [m/s]": speed, "estimator": name, "quantity": quantity, "rms error [mm]": value}
        for speed in LENGTHS
        for name, quantity, value in others
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
            "seed": 0,
            "engine": "compiled",
        }
        for track, (_, _, speeds) in RUNS.items()
        for speed in speeds
        for band in ("d1", "d2")
        for quantity in JUDGED
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize(("error", "share", "held"), [(0.12, 0.95, True), (0.31, 0.99, False), (0.31, 0.8, False)])
def test_claims_follow_the_numbers(error: float, share: float, held: bool):
    claims = TrackAccuracy().check(_table(error, share))
    assert len(claims) == 2 * len(GRADES) + 1 + 2 * len(LENGTHS) + 2 * len(JUDGED) * (9 + 1)
    assert {claim.held for claim in claims} == {held}


def test_picture_shows_every_panel():
    panels = TrackAccuracy().draw(_table(0.12, 0.95)).axes
    assert len(panels) == 6
    assert all(axes.get_title(loc="left") for axes in panels)
