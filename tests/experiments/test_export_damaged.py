"""Damaged recordings and estimates through `railsim export`: one line or a whole file, nothing else left behind."""

import dataclasses
import random
from pathlib import Path

import pytest

from experiments.cli import main
from railsim.field.exporting import FORMATS, MAPS
from tests.experiments.maintenance.test_map import estimate, recording
from tests.field.damage import TEXTS, WORDS, damaged

COUNT = 160
KINDS = ("cut", "drop", "double", "put", "over", "zero")
EVENTS = [{"kind": "joint", "s [m]": 60.0, "time [s]": 3.0, "depth [m]": 3e-3}, {"kind": "switch", "s [m]": 90.0}]


def edits(source: random.Random, text: bool) -> list[tuple[str, float, bytes]]:
    """One to four, as of `tests.field.damage`."""
    words = TEXTS if text else WORDS
    return [
        (
            source.choice(KINDS),
            source.random(),
            source.choice(words) if source.random() < 0.5 else source.randbytes(source.randint(1, 16)),
        )
        for _ in range(source.randint(1, 4))
    ]


def test_damage_gives_one_line_or_a_whole_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    made = recording(tmp_path / "rec")
    dataclasses.replace(estimate(), about={"events": EVENTS}).save(tmp_path / "est", recording=made)
    names = ("est/about.json", "est/estimate.parquet", "rec/about.json", "rec/measured/1hz.parquet")
    files, out, source = [tmp_path / name for name in names], tmp_path / "out", random.Random(7)
    out.mkdir()
    codes = []
    for number in range(COUNT):
        file, ending = files[number % len(files)], source.choice([*FORMATS, *MAPS])
        folder = "est" if ending in MAPS or file.parent.name == "est" else "rec"
        before = file.read_bytes()
        file.write_bytes(damaged(before, edits(source, file.suffix == ".json")))
        codes.append(main(["export", str(tmp_path / folder), "--to", str(out / f"x{ending}")]))
        file.write_bytes(before)
        said = capsys.readouterr().err
        assert codes[-1] in (0, 2) and said.count("\n") == (codes[-1] == 2), said
        assert [one.name for one in out.iterdir()] == ([f"x{ending}"] if codes[-1] == 0 else [])
        for one in out.iterdir():
            one.unlink()
    assert 0 < codes.count(0) < COUNT // 2
