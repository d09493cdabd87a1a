"""Time bases against closed forms and published instants."""

from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.field.channels import from_pulses
from railsim.field.clock import read_clock
from railsim.field.map import Channel, TableMap
from railsim.field.tables import Column, Notes, Table


def clock(base: dict[str, Any], columns: dict[str, Any], **more: Any):
    table = Table({n: Column(n, v if isinstance(v[0], str) else np.array(v, dtype=float)) for n, v in columns.items()})
    mapped = TableMap.build({"time": base, "channels": {"a.b [m]": {"column": "x"}}} | more)
    notes = Notes()
    return read_clock(mapped, table, len(next(iter(columns.values()))), notes), notes


def test_milliseconds():
    assert clock({"kind": "seconds", "column": "t", "unit": "ms"}, {"t": [0, 250, 500]})[0].seconds == pytest.approx(
        [0, 0.25, 0.5]
    )


@pytest.mark.parametrize(("frequency", "modulus"), [(1e3, 256), (1e6, 65536), (100, 10)])
def test_counter_that_wraps_gives_the_true_time(frequency: float, modulus: float):
    ticks = np.cumsum(np.random.default_rng(1).integers(1, int(modulus / 2), 500)) + int(modulus) - 3
    found, notes = clock(
        {"kind": "counter", "column": "n", "frequency": frequency, "modulus": modulus}, {"n": ticks % modulus}
    )
    np.testing.assert_allclose(found.seconds, (ticks - ticks[0]) / frequency, rtol=1e-12)
    assert "cannot be seen" in notes.assumptions[0]


def test_gps_week_and_seconds():
    """GPS week 2000 began on 6 May 2018, when GPS was 18 s ahead of UTC (IERS Bulletin C)."""
    base = {"kind": "gps", "week": 2000, "seconds": "tow", "leap_seconds": 18}
    found, _ = clock(base, {"tow": [604799.5, 0.0, 0.5]})
    assert found.start == datetime(2018, 5, 5, 23, 59, 42, tzinfo=UTC)
    assert found.seconds == pytest.approx([604799.5, 604800.0, 604800.5])
    rolled, _ = clock(base | {"week": "w", "rollovers": 1}, {"tow": [1.0], "w": [2000 - 1024]})
    assert rolled.start == found.start


def test_iso_with_zones_commas_and_nanoseconds():
    texts = ["2024-05-03T12:00:00,250+02:00", "2024-05-03T10:00:00.500000000Z", "2024-05-03 10:00:01"]
    found, notes = clock({"kind": "iso", "column": "t"}, {"t": texts})
    assert found.start == datetime(2024, 5, 3, 10, 0, 0, 250000, tzinfo=UTC)
    assert found.seconds == pytest.approx([0.0, 0.25, 0.75])
    assert notes.assumptions == ["times in 't' without a zone are UTC"]
    local, _ = clock({"kind": "iso", "column": "t", "zone": "+02:00"}, {"t": ["2024-05-03 12:00:00.25"]})
    assert local.start == found.start


@pytest.mark.parametrize(
    ("base", "columns", "line"),
    [
        ({"kind": "iso", "column": "t"}, {"t": ["2024-13-45"]}, "row 1 holds '2024-13-45', no ISO 8601 time"),
        ({"kind": "iso", "column": "t"}, {"t": [1.0]}, "holds numbers, no dates"),
        ({"kind": "counter", "column": "t", "frequency": 1, "modulus": 16}, {"t": [17]}, "leaves 0 ... 16"),
        ({"kind": "gps", "week": 2000, "seconds": "t", "leap_seconds": 18}, {"t": [7e5]}, "leaves a week"),
        ({"kind": "gps", "week": 2000, "seconds": "t"}, {"t": [1]}, "leap_seconds: missing"),
        ({"kind": "sundial"}, {"t": [1]}, "time"),
    ],
)
def test_wrong_time_is_one_clear_line(base: dict[str, Any], columns: dict[str, Any], line: str):
    with pytest.raises(InputError, match=line) as caught:
        clock(base, columns)
    assert "\n" not in str(caught.value)


def test_pulses_that_wrap_give_the_speed_and_a_reset_is_lost():
    """A wheel of 0.46 m at 20 m/s, 100 pulses a revolution, an 8-bit count at 20 Hz; the count restarts at row 60."""
    time = np.arange(100) / 20
    count = np.floor(20 / 0.46 / (2 * np.pi) * 100 * time)
    count[60:] -= count[60] + 100
    channel = Channel.build({"column": "n", "pulses": {"per_revolution": 100, "modulus": 256, "radius": 0.46}})
    table = Table({"n": Column("n", count % 256)})
    notes = Notes()
    speed = from_pulses("wheelset1.speed [m/s]", channel, table, time, None, notes)
    step = 2 * np.pi / 100 * 0.46 * 20  # one pulse more or less
    good = np.delete(np.arange(100), [0, 60])
    assert np.isnan(speed[0])
    assert np.abs(speed[good] - 20).max() <= step
    assert abs(speed[1:60].mean() - 20) < step / 50
