"""Packages of another program on the path, with the names of ours, are not mistaken for ours."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from railsim.distribution import ROOT, check_packages

TRACK = "s [m],vertical [m]\n0,0\n1,0\n"


def call(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Python in `folder`, which also stands on the path before the program."""
    settings = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    line = [sys.executable, *words]
    return subprocess.run(line, cwd=folder, env=settings, capture_output=True, text=True, check=False)


def test_all_packages_are_ours():
    check_packages()


def test_folders_of_data_with_our_names_hide_nothing(tmp_path: Path):
    for name in ("scenarios", "track_data"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
    (tmp_path / "scenarios" / "default.yaml").write_text("somebody else's")
    (tmp_path / "track_data" / "smooth.csv").write_text(TRACK)
    done = call(tmp_path, "-m", "railsim", "inspect", "smooth")
    assert done.returncode == 0, done.stderr
    assert "to [m]" in done.stdout
    code = "from railsim import load_scenario; print(load_scenario('default').geometry.s[-1])"
    done = call(tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) > 100.0


@pytest.mark.parametrize("name", ["estimators", "experiments"])
def test_a_hidden_package_of_code_is_named_in_one_line(name: str, tmp_path: Path):
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").touch()
    done = call(tmp_path, "-m", "railsim", "list", "estimators")
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert f"package '{name}' of railsim is hidden by '{tmp_path / name}'" in done.stderr


def test_the_command_module_says_so_too(tmp_path: Path):
    (tmp_path / "estimators.py").touch()
    done = call(tmp_path, "-m", "experiments.cli", "list", "estimators")
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert f"hidden by '{tmp_path / 'estimators.py'}'" in done.stderr
