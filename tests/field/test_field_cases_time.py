"""Dates, times of day, zones, epochs and counters as people have them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.field.imports import SPEED, UP, csv, followed, mapped, proposed, rate, refusal, run, time, told, values

AT = np.arange(100)
AZ = np.round(9.8 + 0.01 * (AT % 7), 3)
CLOCK = [f"{'23:59:5' if i < 50 else '00:00:0'}{(5 + i // 10) % 10}.{i % 10}00" for i in AT]
"""100 times of day at 10 Hz, from 5 s before midnight."""


def stamped(pattern: str) -> list[str]:
    """The times with a date: {day}, which is the 3rd of May 2024 and the one after."""
    return [f"{pattern.format(day='03' if i < 50 else '04')} {text}" for i, text in zip(AT, CLOCK, strict=True)]


def iso(**keys: Any) -> dict[str, Any]:
    return {"kind": "iso", "column": "t"} | keys


def right(seen: Any, start: str | None = None) -> bool:
    np.testing.assert_allclose(time(seen) - time(seen)[0], AT / 10, atol=1e-9)
    np.testing.assert_allclose(values(seen), AZ)
    return rate(seen) == 10.0 and seen.measurements.about.get("start") == start


@pytest.mark.parametrize(
    ("pattern", "keys"),
    [
        ("2024-05-{day}", {}), ("{day}.05.2024", {}), ("05/{day}/2024", {}), ("{day}/05/2024", {}),
        ("{day}-May-2024", {}), ("{day}/05/24", {"date_order": "day"}),
        ("05/{day}/2024", {"format": "%m/%d/%Y %H:%M:%S.%f"}),
        ("24.05.{day}", {"format": "%y.%m.%d %H:%M:%S.%f"}),
    ],
)  # fmt: skip
def test_dates_as_people_write_them(tmp_path: Path, pattern: str, keys: dict[str, str]):
    text = csv({"t": stamped(pattern), "az": AZ}, ";")
    assert right(run(tmp_path, text, mapped(iso(zone="+02:00", **keys))), "2024-05-03T21:59:55+00:00")


def test_date_that_can_be_read_in_two_ways_is_asked_for(tmp_path: Path):
    text = csv({"t": [f"05/03/2024 12:00:0{i}.0" for i in range(5)], "az": AZ[:5]}, ";")
    line = refusal(tmp_path, text, mapped(iso()))
    for order, start in (("day", "2024-03-05"), ("month", "2024-05-03")):
        cure = proposed(line, f"date_order: {order}")
        seen = run(tmp_path, text, mapped(iso(**cure)))
        assert seen.measurements.about["start"] == f"{start}T12:00:00+00:00"


def test_date_and_time_in_two_columns(tmp_path: Path):
    days = ["2024-05-03" if i < 50 else "2024-05-04" for i in AT]
    text = csv({"Date": days, "Time": CLOCK, "az": AZ}, ";")
    line = refusal(tmp_path, text, mapped({"kind": "iso", "column": "Date Time"}))
    both = mapped({"kind": "iso"} | proposed(line, "column:"))
    assert right(run(tmp_path, text, both), "2024-05-03T23:59:55+00:00")


@pytest.mark.parametrize("suffix", ["", "half"])
def test_time_of_day_over_midnight(tmp_path: Path, suffix: str):
    clock = CLOCK
    if suffix:
        clock = [f"11{one[2:]} PM" if one.startswith("23") else f"12{one[2:]}\u202fam" for one in CLOCK]
    text = csv({"t": clock, "az": AZ}, ";")
    seen = run(tmp_path, text, mapped(iso()))
    assert right(seen)
    assert told(seen, "pass midnight 1 times") and told(seen, "no date")
    dated = run(tmp_path, text, mapped(iso(date="2024-05-03", zone="Europe/Berlin")))
    assert right(dated, "2024-05-03T21:59:55+00:00")


def test_digits_of_the_day_by_a_pattern(tmp_path: Path):
    """hhmmss.ss as NMEA has it: numbers that keep their zeros."""
    text = csv({"t": [one.replace(":", "") for one in CLOCK], "az": AZ})
    assert right(run(tmp_path, text, mapped(iso(format="%H%M%S.%f"))))


def _autumn() -> list[str]:
    """4 min of local time at 1 Hz; the clock goes back from 3 to 2 o'clock after 2 min."""
    seconds = [*range(58 * 60, 3600), *range(120)]
    return [f"2024-10-27 02:{s // 60:02d}:{s % 60:02d}" for s in seconds]


def test_end_of_summer_time(tmp_path: Path):
    stamps = _autumn()
    text = csv({"t": stamps, "v": np.arange(240.0)}, ";")
    channel = {SPEED: {"column": "v", "unit": "m/s"}}
    plain = mapped(iso(zone="+02:00"), rate=1, channels=channel)
    line = refusal(tmp_path, text, plain)
    assert "end of summer time" in line
    sort = mapped(iso(zone="+02:00"), rate=1, channels=channel, repair=["sort", "drop_duplicates"])
    assert refusal(tmp_path, text, sort) == line
    named = run(tmp_path, text, mapped(iso(**proposed(line, "zone:")), rate=1, channels=channel))
    joined = run(tmp_path, text, mapped(iso(zone="+02:00"), rate=1, channels=channel, repair=["continue"]))
    for seen in (named, joined):
        np.testing.assert_allclose(time(seen, SPEED), np.arange(240), atol=1e-9)
        np.testing.assert_allclose(values(seen, SPEED), np.arange(240))
        assert seen.measurements.about["start"] == "2024-10-27T00:58:00+00:00"


