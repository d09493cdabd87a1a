"""Long records are inspected in parts: the same faults, in the same places, at a cost that grows with the length."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from railsim.measurements import TIME, Measurements
from railsim.quality import blocks, inspection
from railsim.quality.blocks import parts, together
from railsim.quality.inspection import inspect
from railsim.quality.interface import Finding
from tests.quality import test_checks as made

SIDE = "bogie.acceleration_y [m/s2]"


@pytest.fixture
def frames(monkeypatch: pytest.MonkeyPatch) -> tuple[dict[str, object], made.Frames]:
    """A rigid bogie over 100 s, which is long here: parts have 20 s."""
    monkeypatch.setattr(made, "LENGTH", 100.0)
    monkeypatch.setattr(inspection, "LONGEST", 30.0)
    monkeypatch.setattr(blocks, "PART", 20.0)
    return made._bogie(1)


def measured(frames: tuple[dict[str, object], made.Frames]) -> Measurements:
    return Measurements(frames[0], frames[1])


def test_parts_hold_every_sample_once(frames: tuple[dict[str, object], made.Frames]):
    whole = measured(frames)
    found = list(parts(whole))
    assert [one.number for one in found] == [0, 1, 2, 3, 4] and {one.count for one in found} == {5}
    for name in whole:
        pieces = [one.measured[name] for one in found]
        assert np.array_equal(np.concatenate(pieces), whole[name]) and all(
            np.shares_memory(one, whole[name]) for one in pieces
        )
        firsts = [one.firsts[whole.rate(name)] for one in found]
        assert firsts == np.cumsum([0, *(one.size for one in pieces)])[:-1].tolist()


def test_nothing_is_found_in_a_long_rigid_bogie(frames: tuple[dict[str, object], made.Frames]):
    assert inspect(measured(frames)).findings == []


def test_spikes_keep_their_places_and_are_mended(frames: tuple[dict[str, object], made.Frames]):
    clean = frames[1][made.RATE][SIDE].copy()
    at = [1000, 9000, 9500, 23000]
    frames[1][made.RATE][SIDE][at] += 8.0
    done = inspect(measured(frames))
    spikes = [one for one in done.faults if one.kind == "spikes"]
    assert [one.samples.tolist() for one in spikes if one.samples is not None] == [[1000, 9000, 9500], [23000]]
    assert spikes[0].start == pytest.approx(1000 / made.RATE) and "in 2 of 5 parts" in spikes[0].extent
    assert np.abs(done.cleaned[SIDE] - clean).max() < 1.0
    assert np.array_equal(done.cleaned.time(SIDE), frames[1][made.RATE][TIME])
    assert inspect(measured(frames), clean=False).cleaned[SIDE][1000] > clean[1000] + 7.0


def test_an_offset_of_the_whole_record_is_one_finding(frames: tuple[dict[str, object], made.Frames]):
    frames[1][made.RATE][SIDE] += 2.0
    found = [one for one in inspect(measured(frames)).faults if one.kind == "offset"]
    assert len(found) == 1 and found[0].channel == SIDE
    assert found[0].start == 0.0 and found[0].end == pytest.approx(100.0, abs=0.1) and "5 of 5 parts" in found[0].extent


def test_a_gain_that_changes_in_one_part_is_placed(frames: tuple[dict[str, object], made.Frames]):
    frames[1][made.RATE][made.LEAD_Z][round(45 * 256) : round(52 * 256)] *= 0.7
    found = [one for one in inspect(measured(frames)).faults if one.kind == "gain change"]
    assert len(found) == 1 and found[0].channel == made.LEAD_Z
    assert (found[0].start, found[0].end) == pytest.approx((45.0, 52.0), abs=0.3)


def test_findings_are_joined_where_parts_follow_each_other():
    def one(kind: str, start: float) -> Finding:
        return Finding(kind, SIDE, start, start + 1.0, f"at {start:g}", "mend it")

    found = together(
        [(0, one("noise", 5.0)), (1, one("noise", 25.0)), (3, one("noise", 65.0)), (3, one("stuck", 65.0))], 5
    )
    assert [(each.kind, each.start, each.end) for each in found] == [
        ("noise", 5.0, 26.0),
        ("noise", 65.0, 66.0),
        ("stuck", 65.0, 66.0),
    ]
    assert "in 2 of 5 parts" in found[0].extent and "parts" not in found[1].extent


_PROGRAM = """
import sys
from pathlib import Path
from railsim.measurements import Measurements
from railsim.quality.inspection import inspect
from tests.quality import test_checks as made
made.LENGTH = float(sys.argv[1])
seen = Measurements(*made._bogie(1))
def most():  # of this program; getrusage begins with what the process had that started it
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 2**20
base = most()
inspect(seen, clean=False)
print(base, most())
"""


def test_half_an_hour_is_inspected_in_less_than_a_gibibyte():
    root = Path(__file__).parents[2]
    words = [sys.executable, "-c", _PROGRAM, "1800"]
    done = subprocess.run(words, capture_output=True, text=True, check=True, cwd=root, timeout=300)
    before, most = map(float, done.stdout.split())
    assert most < 1.0 and most - before < 0.5  # GiB; stretches of the whole record would take 8
