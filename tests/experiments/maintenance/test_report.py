"""`railsim condition`: tables, GeoJSON and a page with traces that asks nothing of any network."""

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from estimators.interface import Estimate
from experiments.cli import main
from experiments.maintenance.comparison import laid
from experiments.maintenance.traces import LOST, STEP, traces
from tests.experiments.maintenance.made_passes import ride
from tests.experiments.maintenance.test_map import recording

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def unpacked(text: str) -> np.ndarray:
    numbers = np.frombuffer(base64.b64decode(text), "<i2").astype(float)
    return np.where(numbers == LOST, np.nan, numbers * STEP)


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """Condition of a pass with a dip of 14 mm that has grown by 4 mm."""
    recording(tmp_path / "rec")
    ride(seed=1, dip=14e-3, speed=25.0).save(tmp_path / "now", recording=tmp_path / "rec")
    ride(seed=2, dip=10e-3, scale=0.003).save(tmp_path / "before")
    words = ["condition", str(tmp_path / "now"), "--before", str(tmp_path / "before"), "--line-speed", "120"]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    return tmp_path / "out"


def test_tables_say_level_class_and_change(made: Path):
    for length, count in ((100, 12), (200, 6)):
        rows = pd.read_csv(made / f"condition_{length}m.csv", keep_default_na=False)
        assert len(rows) == count and set(rows["quantity"]) == {"vertical"} and set(rows["band"]) == {"D1"}
        assert rows.loc[rows["from [m]"] == (500 if length == 100 else 400), "level"].tolist() == ["intervention"]
    assert pd.read_csv(made / "condition_200m.csv")["class"].tolist()[0] == "B"
    found = pd.read_csv(made / "defects.csv")
    assert found["level"].tolist()[0] == "intervention" and found["changed"].tolist()[0] == "grown"
    changed = pd.read_csv(made / "changes.csv")
    assert len(changed) == 1 and changed["change over error [-]"].iloc[0] < -3.0


def test_geojson_holds_levels_and_changes(made: Path):
    whole = json.loads((made / "condition.geojson").read_text())
    sections = [one["properties"] for one in whole["features"] if one["properties"]["kind"] == "section"]
    assert len(sections) == 12
    assert [one["level [-]"] for one in sections] == [0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0]
    assert {one["vertical_d1 changed"] for one in sections if "vertical_d1 changed" in one} == {"no", "grown"}
    points = [one for one in whole["features"] if one["properties"]["kind"] == "defect"]
    assert points[0]["properties"]["level"] == "intervention" and points[0]["geometry"]["type"] == "Point"


