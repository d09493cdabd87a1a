"""What a killed process leaves is removed, and nothing that lives or belongs to others."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from railsim import scratch
from railsim.files import write_folder_atomically
from railsim.scratch import LOCK, alone_in, scratch_folder, writable_or_temporary

WRITES = """
import sys, time
from pathlib import Path
from railsim.files import write_folder_atomically
with write_folder_atomically(Path(sys.argv[1])) as aside:
    (aside / "part").write_text("half")
    print("ready", flush=True)
    time.sleep(60)
"""


@pytest.fixture(autouse=True)
def _first_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scratch, "_swept", set())


def start(target: Path) -> subprocess.Popen[str]:
    process = subprocess.Popen([sys.executable, "-c", WRITES, str(target)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path: Path) -> None:
    process = start(tmp_path / "result")
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert [path.name.partition("-")[0] for path in tmp_path.iterdir()] == ["result.partial"]
    with write_folder_atomically(tmp_path / "other"):
        pass
    assert os.listdir(tmp_path) == ["other"]


def test_what_a_living_process_writes_stays(tmp_path: Path) -> None:
    process = start(tmp_path / "result")
    try:
        with scratch_folder("mine", tmp_path):
            left = [path.name for path in tmp_path.iterdir() if path.name.startswith("result.partial-")]
        assert len(left) == 1
        assert (tmp_path / left[0] / "content" / "part").read_text() == "half"
    finally:
        process.kill()
        process.wait()


def test_folders_of_others_stay(tmp_path: Path) -> None:
    (tmp_path / "thesis.partial-draft").mkdir()
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / LOCK).touch()
    (tmp_path / "link.partial-x").symlink_to(foreign)
    with scratch_folder("mine", tmp_path):
        pass
    assert sorted(os.listdir(tmp_path)) == ["foreign", "link.partial-x", "thesis.partial-draft"]
    assert (foreign / LOCK).exists()


def test_an_older_result_that_a_kill_left_aside_comes_back(tmp_path: Path) -> None:
    dead = tmp_path / "result.partial-abc"
    (dead / "replaced").mkdir(parents=True)
    (dead / LOCK).touch()
    (dead / "replaced" / "part").write_text("old")
    with scratch_folder("mine", tmp_path):
        pass
    assert (tmp_path / "result" / "part").read_text() == "old"


def test_an_older_result_is_there_at_every_moment(tmp_path: Path) -> None:
    target = tmp_path / "result"
    watcher = "import os, sys\nwhile True:\n    print(os.path.exists(sys.argv[1]))"
    with write_folder_atomically(target) as aside:
        (aside / "part").touch()
    process = subprocess.Popen([sys.executable, "-c", watcher, str(target)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "True\n"
    for _ in range(50):
        with write_folder_atomically(target) as aside:
            (aside / "part").touch()
        time.sleep(0.001)
    process.kill()
    assert "False" not in process.communicate()[0]


def test_two_writers_take_turns(tmp_path: Path) -> None:
    with alone_in(tmp_path):
        program = "import sys\nfrom pathlib import Path\nfrom railsim.scratch import scratch_folder\n"
        program += "with scratch_folder('x', Path(sys.argv[1])):\n    print('made', flush=True)"
        process = subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], stdout=subprocess.PIPE, text=True)
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(1.0)
    assert process.communicate()[0] == "made\n"


def test_a_cache_that_cannot_be_written_is_said_and_replaced_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setenv("RAILSIM_TEST", "")
    with pytest.warns(scratch.Noticed, match="cannot write .*: runs are not kept; set RAILSIM_TEST to a folder"):
        first = writable_or_temporary(file / "cache", "runs", "RAILSIM_TEST")
    assert (first.is_dir(), os.environ["RAILSIM_TEST"]) == (True, str(first))
    assert writable_or_temporary(file / "cache", "runs", "RAILSIM_TEST") == first
    assert writable_or_temporary(tmp_path / "cache", "runs", "RAILSIM_TEST") == tmp_path / "cache"
