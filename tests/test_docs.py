"""README and docs: commands, code and links in them work as they stand there."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest

import estimators
import experiments
import railsim
from experiments.cli import build_parser, main

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
LONGEST_README = 150  # lines
SHORT = (
    "list",
    "simulate curve_s1002",
    "estimate alignment_vertical",
    "score estimate",
    "inspect recording",
    "condition estimate",
    "export estimate",
    "figure fig02",
    "check weak_yaw_damper",
)
"""Commands that take seconds, in an order in which each finds what it needs."""


def commands() -> list[str]:
    """Every `railsim ...` command of the README, as it stands there."""
    blocks = re.findall(r"^```\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines() if line.startswith("railsim ")]
    quoted = [text for text in re.findall(r"`(railsim [^`]+)`", README) if "NAME" not in text]
    return list(dict.fromkeys([*lines, *quoted]))


@pytest.mark.parametrize("command", commands())
def test_every_command_of_the_readme_is_understood(command: str):
    assert build_parser().parse_args(shlex.split(command)[1:]).execute


def test_short_commands_of_the_readme_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    for start in SHORT:
        command = next(command for command in commands() if command.startswith(f"railsim {start}"))
        shorter = ["duration=12"] if "simulate" in start else []
        words = shlex.split(command)[1:] + (["--set", *shorter] if shorter else [])
        assert main(words) == 0, command
    assert {path.name for path in tmp_path.iterdir()} >= {"recording", "estimate", "figures"}


def test_python_of_the_readme_runs(capsys: pytest.CaptureFixture[str]):
    code = re.search(r"^```python\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    assert code is not None
    shorter = code[1].replace('load_scenario("default")', 'load_scenario("default").but(duration=15.0)')
    assert shorter != code[1]
    exec(compile(shorter.replace("simulate(scenario)", 'simulate(scenario, engine="compiled")'), "README.md", "exec"))
    assert "rms error [km/h]" in capsys.readouterr().out


def test_readme_is_short():
    assert len(README.splitlines()) <= LONGEST_README


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path):
    links = re.findall(r"\]\(([^)\s]+)\)", page.read_text())
    missing = [link for link in links if "://" not in link and not (page.parent / link.partition("#")[0]).exists()]
    assert missing == []


def test_every_page_stands_in_the_index():
    index = (ROOT / "docs" / "index.md").read_text() + (ROOT / "docs" / "decisions" / "README.md").read_text()
    pages = [page for page in (ROOT / "docs").rglob("*.md") if page.name not in ("index.md", "README.md")]
    assert [page.name for page in pages if f"{page.name})" not in index] == []


@pytest.mark.parametrize("package", [railsim, estimators, experiments], ids=lambda package: package.__name__)
def test_every_room_stands_in_the_architecture(package):
    text = (ROOT / "docs" / "architecture.md").read_text()
    part = text.partition(f"## Rooms of `{package.__name__}`")[2].partition("\n## ")[0]
    rooms = [path.parent.name for path in Path(package.__path__[0]).glob("*/__init__.py")]
    assert [room for room in rooms if f"`{room}`" not in part] == []


def test_file_names_in_docs_exist():
    """Files of the code that a page names in backticks, with their folder."""
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    missing = []
    for page in PAGES:
        if page.parent.name != "benchmarks":  # pages of record name files as they were
            names = re.findall(r"`((?:railsim|estimators|experiments|tests|scenarios)/[\w/.]+\.\w+)`", page.read_text())
            missing += [f"{page.name}: {name}" for name in names if name not in tracked and "NAME" not in name]
    assert missing == []
