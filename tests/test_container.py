"""The container file: what can be said of it without building it."""

import json
import re
import subprocess
import tomllib
from pathlib import Path

import pytest

from railsim import system_check

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
KNOWN = {"FROM", "RUN", "WORKDIR", "COPY", "ENV", "ENTRYPOINT", "CMD"}


def instructions() -> list[tuple[str, str]]:
    """Instruction and arguments, with continued lines joined."""
    text = re.sub(r"^\s*#.*\n", "", (ROOT / "Containerfile").read_text(), flags=re.MULTILINE)
    lines = [line for line in text.replace("\\\n", " ").splitlines() if line.strip()]
    return [(name, rest.strip()) for name, _, rest in (line.partition(" ") for line in lines)]


def of(name: str) -> list[str]:
    """Arguments of all instructions of that name."""
    return [rest for found, rest in instructions() if found == name]


def test_every_instruction_is_known_and_says_something():
    assert {name for name, _ in instructions()} == KNOWN
    assert all(rest for _, rest in instructions())
    assert instructions()[0][0] == "FROM"


@pytest.mark.parametrize("command", of("RUN"))
def test_the_shell_can_read_every_command(command: str):
    done = subprocess.run(["sh", "-n", "-c", command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_base_is_a_public_python_that_railsim_allows():
    (base,) = of("FROM")
    found = re.fullmatch(r"python:(\d+)\.(\d+)-slim", base)
    assert found, "a public name without the host of a registry"
    assert (int(found[1]), int(found[2])) >= system_check.OLDEST_PYTHON


def test_system_packages_are_those_of_the_check():
    (line,) = [command for command in of("RUN") if "apt-get" in command]
    words = line.split("&&")[1].split()
    packages = {word for word in words[words.index("install") + 1 :] if not word.startswith("-")}
    assert packages == set(system_check.LIBRARIES.values())


def test_python_packages_are_installed_as_by_make():
    installs = [command.partition(" install ")[2].split() for command in of("RUN") if "pip install" in command]
    recipe = (ROOT / "Makefile").read_text().partition("\n$(STAMP):")[2].partition("\n\n")[0]
    made = [line.partition(" install ")[2].split() for line in recipe.splitlines() if "$(PIP) install" in line]
    own = {"--no-cache-dir", "--quiet", "-e"}
    assert [[word for word in one if word not in own] for one in installs] == [
        [word for word in one if word not in own] for one in made
    ]


def test_all_that_the_package_is_made_of_is_copied():
    copied = set()
    for *sources, target in (rest.split() for rest in of("COPY")):
        assert all((ROOT / source).exists() for source in sources)
        assert target in ("./", *(f"./{source}" for source in sources)), "a folder's content goes where its name stays"
        copied |= set(sources)
    packages = {name.rstrip("*") for name in PROJECT["tool"]["setuptools"]["packages"]["find"]["include"]}
    files = {"pyproject.toml", PROJECT["project"]["readme"], *PROJECT["project"]["license-files"], "requirements.lock"}
    assert copied == packages | files


def test_it_starts_the_command():
    (entry,), (default,) = of("ENTRYPOINT"), of("CMD")
    assert json.loads(entry) == ["railsim"] and "railsim" in PROJECT["project"]["scripts"]
    assert json.loads(default) == ["--help"]
