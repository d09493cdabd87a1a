"""Receivers' logs (NMEA 0183) and GPX become channels of latitude, longitude and speed."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railsim import Recording
from railsim.field.guard import Guard
from tests.field.imports import SPEED, refusal, run, told, values
from tests.field.positions import START, Way, gpx, nmea, sentence, way

LATITUDE, LONGITUDE, ALTITUDE = "gnss.latitude [deg]", "gnss.longitude [deg]", "gnss.altitude [m]"


def asked(height: str = "altitude", time: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    channels = {LATITUDE: "latitude", LONGITUDE: "longitude", SPEED: "speed", ALTITUDE: height}
    table = {"time": time or {"kind": "own"}, "channels": {name: {"column": one} for name, one in channels.items()}}
    return {"origin": "test", "vehicle": "manchester", "tables": [table | more]}


def right(seen: Recording, one: Way, degrees: float, speed: float = 5.2e-4) -> None:
    measured = seen.measurements
    assert measured.about["start"].startswith("2024-05-03T23:59:50")
    np.testing.assert_allclose(measured.time(SPEED), one.time, atol=1e-9)
    np.testing.assert_allclose(measured[LATITUDE], one.latitude, rtol=0, atol=degrees)
    np.testing.assert_allclose(measured[LONGITUDE], one.longitude, rtol=0, atol=degrees)
    np.testing.assert_allclose(measured[SPEED], one.speed, rtol=0, atol=speed)
    np.testing.assert_allclose(measured[ALTITUDE], one.altitude, rtol=0, atol=0.0501)


@pytest.mark.parametrize("kinds", [("RMC", "GGA"), ("GGA", "RMC", "VTG"), ("ZDA", "GGA", "VTG"), ("GGA", "ZDA", "VTG")])
@pytest.mark.parametrize("rate", [1.0, 5.0])
def test_nmea_within_its_resolution(tmp_path: Path, guard: Guard, kinds: tuple[str, ...], rate: float):
    """Across midnight; 5 decimals of a minute are 8e-8 deg, 0.001 kn is 0.5 mm/s."""
    one = way(60, rate)
    seen = run(tmp_path, nmea(one, kinds), asked(), guard)
    right(seen, one, 0.51e-5 / 60)
    assert seen.measurements.about["import"]["format"] == "nmea" and seen.measurements.about["repairs"] == []
    assert seen.measurements.about["speed_source"] == SPEED


def test_damaged_sentences_are_left_out_and_counted(tmp_path: Path, guard: Guard):
    one = way()
    lines = nmea(one, ("GGA", "RMC")).splitlines(keepends=True)
    lines[7] = lines[7].replace("A,4", "A,5")  # RMC of the third fix: GGA has its position
    lines[9] = lines[9][:20] + "\r\n"  # GGA of the fourth
    lines[12:14] = [lines[12][:30] + lines[13]]  # a line that runs into the next one
    seen = run(tmp_path, "".join(lines), asked(), guard)
    assert told(seen, "3 of 80 sentences are damaged, by their checksum or end, and left out")
    assert np.isnan(values(seen, SPEED)[2]) and np.isnan(values(seen, ALTITUDE)[3])
    np.testing.assert_allclose(values(seen, LATITUDE), one.latitude, atol=1e-7)


def test_void_fixes_are_lost(tmp_path: Path, guard: Guard):
    text = nmea(way(), ("RMC", "GGA"))
    body = re.findall(r"\$(GNRMC[^*]*)", text)[5]
    text = text.replace(sentence(body), sentence(body.replace(",A,", ",V,", 1)))
    body = re.findall(r"\$(GNGGA[^*]*)", text)[5]
    text = text.replace(sentence(body), sentence(body.replace(",1,09,", ",0,00,", 1)))
    seen = run(tmp_path, text, asked(), guard)
    assert told(seen, "1 of 40 fixes are void")
    assert np.flatnonzero(np.isnan(values(seen, LATITUDE))).tolist() == [5]


def test_nmea_behind_stamps_of_the_logger_and_without_checksums(tmp_path: Path, guard: Guard):
    one = way()
    lines = nmea(one, ("GGA", "RMC")).splitlines()
    stamped = "\n".join(f"2024-05-03 23:59:50.1;{line}" for line in lines) + "\n"
    right(run(tmp_path, stamped, asked(), guard), one, 1e-7)
    bare = "\n".join(line.partition("*")[0] for line in lines) + "\n"
    seen = run(tmp_path, bare, asked(), guard)
    right(seen, one, 1e-7)
    assert told(seen, "none of the 80 sentences has a checksum")


def test_nmea_without_a_date_or_a_fix(tmp_path: Path, guard: Guard):
    one = way()
    no_speed = asked()
    del no_speed["tables"][0]["channels"][SPEED]
    seen = run(tmp_path, nmea(one, ("GGA",)), no_speed, guard)
    assert "start" not in seen.measurements.about
    np.testing.assert_allclose(seen.measurements.time(LATITUDE), one.time, atol=1e-9)
    assert "no column 'speed'; there are" in refusal(tmp_path, nmea(one, ("GGA",)), asked(), guard)
    line = refusal(tmp_path, sentence("GPGSA,A,3,04") * 9 + sentence("GPRMC,,V,,,,,,,,,,N") * 9, asked(), guard)
    assert "no whole RMC or GGA sentence with a time" in line
    assert "leave 'group' out" in refusal(tmp_path, nmea(one), asked(group=0), guard)


@pytest.mark.parametrize(
    "speed", ["<extensions><gpxtpx:speed>{:.3f}</gpxtpx:speed></extensions>", "<speed>{:.3f}</speed>"]
)
def test_gpx_within_its_resolution(tmp_path: Path, guard: Guard, speed: str):
    one = way(60)
    seen = run(tmp_path, gpx(one, speed), asked("elevation"), guard)
    right(seen, one, 0.51e-7, 5.1e-4)
    assert seen.measurements.about["import"]["format"] == "gpx"
    seen = run(tmp_path, gpx(one), asked("elevation", {"kind": "iso", "column": "time"}), guard)
    right(seen, one, 0.51e-7, 5.1e-4)


def test_gpx_with_zones_and_segments(tmp_path: Path, guard: Guard):
    one = way(60)
    text = gpx(one).replace("Z</time>", "+00:00</time>")
    halves = text.replace("\n<trkpt", "\n</trkseg><trkseg><trkpt", 31).replace(
        "\n</trkseg><trkseg><trkpt", "\n<trkpt", 30
    )
    right(run(tmp_path, halves, asked("elevation"), guard), one, 0.51e-7)
    last = asked("elevation", rows={"where": {"segment": 2}})
    assert values(run(tmp_path, halves, last, guard), LATITUDE).size == 30
    local = gpx(one).replace("Z</time>", "</time>")
    right(run(tmp_path, local, asked("elevation"), guard), one, 0.51e-7)


def test_gpx_that_is_cut_gives_what_is_there(tmp_path: Path, guard: Guard):
    text = gpx(way(60))
    seen = run(tmp_path, text[: len(text) // 2], asked("elevation"), guard)
    assert told(seen, "the GPX ends or breaks in line") and 20 < values(seen, SPEED).size < 40


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda text: text.replace("<gpx", '<!DOCTYPE gpx [<!ENTITY a "b">]><gpx'), "declares a document type"),
        (lambda text: re.sub("<time>.*?</time>", "", text), "its points have no time"),
        (lambda text: text.replace("trkpt", "rtept"), "no points of a track"),
        (lambda text: text.replace("trkpt ", "trkpt <"), "it is no whole GPX"),
    ],
)
def test_gpx_that_cannot_be_read(tmp_path: Path, guard: Guard, change: Any, line: str):
    assert line in refusal(tmp_path, change(gpx(way())), asked("elevation"), guard)


def test_a_receiver_beside_a_box(tmp_path: Path, guard: Guard):
    """A phone's table with dates and the track of its map program are one recording."""
    one = way(30)
    fast = np.arange(2900) / 100
    rows = [f"{START.timestamp() + t:.3f},{np.sin(t):.9f}" for t in fast]
    (tmp_path / "ride.gpx").write_text(gpx(one))
    mapped = asked("elevation", file="ride.gpx")
    table = {
        "time": {"kind": "epoch", "column": "t"},
        "channels": {"body.acceleration_z [m/s2]": {"column": "az", "unit": "m/s2"}},
    }
    mapped["tables"].insert(0, table)
    seen = run(tmp_path, "t,az\n" + "\n".join(rows) + "\n", mapped, guard)
    np.testing.assert_allclose(values(seen, LATITUDE), one.latitude, atol=1e-7)
    np.testing.assert_allclose(seen.measurements.time(LATITUDE)[:3], [0, 1, 2], atol=1e-6)
    assert told(seen, "clocks of the files are one, by their dates")