def test_text_says_what_the_limits_go_by(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    ride(seed=1, dip=14e-3).save(tmp_path / "now")
    assert main(["condition", str(tmp_path / "now"), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "no line speed is stated: limits go by the speed travelled" in said
    assert "no earlier pass is given" in said and "no map: the recording has gone" in said
    assert "intervention: 1" in said and not (tmp_path / "out" / "changes.csv").exists()


def test_estimates_of_one_recording_are_one_page(tmp_path: Path):
    ride(seed=1).save(tmp_path / "one")
    series = ride(seed=4).series.rename(columns=lambda name: name.replace("vertical", "lateral"))
    Estimate("other", series).save(tmp_path / "two")
    assert main(["condition", str(tmp_path / "one"), str(tmp_path / "two"), "--out", str(tmp_path / "out")]) == 0
    rows = pd.read_csv(tmp_path / "out" / "condition_200m.csv")
    assert rows["quantity"].value_counts().to_dict() == {"vertical": 6, "lateral": 6}
    whole = json.loads((tmp_path / "out" / "condition.geojson").read_text())["features"]
    assert len([one for one in whole if one["properties"]["kind"] == "section"]) == 12
    assert {"vertical_d1 peak [mm]", "lateral_d1 peak [mm]"} <= set(whole[3]["properties"])


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["now", "now"], "two estimates are of mine"),
        (["now", "--before", "speed"], "an estimate of speed has none beside it"),
        (["speed"], "is not of track geometry"),
        (["now", "--line-speed", "-4"], "between 0 and 1000"),
        (["now", "--limits", "none.yaml"], "cannot read"),
    ],
)
def test_what_cannot_be_reported(
    words: list[str], line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    ride(seed=1).save("now")
    Estimate("speed", pd.DataFrame({"time [s]": [0.0], "speed [m/s]": [1.0]})).save("speed")
    assert main(["condition", *words, "--out", "out"]) == 2
    error = capsys.readouterr().err
    assert line in error and error.count("\n") == 1 and not Path("out").exists()


def test_an_estimate_is_not_replaced_by_its_condition(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    ride(seed=1).save(tmp_path / "now")
    assert main(["condition", str(tmp_path / "now"), "--out", str(tmp_path / "now")]) == 2
    assert "which would be lost" in capsys.readouterr().err and (tmp_path / "now" / "about.json").is_file()


@pytest.mark.parametrize("falling", [False, True])
def test_kilometres_of_the_line(falling: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    ride(seed=1, dip=14e-3).save(tmp_path / "now")
    table = tmp_path / "line.csv"
    edge = 12.4 + (-0.5 if falling else 0.5)
    slow, fast = ("80", "160") if not falling else ("160", "80")
    table.write_text(f"from [km],line speed [km/h]\n0,{slow}\n{edge},{fast}\n")
    words = ["condition", str(tmp_path / "now"), "--line-speed", str(table), "--out", str(tmp_path / "out")]
    assert main(words) == 2 and "add --kilometre KM" in capsys.readouterr().err
    assert main([*words, "--kilometre", "12.4", *(["--falling"] if falling else [])]) == 0
    found = pd.read_csv(tmp_path / "out" / "defects.csv")
    assert found["kilometre"].iloc[0] == pytest.approx(12.4 + (-0.55 if falling else 0.55), abs=1e-3)
    assert found["level"].iloc[0] == "intervention" and found["speed [km/h]"].iloc[0] == 160.0
    rows = pd.read_csv(tmp_path / "out" / "condition_200m.csv")
    assert rows["line speed [km/h]"].tolist() == [80.0, 80.0, 160.0, 160.0, 160.0, 160.0]
    assert rows["from [km]"].tolist() == pytest.approx(
        [12.4 + sign * 0.2 * n for n in range(6) for sign in [-1 if falling else 1]]
    )
    assert '"slope":-0.001' in (tmp_path / "out" / "condition.html").read_text() or not falling
    assert main(["condition", str(tmp_path / "now"), "--falling", "--out", str(tmp_path / "out")]) == 2


def test_traces_keep_peaks_gaps_and_errors():
    one = ride(seed=1, dip=14e-3)
    one.series.loc[100:199, "valid [-]"] = 0.0
    found = traces(one)[0]
    values = unpacked(found["values"])
    assert found["name"] == "vertical D1" and found["cell [m]"] == 0.25 and len(values) == 4800
    assert np.nanmax(np.abs(values)) == pytest.approx(1e3 * one.series["vertical_d1 [m]"].abs().max(), abs=STEP)
    assert np.isnan(values[50:100]).all() and np.isfinite(values[100:]).all()
    assert unpacked(found["errors"]) == pytest.approx(0.1)
    assert found["limits"] == [[0.0, 10.0, 13.0, 26.0]]
    coarse = traces(one, points=1000)[0]
    assert len(unpacked(coarse["values"])) <= 500
    assert np.nanmax(np.abs(unpacked(coarse["values"]))) == pytest.approx(np.nanmax(np.abs(values)))


def test_traces_hold_earlier_passes():
    one = ride(seed=1)
    found = traces(one, [laid(ride(seed=2), one)])[0]
    difference = unpacked(found["earlier"][0]) - unpacked(found["values"])
    assert np.nanstd(difference) < 0.4 and np.isfinite(difference).mean() > 0.9


def test_page_names_no_place_of_any_network(made: Path):
    text = (made / "condition.html").read_text()
    assert (
        "default-src 'none'" in text and 'id="traces"' in text and "{{" not in re.sub(r"<script.*?</script>", "", text)
    )
    outside = set(re.findall(r"(?:https?|wss?|ftp)://[^\s\"']+", text)) - {"http://www.w3.org/2000/svg"}
    assert not outside
    assert not re.search(
        r"<(?:link|img|iframe|script[^>]+src)|@import|url\(|fetch\(|XMLHttp|WebSocket|sendBeacon", text
    )


def browsed(page: Path, folder: Path) -> tuple[list[str], np.ndarray]:
    """(addresses that the page asked for, picture) by a browser; what it asks for itself has no origin."""
    log, picture = folder / "net.json", folder / "page.png"
    words = [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}"]
    words += ["--disable-background-networking", "--disable-component-update", "--no-first-run", "--disable-sync"]
    words += [
        f"--log-net-log={log}",
        f"--screenshot={picture}",
        "--window-size=1200,1500",
        "--virtual-time-budget=3000",
    ]
    subprocess.run([*words, page.as_uri()], capture_output=True, timeout=120, check=True)
    events: list[dict[str, Any]] = json.loads(log.read_text())["events"]
    about = [one.get("params", {}) for one in events]
    asked = [one["url"] for one in about if "url" in one and one.get("initiator", "not an origin") != "not an origin"]
    return asked, imread(picture)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_page_draws_and_asks_for_nothing_in_a_browser(made: Path, tmp_path: Path):
    (tmp_path / "seen").mkdir()
    asked, picture = browsed(made / "condition.html", tmp_path / "seen")
    assert asked == []
    blue = np.abs(picture[..., :3] - np.array([0x1D, 0x35, 0x57]) / 255).max(axis=2) < 0.1
    assert blue.sum() > 1000 and np.flatnonzero(blue.any(axis=0)).size > 800  # a trace over the width of the page
    leaking = tmp_path / "leaking.html"
    text = (made / "condition.html").read_text().replace("default-src 'none'", "img-src *")
    leaking.write_text(text.replace("</body>", '<img src="http://127.0.0.1:9/x.png"></body>'))
    (tmp_path / "control").mkdir()
    asked, _ = browsed(leaking, tmp_path / "control")
    assert set(asked) == {"http://127.0.0.1:9/x.png"}


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_traces_zoom_and_tell_values(made: Path, tmp_path: Path):
    probe = """<script>
const canvas = chart[0].canvas, box = canvas.getBoundingClientRect(), out = [];
const say = () => out.push([range.from, range.to].map(v => v.toFixed(1)).join("-"));
say();
visit(500); say();
function mouse(kind, x, more) {
  const at = {clientX: box.left + x, clientY: canvas.getBoundingClientRect().top + 60, pointerId: 1, cancelable: true};
  canvas.dispatchEvent(new (kind === "wheel" ? WheelEvent : PointerEvent)(kind, {...at, bubbles: true, ...more}));
}
canvas.setPointerCapture = () => {};
mouse("wheel", 500, {deltaY: -100}); say();
mouse("pointerdown", 500, {buttons: 1}); mouse("pointermove", 400, {buttons: 1}); mouse("pointerup", 400, {});
say();
out.push(document.getElementById("readout").textContent);
canvas.dispatchEvent(new MouseEvent("dblclick")); say();
document.body.dataset.probe = out.join(";");
</script></body>"""
    page = tmp_path / "probe.html"
    page.write_text((made / "condition.html").read_text().replace("</body>", probe))
    words = [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    done = subprocess.run(
        [*words, "--window-size=1200,1500", "--virtual-time-budget=3000", "--dump-dom", page.as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    said = re.search(r'data-probe="([^"]*)"', done.stdout)
    assert said is not None
    whole, place, closer, moved, told, again = said[1].split(";")
    assert whole == again == "0.0-1200.0" and place == "450.0-550.0"
    low, high = map(float, closer.split("-"))
    assert high - low == pytest.approx(80.0, abs=0.3) and 450.0 < low < high < 550.0
    assert float(moved.split("-")[0]) > low + 3.0
    assert re.search(r"vertical D1 -?[\d.]+ ± 0\.20 mm, before -?[\d.]+", told)