@pytest.mark.parametrize(("first", "start"), [(0, "00:58:00"), (130, "01:00:10")])
def test_hour_that_comes_twice_by_the_rows_about_it(tmp_path: Path, first: int, start: str):
    stamps = _autumn()[first:120] if first < 120 else [*_autumn()[first:], "2024-10-27 03:00:01"]
    seen = run(
        tmp_path, csv({"t": stamps, "az": np.arange(float(len(stamps)))}, ";"), mapped(iso(zone="Europe/Berlin"))
    )
    assert seen.measurements.about["start"] == f"2024-10-27T{start}+00:00"
    assert told(seen, "comes twice")


def test_hour_that_does_not_exist(tmp_path: Path):
    text = csv({"t": [f"2024-03-31 02:30:0{i}" for i in range(5)], "az": AZ[:5]}, ";")
    line = refusal(tmp_path, text, mapped(iso(zone="Europe/Berlin")))
    seen = run(tmp_path, text, mapped(iso(**proposed(line, "zone:"))))
    assert seen.measurements.about["start"] == "2024-03-31T01:30:00+00:00"


def test_zone_that_is_none(tmp_path: Path):
    line = refusal(tmp_path, csv({"t": stamped("2024-05-{day}"), "az": AZ}, ";"), mapped(iso(zone="Middle Earth")))
    assert "Europe/Berlin" in line


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_epoch_beside_iso(tmp_path: Path, unit: str):
    factor = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
    epoch = [f"{1714730400 * factor + i * factor // 10}" if factor > 1 else f"{1714730400 + i / 10:.1f}" for i in AT]
    gps = [f"2024-05-03T10:00:0{i // 10}Z" if i % 10 == 0 else "" for i in AT]
    text = csv({"e": epoch, "az": AZ, "gps": gps, "v": [f"{12 + i / 10}" if i % 10 == 0 else "" for i in AT]})
    asked = mapped({"kind": "seconds", "column": "e", "unit": unit})
    channels = {SPEED: {"column": "v", "unit": "m/s"}}
    asked["tables"].append({"time": {"kind": "iso", "column": "gps"}, "rows": "filled", "channels": channels})
    line = refusal(tmp_path, text, asked)
    seen = run(tmp_path, text, followed(asked, proposed(line, "time: {kind: epoch")))
    np.testing.assert_allclose(time(seen), AT / 10, atol=1e-6)
    np.testing.assert_allclose(time(seen, SPEED), np.arange(10), atol=1e-6)
    assert rate(seen) == 10.0 and seen.measurements.about["start"] == "2024-05-03T10:00:00+00:00"


def test_epoch_in_another_unit_is_named(tmp_path: Path):
    text = csv({"t": [f"{1714730400000 + 100 * i}" for i in AT], "az": AZ})
    line = refusal(tmp_path, text, mapped({"kind": "epoch", "column": "t", "unit": "ns"}))
    cure = proposed(line, "unit:")
    assert right(run(tmp_path, text, mapped({"kind": "epoch", "column": "t"} | cure)), "2024-05-03T10:00:00+00:00")


@pytest.mark.parametrize("minimum", [None, -32768])
def test_signed_counter(tmp_path: Path, minimum: float | None):
    ticks = (32000 + 4000 * AT + 32768) % 65536 - 32768
    base = {"kind": "counter", "column": "t", "frequency": 40000, "modulus": 65536}
    seen = run(tmp_path, csv({"t": ticks, "az": AZ}), mapped(base | ({"minimum": minimum} if minimum else {})))
    assert right(seen)
    line = refusal(tmp_path, csv({"t": ticks, "az": AZ}), mapped(base | {"minimum": 0}))
    assert "'minimum'" in line


@pytest.mark.parametrize("kind", ["seconds", "counter", "epoch", "iso"])
def test_marker_of_a_lost_time(tmp_path: Path, kind: str):
    """'-' in the column of time: the message names keys that work."""
    columns: dict[str, Any] = {
        "seconds": [f"{i / 10}" for i in AT],
        "counter": [f"{100 * i}" for i in AT],
        "epoch": [f"{1714730400000 + 100 * i}" for i in AT],
        "iso": stamped("2024-05-{day}"),
    }
    stamps = columns[kind]
    stamps[20] = "-"
    base: dict[str, Any] = {"kind": kind, "column": "t"}
    base |= {"frequency": 1000, "modulus": 65536} if kind == "counter" else {}
    text = csv({"t": stamps, "az": AZ}, ";")
    line = refusal(tmp_path, text, mapped(base))
    assert "'lost' of 'time' and 'drop_untimed' to repair" in line.replace(
        "to 'lost' of 'time' and add 'drop_untimed'", "'lost' of 'time' and 'drop_untimed'"
    )
    seen = run(tmp_path, text, mapped(base | {"lost": ["-"]}, repair=["drop_untimed"]))
    np.testing.assert_allclose(time(seen) - time(seen)[0], np.delete(AT, 20) / 10, atol=1e-6)
    np.testing.assert_allclose(values(seen, UP), np.delete(AZ, 20))


def test_days_of_a_spreadsheet(tmp_path: Path):
    text = csv({"t": [f"{45415.5 + i / 864000:.12f}" for i in AT], "az": AZ})
    line = refusal(tmp_path, text, mapped())
    seen = run(tmp_path, text, followed(mapped(), proposed(line, "time:")))
    np.testing.assert_allclose(time(seen), AT / 10, atol=2e-6)
    assert rate(seen) == 10.0 and seen.measurements.about["start"] == "2024-05-03T12:00:00+00:00"
