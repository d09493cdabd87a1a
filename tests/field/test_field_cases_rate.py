"""Rates of stamps that are rounded, jitter or have gaps; snap; times that go back or appear twice."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.cli import main
from railsim.stamps import usual_step
from tests.field.imports import UP, csv, followed, mapped, proposed, rate, refusal, run, time, told, values

AT = np.arange(2000)


def stamps(true: float, resolution: float, how: Any = np.rint) -> np.ndarray:
    """2000 times at a true rate, rounded."""
    return how(AT / true / resolution) * resolution


@pytest.mark.parametrize(
    ("true", "resolution"),
    [(128, 1e-3), (256, 1e-3), (40, 1e-3), (40, 1e-2), (80, 1e-3), (80, 1e-2), (60, 1e-2), (25_600, 1e-9), (51, 1e-3)],
)  # fmt: skip
@pytest.mark.parametrize("how", [np.rint, np.floor])
@pytest.mark.parametrize("gone", ["none", "a gap", "rows here and there"])
def test_rate_of_rounded_stamps(true: float, resolution: float, how: Any, gone: str):
    keep = np.ones(AT.size, dtype=bool)
    if gone == "a gap":
        keep[700:905] = False
    elif gone == "rows here and there":
        keep[np.random.default_rng(4).choice(np.arange(1, 1999), 15, replace=False)] = False
    found = usual_step(stamps(true, resolution, how)[keep])
    allowed = 2 * resolution * true / AT.size
    assert 1 / found.size == pytest.approx(true, rel=max(allowed, 1e-9))
    if resolution * true < 0.5:
        assert int(found.numbers[-1]) == AT.size - 1


def test_late_stamps_do_not_count_as_missing_rows():
    late = AT / 100.0
    late[100:1900:50] += 0.008
    found = usual_step(late)
    assert found.size == pytest.approx(0.01, rel=1e-5)
    assert found.numbers[-1] == AT.size - 1


@pytest.mark.parametrize(("true", "unit"), [(128, "ms"), (256, "ms"), (40, "ms"), (25_600, "ns")])
@pytest.mark.parametrize("stated", [True, False])
def test_recording_of_rounded_stamps_has_the_true_rate_and_opens(tmp_path: Path, true: float, unit: str, stated: bool):
    factor = {"ms": 1e3, "ns": 1e9}[unit]
    text = csv({"t": np.rint(AT / true * factor), "az": 9.81 + 0.01 * np.sin(AT)}, numbers="%.12g")
    more: dict[str, Any] = {"rate": true} if stated else {}
    seen = run(tmp_path, text, mapped({"kind": "seconds", "column": "t", "unit": unit}, **more))
    assert rate(seen) == true
    assert (tmp_path / "out" / "measured" / f"{true}hz.parquet").exists()
    snapped = run(tmp_path, text, mapped({"kind": "seconds", "column": "t", "unit": unit}, repair=["snap"], **more))
    assert np.abs(time(snapped) - AT / true).max() < 1 / factor
    assert np.isfinite(values(snapped)).all()


def test_rate_beyond_six_digits_can_be_inspected(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    at = AT / 51.159532
    at[600:640] += 0.004
    seen = run(tmp_path, csv({"t": at, "az": 9.81 + 0.05 * np.sin(AT)}, numbers="%.9f"), mapped())
    assert rate(seen) == pytest.approx(51.159532, rel=1e-5)
    assert main(["inspect", str(tmp_path / "out")]) == 1
    assert "clock" in capsys.readouterr().out


def test_snap_is_refused_where_a_row_moves_by_more_than_half_a_step(tmp_path: Path):
    """A phone that changes from 20.46 to 17.05 Hz: snap moved rows by seconds."""
    at = np.cumsum(np.r_[0.1, np.full(408, 0.0488744), np.full(600, 0.058649)])
    text = csv({"t": at, "az": np.sin(at)}, numbers="%.9f")
    plain = mapped(repair=["snap"])
    line = refusal(tmp_path, text, plain)
    assert "more than half a step" in line and "from 20.46 to 17.05 Hz at row 409" in line
    even = run(tmp_path, text, followed(plain, proposed(line, "repair:")))
    assert np.ptp(np.diff(time(even))) < 1e-9
    good = np.isfinite(values(even))
    assert np.abs(values(even)[good] - np.sin(time(even)[good])).max() < 1e-3
    first = run(tmp_path, text, followed(plain, proposed(line, "rows: {last")))
    assert rate(first) == pytest.approx(20.4606, rel=1e-4)
    second = run(tmp_path, text, followed(plain, proposed(line, "rows: {first")))
    assert rate(second) == pytest.approx(17.0506, rel=1e-4)
    assert values(first).size + values(second).size == at.size


def test_stated_rate_that_is_wrong_is_refused_with_the_right_one(tmp_path: Path):
    text = csv({"t": AT / 100, "az": np.sin(AT)})
    line = refusal(tmp_path, text, mapped(rate=128))
    assert rate(run(tmp_path, text, followed(mapped(), proposed(line, "rate:")))) == 100.0


def test_packets_out_of_order_are_sorted(tmp_path: Path):
    order = AT.reshape(-1, 10)[[*range(50), 51, 50, *range(52, 200)]].ravel()
    text = csv({"t": order / 100, "az": np.sin(order)})
    line = refusal(tmp_path, text, mapped())
    assert "out of order" in line and "'sort'" in line
    seen = run(tmp_path, text, mapped(repair=["sort"]))
    np.testing.assert_allclose(values(seen), np.sin(AT), atol=1e-9)


@pytest.mark.parametrize("amount", [0.5, 7.25])
def test_clock_that_was_set_back_goes_on(tmp_path: Path, amount: float):
    at = AT / 100 - amount * (AT >= 900)
    text = csv({"t": at, "az": np.sin(AT)})
    line = refusal(tmp_path, text, mapped())
    assert "as a clock that is set does" in line and "'continue'" in line and "'sort'" not in line
    seen = run(tmp_path, text, mapped(repair=["continue"]))
    np.testing.assert_allclose(time(seen), AT / 100, atol=1e-9)
    np.testing.assert_allclose(values(seen), np.sin(AT), atol=1e-9)


def test_recording_that_began_again_is_split(tmp_path: Path):
    at = np.r_[np.arange(1200), np.arange(800)] / 100
    text = csv({"t": at, "az": np.sin(AT)})
    line = refusal(tmp_path, text, mapped())
    assert "started again" in line
    first = run(tmp_path, text, followed(mapped(), proposed(line, "rows: {last")))
    assert values(first).size == 1200
    assert values(run(tmp_path, text, followed(mapped(), proposed(line, "rows: {first")))).size == 800


@pytest.mark.parametrize(("modulus", "unit"), [(86_400, "s"), (65_536, "ms")])
def test_elapsed_time_that_wraps_is_a_counter(tmp_path: Path, modulus: int, unit: str):
    factor = {"s": 1, "ms": 1000}[unit]
    step = 5 if unit == "s" else 100
    count = (modulus - 1000 * step + step * AT) % modulus if unit == "s" else (step * AT + 7) % modulus
    base = {"kind": "seconds", "column": "t", "unit": unit}
    text = csv({"t": count, "az": np.sin(AT)})
    line = refusal(tmp_path, text, mapped(base))
    seen = run(tmp_path, text, followed(mapped(base), proposed(line, "time: {kind: counter")))
    np.testing.assert_allclose(time(seen), step * AT / factor, atol=1e-6)


@pytest.mark.parametrize("packet", [5, 20])
def test_samples_that_share_the_stamp_of_their_packet_are_spread(tmp_path: Path, packet: int):
    at = AT // packet * packet / 200
    text = csv({"t": at, "az": np.sin(AT)})
    line = refusal(tmp_path, text, mapped())
    assert "share the stamp of their packet" in line or "packets have one each" in line
    assert "'spread'" in line and "'drop_duplicates'" not in line
    assert refusal(tmp_path, text, mapped(repair=["drop_duplicates"])) == line
    seen = run(tmp_path, text, mapped(repair=["spread"]))
    assert rate(seen) == 200.0
    np.testing.assert_allclose(time(seen), AT / 200, atol=1e-6)


def test_lost_packet_stays_a_gap_when_rows_are_spread(tmp_path: Path):
    number = np.delete(AT, np.r_[600:640, 1200:1220])
    at = number // 20 * 20 / 200
    seen = run(tmp_path, csv({"t": at, "az": np.sin(number)}), mapped(repair=["spread"]))
    np.testing.assert_allclose(time(seen), number / 200, atol=1e-6)


def test_stamps_that_are_coarser_than_the_rows_are_spread(tmp_path: Path):
    """1613 Hz with stamps of 1 ms."""
    at = np.floor(1e3 * AT / 1613) / 1e3
    text = csv({"t": at, "az": np.sin(AT)})
    assert "coarser than the rows" in refusal(tmp_path, text, mapped())
    seen = run(tmp_path, text, mapped(repair=["spread"]))
    assert rate(seen) == pytest.approx(1613, rel=1e-3)
    assert np.abs(time(seen) - AT / 1613).max() < 1.5e-3


def test_rows_that_were_written_twice_are_dropped(tmp_path: Path):
    twice = np.sort(np.r_[AT, AT[500:700]])
    text = csv({"t": twice / 100, "az": np.sin(twice)})
    line = refusal(tmp_path, text, mapped())
    assert "with the same values" in line and "'drop_duplicates'" in line
    seen = run(tmp_path, text, mapped(repair=["drop_duplicates"]))
    np.testing.assert_allclose(values(seen), np.sin(AT), atol=1e-9)


def test_held_values_become_a_table_of_their_own(tmp_path: Path):
    """A receiver of 1 Hz whose last value is repeated at 100 Hz; its value stays the same from 9 to 10 s."""
    speed = 15 + 0.05 * np.minimum(AT // 100, 9) + 0.05 * np.maximum(AT // 100 - 10, 0)
    text = csv({"t": AT / 100, "az": np.sin(AT), "v": speed})
    both = mapped()
    both["tables"][0]["channels"]["gnss.speed [m/s]"] = {"column": "v", "unit": "m/s"}
    assert told(run(tmp_path, text, both), "rows: changed")
    apart = mapped()
    slow = {"column": "v", "unit": "m/s"}
    apart["tables"].append(
        {"time": apart["tables"][0]["time"], "rate": 1, "rows": "filled", "channels": {"gnss.speed [m/s]": slow}}
    )
    assert "'rows: changed'" in refusal(tmp_path, text, apart)
    apart["tables"][1]["rows"] = "changed"
    seen = run(tmp_path, text, apart)
    assert rate(seen) == 100.0 and rate(seen, "gnss.speed [m/s]") == 1.0
    np.testing.assert_allclose(time(seen, "gnss.speed [m/s]"), np.arange(20), atol=1e-9)
    np.testing.assert_allclose(values(seen, "gnss.speed [m/s]"), speed[::100], atol=1e-9)
    assert UP in seen.measurements


@pytest.mark.parametrize("wrong", [-7.7, 3000.0, 0.03])
def test_single_stamp_that_is_wrong_is_left_out(tmp_path: Path, wrong: float):
    at = AT / 100
    at[770] += wrong
    text = csv({"t": at, "az": np.sin(AT)}, numbers="%.9f")
    line = refusal(tmp_path, text, mapped())
    assert "single stamps" in line and "'sort'" not in line
    assert refusal(tmp_path, text, mapped(repair=["sort"])) == line
    seen = run(tmp_path, text, mapped(repair=["drop_outliers"]))
    np.testing.assert_allclose(time(seen), np.delete(AT, 770) / 100, atol=1e-9)
    assert told(seen, "1 times that stand apart")


def test_wrong_date_does_not_set_the_beginning(tmp_path: Path):
    stamps = [f"2024-05-03T10:00:{i / 10:04.1f}Z" for i in range(100)]
    stamps[40] = "1970-01-01T00:00:00.0Z"
    text = csv({"t": stamps, "az": np.sin(AT[:100])})
    seen = run(tmp_path, text, mapped({"kind": "iso", "column": "t"}, repair=["drop_outliers"]))
    assert seen.measurements.about["start"] == "2024-05-03T10:00:00+00:00"
    assert rate(seen) == 10.0


def test_packets_that_came_twice(tmp_path: Path):
    order = AT.reshape(-1, 20)[[*range(30), 29, *range(30, 70), 68, *range(70, 100)]].ravel()
    text = csv({"t": order / 100, "az": np.sin(order)})
    line = refusal(tmp_path, text, mapped())
    seen = run(tmp_path, text, followed(mapped(), proposed(line, "repair:")))
    np.testing.assert_allclose(time(seen), AT / 100, atol=1e-9)
    np.testing.assert_allclose(values(seen), np.sin(AT), atol=1e-9)
