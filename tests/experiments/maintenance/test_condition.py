"""Standard deviations a section and isolated defects, on a made-up estimate; the command writes them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from estimators.track.alignment_vertical import AlignmentVertical
from experiments.cli import main
from experiments.maintenance.condition import condition, defects, tables
from railsim.recording import write_recording
from tests.estimators.track_rig import ride, wave

S = 0.125 * np.arange(8001)
SPEED = 30.0  # m/s: 108 km/h, limit 10 mm


def estimate(values: np.ndarray, valid: np.ndarray | None = None) -> Estimate:
    table = {"s [m]": S, "time [s]": S / SPEED, "vertical_d1 [m]": values}
    return Estimate("mine", pd.DataFrame(table | {"valid [-]": np.ones(len(S)) if valid is None else valid}))


def test_standard_deviation_of_a_sine_a_section():
    size = np.where(S < 400.0, 1e-3, 2e-3)
    found = condition(estimate(size * np.sin(2 * np.pi * S / 10.0)))
    assert found["from [m]"].tolist() == [0.0, 200.0, 400.0, 600.0, 800.0, 1000.0]
    assert found["vertical_d1 std [mm]"].to_numpy()[:5] == pytest.approx(
        np.array([1, 1, 2, 2, 2]) / np.sqrt(2), rel=0.01
    )


def test_section_without_enough_valid_metres_has_no_number():
    valid = ((S < 200.0) | (S > 320.0)).astype(float)
    found = condition(estimate(1e-3 * np.sin(S), valid))["vertical_d1 std [mm]"].to_numpy()
    assert np.isnan(found[1])
    assert np.isfinite(found[[0, 2]]).all()


def test_defects_are_listed_by_place_with_size_and_length():
    values = 12e-3 * np.exp(-(((S - 700.0) / 3.0) ** 2)) - 15e-3 * np.exp(-(((S - 300.0) / 3.0) ** 2))
    values += 9e-3 * np.exp(-(((S - 500.0) / 3.0) ** 2))  # stays below the limit
    found = defects(estimate(values))
    assert found["quantity"].tolist() == ["vertical_d1", "vertical_d1"]
    assert found["s [m]"].to_numpy() == pytest.approx([300.0, 700.0])
    assert found["size [mm or mm/m]"].to_numpy() == pytest.approx([-15.0, 12.0], rel=1e-3)
    assert found["length [m]"].iloc[1] == pytest.approx(2 * 3.0 * np.sqrt(np.log(12.0 / 10.0)), abs=0.3)
    assert found["speed [km/h]"].to_numpy() == pytest.approx(108.0)


def test_invalid_places_hold_no_defects():
    values = 12e-3 * np.exp(-(((S - 700.0) / 3.0) ** 2))
    assert defects(estimate(values, (S < 600.0).astype(float))).empty


def test_events_are_a_table_in_the_order_of_the_estimate():
    events = [{"kind": "joint", "s [m]": 60.0, "depth [m]": 3e-3}, {"kind": "joint", "s [m]": 78.3, "depth [m]": 4e-3}]
    series = pd.DataFrame({"s [m]": [0.0], "dip_snr [-]": [1.0]})
    found = tables(Estimate("mine", series, {"events": events}))["events.csv"]
    assert found["s [m]"].tolist() == [60.0, 78.3]
    assert tables(Estimate("mine", series, {"events": []})) == {}


def test_other_estimates_have_no_tables():
    speed = pd.DataFrame({"time [s]": [0.0], "speed [m/s]": [1.0]})
    assert tables(Estimate("mine", speed)) == {}


def test_command_writes_both_tables_beside_the_estimate(tmp_path: Path):
    measured = ride(np.full(round(30 * 256), 20.0), vertical=wave(12.0, 14e-3))
    frames = {
        rate: pd.DataFrame(
            {"time [s]": measured.time(names[0]), **{name: np.asarray(measured[name]) for name in names}}
        )
        for rate in (64.0, 256.0)
        for names in [[name for name in measured.channels if measured.rate(name) == rate]]
    }
    write_recording(tmp_path / "recording", frames, measured.about)
    out = tmp_path / "out"
    assert main(["estimate", "alignment_vertical", str(tmp_path / "recording"), "--out", str(out)]) == 0
    assert sorted(path.name for path in out.glob("[a-z]*")) == [
        "about.json",
        "condition_200m.csv",
        "defects.csv",
        "estimate.parquet",
        "estimate.png",
    ]
    assert len(pd.read_csv(out / "defects.csv")) > 20
    again = pd.read_csv(out / "condition_200m.csv")
    assert again["vertical_d1 std [mm]"].to_numpy()[1] == pytest.approx(
        condition(AlignmentVertical().estimate(measured))["vertical_d1 std [mm]"].to_numpy()[1], rel=1e-4
    )
