"""The examples of docs/field_data.md work as they stand there."""

import re
from pathlib import Path

import numpy as np
import pytest

from experiments.cli import main
from railsim import Recording
from railsim.track.files import read_track
from tests.field.positions import gpx, nmea, way

TEXT = (Path(__file__).parents[2] / "docs" / "field_data.md").read_text()
EXAMPLES = {
    re.findall(r"\A# (\S+)", code)[0]: code
    for code in re.findall(r"^```(?:csv|yaml)\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
}


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, code in EXAMPLES.items():
        Path(name).write_text(code, encoding="utf-8")


def test_recording(capsys: pytest.CaptureFixture[str]):
    assert main(["import", "data.csv", "--map", "map.yaml", "--out", "out"]) == 0
    shown = re.search(r"^This prints\n\n```\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    assert shown is not None
    assert capsys.readouterr().out == shown[1]
    seen = Recording.open("out").measurements
    assert np.rad2deg(seen["bogie.rate_pitch [rad/s]"]) == pytest.approx([-0.5, 0.25, 0.0, -0.75, -0.25])
    assert seen["bogie.acceleration_x [m/s2]"][[0, 2]] == pytest.approx([0.0980665, np.nan], nan_ok=True)
    assert seen["gnss.speed [m/s]"] == pytest.approx([72.1 / 3.6, 72.3 / 3.6, 72.2 / 3.6])
    assert seen.sensor("bogie.acceleration_x [m/s2]")["position"] == [0.2, 0.0, 0.1]


@pytest.mark.parametrize("kind", ["nmea", "gpx"])
def test_positions(kind: str):
    one = way()
    Path("ride.log").write_text(nmea(one) if kind == "nmea" else gpx(one))
    assert main(["import", "ride.log", "--map", "ride.yaml", "--out", "out"]) == 0
    seen = Recording.open("out").measurements
    assert seen["gnss.latitude [deg]"] == pytest.approx(one.latitude, abs=1e-7)
    assert seen["gnss.longitude [deg]"] == pytest.approx(one.longitude, abs=1e-7)


def test_track():
    assert main(["import", "car.csv", "--map", "car.yaml", "--out", "track.csv"]) == 0
    track = read_track("track.csv")
    assert track.s == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0], abs=1e-9)
    assert track.left_vertical == pytest.approx([-0.0012, -0.0011, -0.0009, -0.0006, -0.0005])
    assert track.gauge_deviation == pytest.approx([0.0011, 0.001, 0.0008, 0.0009, 0.001])
    assert main(["inspect", "track.csv"]) in (0, 1)
