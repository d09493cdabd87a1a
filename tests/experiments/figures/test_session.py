"""All figures in one go: on processes, kept, resumed, with the time that is left."""

import json
from pathlib import Path

import pytest

from experiments.cli import main
from experiments.figures import costs
from experiments.figures.countdown import Countdown
from experiments.figures.interface import FIGURES
from experiments.figures.kept import FOLDER
from experiments.figures.session import Result, publish_all
from experiments.reporting.size import Size
from experiments.sweep.run import Interrupted
from railsim.cache import VARIABLE as CACHE
from railsim.errors import InputError
from railsim.plugins import VARIABLE as PLUGINS

NAMES = ("quick_one", "quick_two")
FIGURE = """
import os
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, exactly


class Quick(Figure):
    def compute(self, size):
        with Path({log!r}).open("a") as log:
            log.write(self.name + "\\n")
        if self.name in os.environ.get("TEST_KILL", ""):
            {end}
        return pd.DataFrame({{"x": [1.0]}})

    def draw(self, table):
        return Picture()

    def check(self, table):
        return [Claim.definite("one", float(table["x"][0]), exactly(1.0))]
"""


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two figures in a plug-in folder; each writes its name into this file when it is computed."""
    (tmp_path / "plugins" / "figures").mkdir(parents=True)
    ends = ("raise KeyboardInterrupt", "os._exit(1)")
    for name, end in zip(NAMES, ends, strict=True):
        text = FIGURE.format(log=str(tmp_path / "log"), end=end)
        (tmp_path / "plugins" / "figures" / f"{name}.py").write_text(text)
    monkeypatch.setenv(PLUGINS, str(tmp_path / "plugins"))
    monkeypatch.setenv(CACHE, str(tmp_path / "cache" / "truth"))
    return tmp_path / "log"


def publish(folder: Path, jobs: int = 1, names: tuple[str, ...] = NAMES) -> tuple[dict[str, Result], list[str]]:
    said: list[str] = []
    return publish_all(names, folder, Size.FAST, jobs, said.append), said


@pytest.mark.parametrize("change", ["table", "kept", "program"])
def test_what_is_not_as_it_was_is_made_again(log: Path, tmp_path: Path, change: str):
    publish(tmp_path / "out", names=NAMES[:1])
    whole = (tmp_path / "out" / "quick_one.csv").read_bytes()
    if change == "table":
        (tmp_path / "out" / "quick_one.csv").write_bytes(whole[:-2])
    elif change == "kept":
        (tmp_path / "out" / FOLDER / "fast" / "quick_one.json").write_text("{")
    else:
        (tmp_path / "plugins" / "figures" / "quick_two.py").write_text("")
    publish(tmp_path / "out", names=NAMES[:1])
    assert log.read_text().split() == ["quick_one"] * 2
    assert (tmp_path / "out" / "quick_one.csv").read_bytes() == whole


def test_interrupted_and_resumed(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr("railsim.registry.Kind._origins", lambda _: sorted((log.parent / "plugins").rglob("*.py")))
    command = ["figure", "all", "--out", str(tmp_path / "out"), "--fast", "--jobs", "1", "--json"]
    costs.learn(Size.FAST, "quick_two", 2.0)
    costs.learn(Size.FAST, "quick_one", 1.0)
    monkeypatch.setenv("TEST_KILL", "quick_one")
    assert main(command) == 130
    assert "what is finished is kept: the same command goes on" in capsys.readouterr().err
    assert log.read_text().split() == ["quick_two", "quick_one"]
    assert not (tmp_path / "out" / "quick_one.csv").exists()
    monkeypatch.delenv("TEST_KILL")
    assert main(command) == 0
    assert log.read_text().split() == ["quick_two", "quick_one", "quick_one"]
    assert list(json.loads(capsys.readouterr().out)["figures"]) == list(NAMES)


def test_a_lost_process_is_told(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TEST_KILL", "quick_two")
    with pytest.raises(InputError, match="killed or ran out of memory; what is finished is kept: call it again"):
        publish(tmp_path / "out", jobs=2)


PARTED = """
import os
from functools import partial
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure as Picture

from experiments.figures.parted import PartedFigure
from experiments.reporting.claims import Claim, exactly


def part(number):
    with Path({log!r}).open("a") as log:
        log.write(f"part_{{number}}\\n")
    if f"part_{{number}}" in os.environ.get("TEST_KILL", ""):
        raise KeyboardInterrupt
    return pd.DataFrame({{"x [m]": [number / 3.0], "name": [f"run {{number}}"], "seed": number}})


class Parted(PartedFigure):
    def parts(self, size):
        return {{f"part_{{number}}": partial(part, number) for number in range(3)}}

    def draw(self, table):
        return Picture()

    def check(self, table):
        return [Claim.definite("one", float(table["x [m]"].sum()), exactly(1.0))]
