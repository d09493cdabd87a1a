"""Estimates survive the disk whole or not at all; estimators say what they miss."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate, Estimator
from railsim.errors import InputError
from railsim.measurements import Measurements


class _Needy(Estimator, frozen=True):
    requires = ("bogie.rate_yaw [rad/s]",)

    def estimate(self, measurements):
        self.need(measurements)
        return _estimate()


def _estimate() -> Estimate:
    series = pd.DataFrame({"time [s]": [0.0, 0.5], "speed [m/s]": [np.nan, 20.0], "speed_std [m/s]": [np.nan, 0.1]})
    return Estimate("speed", series, {"window": 4.0})


def test_round_trip_and_replacement(tmp_path: Path) -> None:
    _estimate().save(tmp_path / "a" / "b")
    _estimate().save(tmp_path / "a" / "b")
    again = Estimate.open(tmp_path / "a" / "b")
    assert again.name == "speed"
    assert again.about == {"window": 4.0}
    pd.testing.assert_frame_equal(again.series, _estimate().series)
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["b"]


def test_foreign_folder_is_kept(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(InputError, match="did not write"):
        _estimate().save(tmp_path)
    assert (tmp_path / "thesis.txt").exists()


def test_half_an_estimate_is_refused(tmp_path: Path) -> None:
    _estimate().save(tmp_path / "e")
    (tmp_path / "e" / "estimate.parquet").unlink()
    with pytest.raises(InputError, match="estimate.parquet"):
        Estimate.open(tmp_path / "e")


def test_first_column_is_time_or_distance() -> None:
    with pytest.raises(ValueError, match="first column"):
        Estimate("speed", pd.DataFrame({"speed [m/s]": [1.0]}))


def test_missing_channel_is_named() -> None:
    about = {"origin": "test", "vehicle": {}, "sensors": []}
    other = Measurements(about, {10.0: {"time [s]": [0.0, 0.1], "bogie.rate_roll [rad/s]": [0.0, 0.0]}})
    assert not _Needy().fits(other)
    with pytest.raises(InputError, match="rate_yaw"):
        _Needy().estimate(other)
