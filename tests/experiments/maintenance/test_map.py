"""Condition on a map: places by the recording's latitude and longitude, as GeoJSON and as a page of its own."""

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.cli import main
from experiments.maintenance.condition_map import features
from experiments.maintenance.positions import RADIUS, Positions, positions_of
from railsim.measurements import Measurements
from railsim.recording import write_recording
from railsim.vehicles.lookup import build_vehicle

NORTH, EAST = 47.3, 8.5
S = 0.25 * np.arange(4001)
SPEED = 20.0
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def place(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(latitude, longitude), deg: north-east for 500 m, then due north."""
    east, north = np.minimum(s, 500.0) / np.sqrt(2), np.minimum(s, 500.0) / np.sqrt(2) + np.maximum(s - 500.0, 0.0)
    latitude = NORTH + np.degrees(north / RADIUS)
    return latitude, EAST + np.degrees(east / RADIUS / np.cos(np.radians(latitude.mean() if s.size > 1 else NORTH)))


def recording(folder: Path, lost: slice | None = None, positions: bool = True) -> Path:
    """A gyro and a receiver over 50 s at 20 m/s."""
    fast, slow = np.arange(5001) / 100, np.arange(51.0)
    latitude, longitude = place(SPEED * slow)
    table = {"time [s]": slow, "gnss.speed [m/s]": SPEED + 0.02 * np.sin(1.3 * slow)}
    if positions:
        table |= {"gnss.latitude [deg]": latitude, "gnss.longitude [deg]": longitude}
        if lost:
            table["gnss.latitude [deg]"][lost] = np.nan
    pitch = pd.DataFrame({"time [s]": fast, "bogie.rate_pitch [rad/s]": 2e-3 * np.sin(2 * np.pi * SPEED * fast / 12)})
    vehicle = build_vehicle("class175", Path())
    about: dict[str, Any] = {"origin": "unit 7 <Zürich>", "vehicle": {"name": "class175", **vehicle.nominal()}}
    about |= {"sensors": [], "speed_source": "gnss.speed [m/s]", "start": "2024-05-03T10:00:00+00:00"}
    return Path(write_recording(folder, {100.0: pitch, 1.0: pd.DataFrame(table)}, about))


def estimate(**more: Any) -> Estimate:
    """Vertical alignment that grows, and a defect at 700 m."""
    size = np.where(S < 400.0, 1e-3, 2e-3)
    values = size * np.sin(2 * np.pi * S / 10.0) + 14e-3 * np.exp(-(((S - 700.0) / 3.0) ** 2))
    columns = {"s [m]": S, "time [s]": S / SPEED, "vertical_d1 [m]": values, "valid [-]": np.ones(len(S))}
    return Estimate("mine", pd.DataFrame(columns | more))


def fixes(seen: Path) -> Positions:
    from railsim.recording import read_measurements

    return positions_of(read_measurements(seen))


def kinds(collection: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    return [one for one in collection["features"] if one["properties"]["kind"] == kind]


def test_sections_lie_where_the_vehicle_was(tmp_path: Path):
    found = features(estimate(), fixes(recording(tmp_path / "rec")), "2024-05-03T10:00:00+00:00")
    sections = kinds(found, "section")
    assert [one["properties"]["from [m]"] for one in sections] == [100.0 * n for n in range(10)]
    assert sections[-1]["properties"]["to [m]"] == 1000.0
    assert sections[3]["properties"]["vertical_d1 std [mm]"] == pytest.approx(1 / np.sqrt(2), rel=0.02)
    assert sections[3]["properties"]["at"] == "2024-05-03T10:00:15.000+00:00"
    for number, one in enumerate(sections):
        assert one["geometry"]["type"] == "LineString"
        line = np.array(one["geometry"]["coordinates"])
        true = np.column_stack(place(np.linspace(100.0 * number, 100.0 * (number + 1), len(line)))[::-1])
        metres = np.radians(line - true) * RADIUS
        assert np.abs(metres).max() < 3.0 and len(line) >= 6
    defect = kinds(found, "defect")[0]
    assert defect["properties"]["size [mm or mm/m]"] == pytest.approx(14.0, rel=0.2)
    latitude, _ = place(np.array([0.0, defect["properties"]["s [m]"], 1000.0]))
    assert defect["geometry"]["coordinates"][1] == pytest.approx(latitude[1], abs=2e-5)


def test_where_no_fix_is_near_nothing_is_drawn(tmp_path: Path):
    found = features(estimate(), fixes(recording(tmp_path / "rec", lost=slice(20, 45))))
    missing = [one["properties"]["from [m]"] for one in kinds(found, "section") if one["geometry"] is None]
    assert missing == [400.0, 500.0, 600.0, 700.0, 800.0]
    assert all("at" not in one["properties"] for one in found["features"])
    assert kinds(found, "defect")[0]["geometry"] is None


def test_estimates_over_time_go_by_the_way_of_the_fixes(tmp_path: Path):
    time = np.arange(0.0, 50.0, 0.1)
    speeds = pd.DataFrame({"time [s]": time, "speed [m/s]": 18 + time / 10, "speed_std [m/s]": np.full(500, 0.1)})
    found = kinds(features(Estimate("speed_plain", speeds), fixes(recording(tmp_path / "rec"))), "section")
    assert [round(one["properties"]["from [m]"] / 100) for one in found] == list(range(10))
    assert found[5]["properties"]["speed mean [m/s]"] == pytest.approx(18 + 27.5 / 10, abs=0.05)


def test_jitter_at_a_standstill_is_no_way_and_180_degrees_no_jump():
    random = np.random.default_rng(3)
    time = np.arange(200.0)
    way = np.concatenate([np.zeros(100), 10.0 * np.arange(100)])
    wander = 3.0 * random.standard_normal(200)
    longitude = 179.999 + np.degrees((way + wander) / RADIUS)
    fixes = Positions("gnss", time, np.zeros(200), longitude)
    assert fixes.distance(np.array([90.0]))[0] < 25.0  # m; without the bound it is 350
    assert fixes.distance(np.array([199.0]))[0] == pytest.approx(990.0, abs=15.0)
    assert np.abs(fixes.at(time)).max() <= 180.0
    series = pd.DataFrame({"s [m]": way, "time [s]": time, "speed [m/s]": time})
    crossing = [one["geometry"] for one in features(Estimate("x", series), fixes)["features"] if one["geometry"]]
    for geometry in crossing:
        parts = geometry["coordinates"] if geometry["type"] == "MultiLineString" else [geometry["coordinates"]]
        assert all(np.ptp([point[0] for point in part]) < 1.0 for part in parts)


def test_events_are_points(tmp_path: Path):
    events = [{"kind": "joint", "s [m]": 60.0, "depth [m]": 3e-3}, {"kind": "joint", "time [s]": 20.0, "side": "left"}]
    one = Estimate("dipped_joints", estimate().series.drop(columns="vertical_d1 [m]"), {"events": events})
    found = kinds(features(one, fixes(recording(tmp_path / "rec"))), "joint")
    assert [point["geometry"]["type"] for point in found] == ["Point", "Point"]
    latitude, longitude = place(np.array([60.0, 400.0]))
    assert np.array([one["geometry"]["coordinates"] for one in found]) == pytest.approx(
        np.column_stack([longitude, latitude]), abs=2e-5
    )


def test_command_finds_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    recording(Path("rec"))
    Path("made").mkdir()
    assert main(["estimate", "alignment_vertical", "rec", "--out", "made/est"]) == 0
    assert main(["export", "made/est", "--to", "x.geojson"]) == 0
    assert "positions of 'rec'" in capsys.readouterr().out
    whole = json.loads(Path("x.geojson").read_text())
    assert whole["type"] == "FeatureCollection" and len(kinds(whole, "section")) == 10
    assert all(set(one) == {"type", "geometry", "properties"} for one in whole["features"])
    assert main(["export", "made/est", "--to", "x.geojson", "--overwrite", "--section", "200"]) == 0
    assert len(kinds(json.loads(Path("x.geojson").read_text()), "section")) == 5
    recording(Path("bare"), positions=False)
    estimate().save("est")
    for words, line in (
        (["made/est", "--to", "x.geojson"], "add --overwrite"),
        (["est", "--to", "y.geojson"], "does not say which recording it was made of; add --recording DIR"),
        (["est", "--to", "y.html", "--recording", "bare"], "holds no latitude and longitude"),
        (["rec", "--to", "y.html"], "run 'railsim estimate NAME rec --out DIR'"),
        (["est", "--to", "y.csv", "--recording", "rec"], "are for a map"),
        (["est", "--to", "y.html", "--recording", "rec", "--section", "1"], "give a length of 5 m or more"),
        (["est", "--to", "y.html", "--recording", "nowhere"], "is not a recording"),
    ):
        capsys.readouterr()
        assert main(["export", *words]) == 2
        error = capsys.readouterr().err
        assert line in error and error.count("\n") == 1
    Path("rec").rename("moved")
    assert main(["export", "made/est", "--to", "y.geojson"]) == 2
    assert "has gone; add --recording DIR" in capsys.readouterr().err
    assert main(["export", "made/est", "--to", "y.geojson", "--recording", "moved"]) == 0


def test_positions_of_another_time_are_refused(tmp_path: Path):
    late = estimate(**{"time [s]": 900.0 + S / SPEED})
    with pytest.raises(ValueError, match="name by --recording the one that it was made of"):
        features(late, fixes(recording(tmp_path / "rec")))
    with pytest.raises(ValueError, match="no rows over time"):
        features(Estimate("x", pd.DataFrame({"s [m]": S})), fixes(recording(tmp_path / "rec")))


def test_positions_that_cannot_serve():
    def seen(**columns: Any) -> Measurements:
        table = {"time [s]": np.arange(5.0)} | {name.replace("_deg", " [deg]"): one for name, one in columns.items()}
        named = {name if " " in name else name: one for name, one in table.items()}
        return Measurements({"origin": "x", "vehicle": {}, "sensors": []}, {1.0: named})

    lost = np.full(5, np.nan)
    with pytest.raises(ValueError, match="0 times only"):
        positions_of(seen(**{"a.latitude [deg]": lost, "a.longitude [deg]": lost}))
    with pytest.raises(ValueError, match="no latitude and longitude"):
        positions_of(seen(**{"a.latitude [deg]": lost, "b.longitude [deg]": lost}))


@pytest.fixture
def page(tmp_path: Path) -> Path:
    recording(tmp_path / "rec", lost=slice(30, 31))
    estimate().save(tmp_path / "est", recording=tmp_path / "rec")
    assert main(["export", str(tmp_path / "est"), "--to", str(tmp_path / "x.html")]) == 0
    return tmp_path / "x.html"


def test_page_asks_for_nothing_from_outside(page: Path):
    text = page.read_text()
    assert "unit 7 &lt;Zürich&gt;" in text and "<Zürich>" not in text
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert data is not None and len(json.loads(data[1])["features"]) == 11
    assert "default-src 'none'" in text
    outside = set(re.findall(r"https?://[^\s\"']+", text)) - {"http://www.w3.org/2000/svg"}
    assert not outside and not re.search(r"<(?:link|img|iframe|script[^>]+src)|@import|url\(|fetch\(|XMLHttp", text)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_page_draws_itself_in_a_browser(page: Path, tmp_path: Path):
    words = [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    done = subprocess.run(
        [*words, "--virtual-time-budget=3000", "--dump-dom", page.as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    shown = done.stdout
    assert len(re.findall(r'<path[^>]+class="section"[^>]*stroke="rgb', shown)) == 10
    assert len(re.findall("<circle", shown)) == 1
    assert '<option value="vertical_d1 std [mm]">' in shown
    assert re.search(r'<svg[^>]+viewBox="-?[\d.]+ ', shown) and re.search(r'id="scale"[^>]*>\d+ (?:m|km)<', shown)
    assert shown.count("<tr") >= 12
