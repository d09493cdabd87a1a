"""Damaged files of every format: one clear line or a result, no hang, nothing written but the place that was named.

`RAILSIM_FUZZ` sets how many inputs there are (2000 for the full check).
"""

import os
import shutil
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from railsim import Recording
from railsim.errors import InputError
from railsim.field.guard import Guard
from railsim.scratch import LOCK
from railsim.track.files import read_track
from tests.field.damage import Target, damaged, damages, targets

COUNT = int(os.environ.get("RAILSIM_FUZZ", "200"))
LONGEST = 25.0  # s for one input; the reading process is ended after 10 s
NAMES = [
    "csv", "map", "parquet", "mdf4", "tdms", "mat", "mat73", "hdf5", "nmea", "gpx", "car", "track", "profile",
    "scenario", "estimate", "recording about.json", "recording measured/256hz.parquet", "recording track.csv",
    "recording truth/about.json", "recording truth/channels.parquet",
]  # fmt: skip


class Watch:
    """Files that this process opens for writing, removes or renames while `on`."""

    def __init__(self) -> None:
        self.on = False
        self.touched: list[str] = []

    def __call__(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self.on:
            return
        if event == "open" and (isinstance(arguments[1], str) and set(arguments[1]) & set("wax+")):
            self.touched.append(os.fsdecode(arguments[0]) if isinstance(arguments[0], str | bytes) else "")
        elif event in ("os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.chmod"):
            self.touched += [os.fsdecode(one) for one in arguments[:2] if isinstance(one, str | bytes | os.PathLike)]
        elif event in ("os.system", "os.exec", "subprocess.Popen", "socket.connect"):
            self.touched.append(event)


@pytest.fixture(scope="module")
def watch() -> Watch:
    """A hook cannot be taken out again, so there is one and it is switched."""
    hook = Watch()
    sys.addaudithook(hook)
    return hook


@pytest.fixture(scope="module")
def reading() -> Iterator[Guard]:
    with Guard(seconds=10.0) as guard:
        yield guard


@pytest.fixture(scope="module")
def whole(original: Recording, reading: Guard, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Target]:
    return {one.name: one for one in targets(original, reading, tmp_path_factory.mktemp("fuzz"))}


@pytest.fixture(scope="module")
def outcomes() -> Iterator[Counter[str]]:
    """Counted over all; printed at the end of a full run."""
    counter: Counter[str] = Counter()
    yield counter
    if COUNT >= 2000:
        print(f"\n{sum(counter.values())} damaged inputs: {dict(sorted(counter.items()))}", file=sys.__stderr__)


def test_every_target_has_a_test(whole: dict[str, Target], tmp_path: Path):
    assert sorted(whole) == sorted(NAMES)
    assert sum(one.share for one in whole.values()) >= 1.0
    for one in whole.values():
        one.read(tmp_path)  # all are read while they are whole
        shutil.rmtree(tmp_path)
        tmp_path.mkdir()


@pytest.mark.parametrize("name", NAMES)
def test_damaged_file(
    name: str, whole: dict[str, Target], watch: Watch, reading: Guard, outcomes: Counter[str], tmp_path: Path
):
    target = whole[name]
    before = target.file.read_bytes()
    others = _contents(target.file.parent) - {target.file}
    bound = settings(
        max_examples=max(3, round(target.share * COUNT)), database=None, derandomize=COUNT < 2000, deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large], print_blob=True,
    )  # fmt: skip

    out = tmp_path / "out"

    @bound
    @given(damages(target.text))
    def attack(edits: list[tuple[str, float, bytes]]) -> None:
        target.file.write_bytes(damaged(before, edits))
        shutil.rmtree(out, ignore_errors=True)  # what a former failure has left
        out.mkdir()
        started = time.monotonic()
        try:
            kind = _outcome(target, out, watch, reading)
        finally:
            watch.on = False
        assert time.monotonic() - started < LONGEST
        outcomes[f"{name}: {kind}"] += 1
        _check_written(out, kind)
        shutil.rmtree(out)
        assert list(tmp_path.iterdir()) == []
        assert _contents(target.file.parent) - {target.file} == others

    try:
        attack()
    finally:
        target.file.write_bytes(before)


def _outcome(target: Target, out: Path, watch: Watch, reading: Guard) -> str:
    """How the read ended; whatever else than an `InputError` of one line it raises is passed on."""
    if reading.alive:
        watch.touched.clear()
        watch.on = True
    try:
        target.read(out)
    except InputError as error:
        text = str(error)
        assert text.strip()
        assert "\n" not in text and "Traceback" not in text
        assert len(text) < 4000
        kind = "refused"
    else:
        kind = "read"
    watch.on = False
    outside = [
        one for one in watch.touched if not one.startswith(str(out.parent)) and one not in ("", "subprocess.Popen")
    ]
    assert [one for one in outside if not _harmless(one)] == []
    return kind


def _harmless(touched: str) -> bool:
    """Python's own caches, the reading process's folder (started again after it was ended), scratch folders that go."""
    return "__pycache__" in touched or "railsim-reading." in touched or touched in (os.devnull, LOCK, "content")


def _check_written(out: Path, kind: str) -> None:
    """What was refused has left nothing; what was read can be opened."""
    written = sorted(path.name for path in out.iterdir())
    if kind == "refused":
        assert written == []
    elif written == ["recording"]:
        assert Recording.open(out / "recording").measurements.channels
    elif written == ["track.csv"]:
        assert read_track(out / "track.csv").s.size > 3
    else:
        assert written == []


def _contents(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))
