"""The study of faults of files and machines: it sees what it looks for, and a part of it holds."""

import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.fault_injection.robustness import study
from experiments.fault_injection.robustness.attempt import LONGEST, Attempt, Ending, ended
from experiments.fault_injection.robustness.mutations import damaged_bytes, damaged_json, flipped
from experiments.fault_injection.robustness.run import page, perform
from experiments.fault_injection.robustness.targets import targets
from experiments.fault_injection.robustness.workshop import make_workshop
from railsim.errors import InputError, printable
from railsim.files import replace_file


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_workshop(tmp_path_factory.mktemp("robustness") / "workshop")


def _ending(text: str = "", code: int = 2, processor: float = 1.0, memory: int = 0) -> Ending:
    return Ending(code, processor, processor, memory, text)


@pytest.mark.parametrize(
    ("ending", "fault"),
    [
        (_ending("railsim: x\nTraceback (most recent call last):"), "traceback"),
        (_ending("railsim: x", code=3), "unforeseen error"),
        (_ending("railsim: x", code=-signal.SIGSEGV), "ended by a signal"),
        (_ending("railsim: x", processor=LONGEST + 1), "hang"),
        (_ending("railsim: x", memory=3 * 1024**3), "memory"),
        (_ending("nothing to say"), "no reason given"),
        (_ending("railsim: " + "x" * 2000), "long line"),
        (_ending("railsim: \x1b[31mred"), "control characters"),
    ],
)
def test_each_fault_is_seen(ending: Ending, fault: str):
    assert ending.faults == (fault,)
    assert _ending("railsim: x; do y").faults == ()


def test_a_call_is_watched_stopped_and_limited(tmp_path: Path):
    def write() -> int:
        print("begun", flush=True)
        (tmp_path / "large").write_bytes(bytes(100_000))
        return 0

    assert ended(Attempt(write, tmp_path / "said")).text == "begun\n"
    small = ended(Attempt(write, tmp_path / "said", largest=1000))
    assert "File too large" in small.text
    slow = ended(Attempt(lambda: time.sleep(20) or 0, tmp_path / "said", (0.2, signal.SIGKILL)))
    assert (slow.code, slow.seconds < 5.0) == (-signal.SIGKILL, True)
    assert ended(Attempt(lambda: sys.exit(7), tmp_path / "said")).code == 7
    told = ended(Attempt(lambda: int(os.environ["TOLD"]), tmp_path / "said", environment={"TOLD": "5"}))
    assert told.code == 5


def test_damage_changes_something_and_depends_on_its_seed():
    content = b'{"a": [1, 2, {"b": "text"}], "c": 3.5}\n' * 3
    for number in range(50):
        one, other = (damaged_bytes(content, np.random.default_rng(number)) for _ in range(2))
        assert one == other
        changed = flipped(content, np.random.default_rng(number))
        assert sum(a != b for a, b in zip(changed, content, strict=True)) == 1
    found = {damaged_json(b'{"a": [1, 2, {"b": "text"}], "c": 3.5}', np.random.default_rng(n)) for n in range(50)}
    assert len(found) > 30


@pytest.mark.parametrize("number", range(len(targets())))
def test_a_damaged_file_of_every_kind(number: int, workshop: Path, tmp_path: Path):
    place = tmp_path / "place"
    place.mkdir()
    result = study.damaged_input(number, workshop, place)
    assert result.faults == (), result.text


@pytest.mark.parametrize("name", ["scenario", "sweep", "laws of a benchmark", "track", "map"])
def test_what_is_whole_is_used(name: str, workshop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Else the study would damage what is refused anyway."""
    target = next(one for one in targets() if one.name == name)
    monkeypatch.setattr(study, "targets", lambda: [replace(target, damage=lambda content, _: content)])
    place = tmp_path / "place"
    place.mkdir()
    result = study.damaged_input(0, workshop, place)
    assert (result.ending, result.faults) == ("used", ()), result.text


@pytest.mark.parametrize(
    ("kind", "number"), [("stop", 0), ("stop", 2), ("stop", 4), ("full disk", 0), ("full disk", 3)]
)
def test_a_stop_and_a_full_disk(kind: str, number: int, workshop: Path, tmp_path: Path):
    place = tmp_path / "place"
    place.mkdir()
    result = study.KINDS[kind][0](number, workshop, place)
    assert result.faults == (), result.text


@pytest.mark.parametrize("number", range(0, 13, 3))
def test_a_flipped_bit(number: int, workshop: Path, tmp_path: Path):
    place = tmp_path / "place"
    place.mkdir()
    result = study.flipped_bit(number, workshop, place)
    assert result.faults == ()
    assert result.ending in ("noticed", "harmless")


def test_what_is_made_is_kept_and_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    made: list[int] = []

    def case(number: int, workshop: Path, place: Path) -> study.Result:
        made.append(number)
        faults = ("traceback",) if number == 2 else ()
        return study.Result("a file", "refused", faults, 0.5, 2**20, "")

    monkeypatch.setitem(study.KINDS, "stop", (case, 4))
    (tmp_path / "workshop").mkdir()
    perform(tmp_path, ["stop"], 1.0, "1/2")
    results = perform(tmp_path, ["stop"], 1.0, None)
    assert made == [0, 2, 1, 3]
    text = page(results)
    assert "- stop: 4 cases, 1 not as they should be" in text
    assert "| stop | a file | 4 | 4 refused | 0.5 | 1 | 1 traceback |" in text
    replace_file(tmp_path / "cases" / "stop-0001.json", b"{}")
    with pytest.raises(InputError, match="is not a case of this study"):
        perform(tmp_path, ["stop"], 1.0, None)


def test_messages_show_what_hides_and_end():
    assert printable("a\x1b[31m‮b\n c") == "a<U+001B>[31m<U+202E>b c"
    assert len(printable("x" * 10_000)) <= 1500
    assert printable("begin " + "x" * 10_000 + " end").endswith("x end")