"""


@pytest.fixture
def parted(log: Path) -> Path:
    """A figure of three parts in the plug-in folder; each writes its name into this file when it is computed."""
    (log.parent / "plugins" / "figures" / "parted.py").write_text(PARTED.format(log=str(log)))
    return log


def test_two_processes_make_what_one_makes_and_what_is_finished_is_not_made_again(parted: Path, tmp_path: Path):
    names = (*NAMES, "parted")
    together, said = publish(tmp_path / "two", 2, names)
    assert said[0].startswith("3 figures, 0 finished before; about 0 s on 2 processes and 5 whose time is not known")
    assert said[-1].endswith("0 left, about 0 s")
    assert sorted(parted.read_text().split()) == ["part_0", "part_1", "part_2", *sorted(NAMES)]
    again, said = publish(tmp_path / "two", 2, names)
    assert said == ["3 figures, 3 finished before; about 0 s on 2 processes"]
    assert again == together
    publish(tmp_path / "one", 1, names)
    for name in names:
        for ending in ("png", "csv"):
            one, two = (tmp_path / folder / f"{name}.{ending}" for folder in ("one", "two"))
            assert one.read_bytes() == two.read_bytes()
    assert len(parted.read_text().split()) == 10


def test_parts_of_a_figure_are_kept_until_it_is_finished(
    parted: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    command = ["figure", "parted", "--out", str(tmp_path / "out"), "--fast", "--jobs", "1", "--json"]
    costs.learn(Size.FAST, "parted/part_0", 2.0)
    costs.learn(Size.FAST, "parted", 3.0)
    monkeypatch.setenv("TEST_KILL", "part_1")
    assert main(command) == 130
    told = capsys.readouterr().err
    assert "1 figures, 0 finished before; about 4 s on 1 processes" in told, "a third of 3 s where a part is not known"
    assert "parted/part_0: " in told
    monkeypatch.delenv("TEST_KILL")
    assert main(command) == 0
    assert sorted(parted.read_text().split()) == ["part_0", "part_1", "part_1", "part_2"]
    assert json.loads(capsys.readouterr().out)["figures"]["parted"]["claims"][0]["held"]
    whole = FIGURES.pick("parted")().compute(Size.FAST)
    assert (tmp_path / "out" / "parted.csv").read_text() == whole.to_csv(index=False)
    assert not list((tmp_path / "out" / FOLDER).rglob("*.parquet"))
    parted.unlink()
    assert main(command) == 0
    assert len(parted.read_text().split()) == 3, "what is asked for by its name is made again"


@pytest.mark.parametrize("change", ["broken", "program"])
def test_a_kept_part_that_is_not_as_it_was_is_made_again(
    parted: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
):
    monkeypatch.setenv("TEST_KILL", "part_2")
    with pytest.raises(Interrupted):
        publish(tmp_path / "out", names=("parted",))
    assert parted.read_text().split()[-1] == "part_2"
    kept = sorted((tmp_path / "out" / FOLDER).rglob("*.parquet"))
    before = len(parted.read_text().split())
    assert len(kept) == before - 1
    if change == "broken":
        kept[0].write_bytes(kept[0].read_bytes()[:-9])
    else:
        (tmp_path / "plugins" / "figures" / "quick_two.py").write_text("")
    monkeypatch.delenv("TEST_KILL")
    publish(tmp_path / "out", names=("parted",))
    made = parted.read_text().split()[before:]
    assert sorted(made) == (["part_0", "part_2"] if change == "broken" else ["part_0", "part_1", "part_2"])


def test_number_of_processes_is_checked(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["figure", "all", "--out", str(tmp_path), "--jobs", "0"]) == 2
    assert "--jobs 0: give a number from 1" in capsys.readouterr().err


def test_time_that_is_left():
    now = [0.0]
    countdown = Countdown(["long", "short", "new"], {"long": 100.0, "short": 20.0}, 2, lambda: now[0])
    assert countdown.seconds() == 100.0, "the longest one runs alone in the end"
    assert countdown.beforehand() == "about 100 s on 2 processes and 1 whose time is not known"
    countdown.begin("long")
    countdown.begin("short")
    now[0] = 40.0
    assert countdown.seconds() == 60.0
    assert countdown.end("short") == 40.0
    assert countdown.seconds() == 160.0, "twice as slow as it was known: 200 s in all, of which 40 are gone"
    assert countdown.status() == "2 left, about 3 min and 1 whose time is not known; now long (40 s)"


def test_what_every_figure_takes_in_its_fast_form_is_stored():
    assert set(costs.STORED[Size.FAST]) == set(FIGURES.classes())


def test_costs_of_this_machine_go_before_stored_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(CACHE, str(tmp_path / "truth"))
    monkeypatch.setattr(costs, "STORED", {Size.FAST: {"a": 10.0, "b": 20.0}})
    monkeypatch.setattr(costs, "machine", lambda: 3.0)
    monkeypatch.setattr(costs, "REFERENCE", 2.0)
    assert costs.known(Size.FAST) == {"a": 15.0, "b": 30.0}
    costs.learn(Size.FAST, "b", 7.0)
    assert costs.known(Size.FAST) == {"a": 15.0, "b": 7.0}
    (tmp_path / costs.FILE).write_text('{"fast": 3}')
    assert costs.known(Size.FAST) == {"a": 15.0, "b": 30.0}
