"""What the tests of the command share: a small recording, and the command as a user calls it."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from experiments.cli import main
from railsim import load_scenario, measure, simulate

ROOT = Path(__file__).parents[2]
Command = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache of runs for this session."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def railsim(cache: Path, tmp_path: Path) -> Command:
    """Call `railsim` with some arguments, in an empty folder."""
    settings = {**os.environ, "RAILSIM_CACHE": str(cache), "PYTHONPATH": str(ROOT)}

    def call(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        words = [sys.executable, "-m", "experiments.cli", *map(str, arguments)]
        return subprocess.run(words, capture_output=True, text=True, env=settings, cwd=tmp_path, check=False)

    return call


@pytest.fixture
def railsim_here(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Command:
    """As `railsim`, but in this process, which saves the seconds that a start takes."""
    monkeypatch.setenv("RAILSIM_CACHE", str(cache))
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        words = list(map(str, arguments))
        try:
            code = main(words)
        except SystemExit as done:
            code = done.code
        written = capsys.readouterr()
        return subprocess.CompletedProcess(words, code, written.out, written.err)  # pyright: ignore[reportArgumentType]

    return call


@pytest.fixture(scope="session")
def recording(cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight seconds at 30 m/s with the default scenario's sensors; not to be changed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(cache))
        changes = {"duration": 8.0, "speed": {"kind": "constant", "speed": 30.0}, "start": 60.0}
        scenario = load_scenario("default", changes)
        folder = tmp_path_factory.mktemp("recordings") / "recording"
        measure(simulate(scenario, "compiled"), scenario, folder=folder)
    return folder
