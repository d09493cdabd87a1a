"""Facts about the tree that the house rules promise: sizes, places, versions, who imports whom."""

import ast
import re
import subprocess
import tomllib
from functools import cache
from pathlib import Path

import pytest
import yaml

from railsim import system_check

ROOT = Path(__file__).parents[1]
PACKAGES = ("railsim", "estimators", "scenarios", "track_data", "experiments")
ALLOWED_FOLDERS = {*PACKAGES, "tests", "docs", ".ci"}
ALLOWED_AT_TOP = {
    "pyproject.toml", "README.md", "Makefile", "requirements.lock", "requirements-dev.lock", "requirements-docs.lock",
    "mkdocs.yml", "Containerfile", "LICENSE", "CITATION.cff",
    "CHANGELOG.md", "CONTRIBUTING.md", ".gitignore", ".gitattributes", "conftest.py",
}  # fmt: skip
LARGEST_FILE = 2 * 1024 * 1024  # bytes
LONGEST_FILE = 500  # lines

MACHINE_PATH = re.compile(r"(^|[^.\w])/(work|farm|root|tmp|home|Users)/")
REGISTRY = re.compile(r'https?://[^ "]*/(simple|packages)(/|"|$)|index-ur[l]|find-link[s]|pypi\.or[g]|pythonhoste[d]')
UNFINISHED = re.compile(r"TOD[O]|FIXM[E]|NotImplemente[d]Error|xfai[l]|assert Tru[e]")
PRIVATE = re.compile(r"_(?!_|fields$|replace$|asdict$|make$).+")  # the methods of named tuples are public
SIMULATOR = ("engines", "dynamics", "effects", "truth", "recording", "model", "scenario")
HIDDEN_FROM_ESTIMATORS = (*(f"railsim.{name}" for name in SIMULATOR), "experiments", "exudyn")


def tracked(suffix: str = "") -> list[Path]:
    """Files of the repository, relative to its root."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    names = [name for name in listed.split("\0") if name.endswith(suffix) and (ROOT / name).is_file()]
    assert names, f"git lists no file that ends in '{suffix}'"
    return [Path(name) for name in names]


def text_of(path: Path) -> str:
    """Content of a tracked file; empty for one that is not text."""
    content = (ROOT / path).read_bytes()
    return "" if b"\0" in content else content.decode()


def lines_that_match(pattern: re.Pattern[str], paths: list[Path]) -> list[str]:
    """'file:line: text' of every line in which `pattern` is found."""
    return [
        f"{path}:{number}: {line.strip()[:120]}"
        for path in paths
        for number, line in enumerate(text_of(path).splitlines(), 1)
        if pattern.search(line)
    ]


@cache
def nodes_of(text: str) -> list[ast.AST]:
    """All nodes of a Python file's text; several tests ask for the same files."""
    return list(ast.walk(ast.parse(text)))


def imports_of(path: Path) -> set[str]:
    """Full names that a Python file imports, at any depth: modules, and names taken from modules."""
    names: set[str] = set()
    for node in nodes_of(text_of(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            package = list(path.parent.parts)[: len(path.parent.parts) + 1 - node.level] if node.level else []
            module = ".".join([*package, *([node.module] if node.module else [])])
            names |= {module} | {f"{module}.{alias.name}" for alias in node.names}
    return names


def imports_under(name: str, imported: set[str]) -> bool:
    """Whether the module `name`, or anything in it, is among the imported names."""
    return any(other == name or other.startswith(f"{name}.") for other in imported)


def test_no_python_file_is_long():
    long = {str(path): len(text_of(path).splitlines()) for path in tracked(".py")}
    assert {path: lines for path, lines in long.items() if lines > LONGEST_FILE} == {}


def test_no_tracked_file_is_large():
    sizes = {str(path): (ROOT / path).stat().st_size for path in tracked()}
    assert {path: size for path, size in sizes.items() if size > LARGEST_FILE} == {}


def test_every_file_has_its_place():
    misplaced = [
        str(path)
        for path in tracked()
        if (path.parts[0] not in ALLOWED_FOLDERS if len(path.parts) > 1 else path.name not in ALLOWED_AT_TOP)
    ]
    assert misplaced == []


def test_no_path_of_a_machine_and_no_registry():
    paths = [path for path in tracked() if path.parts[0] != ".ci"]
    assert lines_that_match(MACHINE_PATH, paths) == []
    assert lines_that_match(REGISTRY, paths) == []


def test_nothing_unfinished():
    assert lines_that_match(UNFINISHED, tracked(".py")) == []


def test_every_data_file_is_in_the_wheel():
    """Setuptools packs what is no Python file by pattern alone."""
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    packed = {
        path.relative_to(ROOT)
        for package, globs in patterns.items()
        for pattern in globs
        for path in ROOT.joinpath(*package.split(".")).glob(pattern)
    }
    data = {path for path in tracked() if path.parts[0] in PACKAGES and path.suffix != ".py"}
    assert data - packed == set()


def test_exudyn_is_imported_in_one_place():
    users = {str(path) for path in tracked(".py") if imports_under("exudyn", imports_of(path))}
    assert {user for user in users if not user.startswith("tests/")} <= {"railsim/engines/exudyn.py"}


def test_nothing_imports_the_command():
    sources = [path for path in tracked(".py") if path.parts[0] in PACKAGES]
    assert [str(path) for path in sources if imports_under("experiments.cli", imports_of(path))] == []


def test_estimators_see_measurements_only():
    for path in (path for path in tracked(".py") if path.parts[0] == "estimators"):
        seen = imports_of(path)
        assert [name for name in HIDDEN_FROM_ESTIMATORS if imports_under(name, seen)] == [], path


def private_names(path: Path) -> list[str]:
    """Full names with an underscore that a file takes from a package of this project that it is no part of."""
    found = []
    for name in imports_of(path) | attributes_of(path):
        parts = name.split(".")
        private = [at for at, part in enumerate(parts) if PRIVATE.fullmatch(part)]
        if parts[0] in (*PACKAGES, "tests") and private:
            owner = package_of(parts[: private[0]])
            found += [name] if path.parts[: len(owner)] != owner else []
    return sorted(found)


def attributes_of(path: Path) -> set[str]:
    """Full names `module.name` or `Class.name` that a file reads of what it has imported from this project."""
    nodes = nodes_of(text_of(path))
    meaning = {
        alias.asname or alias.name: f"{node.module}.{alias.name}"
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module and not node.level
        for alias in node.names
    }
    return {
        f"{meaning[node.value.id]}.{node.attr}"
        for node in nodes
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in meaning
    }


def package_of(parts: list[str]) -> tuple[str, ...]:
    """The innermost package of a module, or of what stands in one."""
    while not ROOT.joinpath(*parts).is_dir():
        parts = parts[:-1]
    return tuple(parts)


def test_nothing_private_is_used_from_outside_its_package():
    used = {str(path): private_names(path) for path in tracked(".py")}
    assert {path: names for path, names in used.items() if names} == {}


def test_private_names_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The test above rests on `private_names`: modules, names in modules, and attributes of either count."""
    (tmp_path / "railsim" / "track").mkdir(parents=True)
    text = "from railsim.track import _files, kernel\nfrom railsim.track.kernel import _step\nkernel._at(_files.read)\n"
    inside, outside = Path("railsim/track/any.py"), Path("railsim/any.py")
    for file in (inside, outside):
        (tmp_path / file).write_text(text)
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    names = ["_files", "_files.read", "kernel._at", "kernel._step"]
    assert private_names(outside) == [f"railsim.track.{name}" for name in names]
    assert private_names(inside) == []


def test_imports_are_found_at_any_depth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The three tests above rest on `imports_of`: relative, nested and aliased imports count."""
    (tmp_path / "railsim" / "engines").mkdir(parents=True)
    file = Path("railsim/engines/any.py")
    (tmp_path / file).write_text("def f():\n    import exudyn.utilities as eu\n    from ..truth import Truth\n")
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    assert imports_of(file) == {"exudyn.utilities", "railsim.truth", "railsim.truth.Truth"}


def test_one_version():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    newest = re.search(r"^## \[(\d[^\]]*)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest is not None, "CHANGELOG.md has no entry '## [version] - date'"
    assert {version, cited["version"], newest[1]} == {version}
    assert str(cited["date-released"]) == newest[2]


def test_lock_pins_every_direct_dependency_with_hashes():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [name for extra in project["optional-dependencies"].values() for name in extra]
    run_time, development = _pinned("requirements.lock"), _pinned("requirements-dev.lock")
    documentation = _pinned("requirements-docs.lock")
    assert run_time & development == (run_time | development) & documentation == set()
    assert _names(project["dependencies"]) <= run_time
    assert _names(extras) <= run_time | development | documentation
    assert run_time & _names(extras) == {"setuptools"}, "make run installs what it does not run"


def _names(requirements: list[str]) -> set[str]:
    return {re.split(r"[\[><=;]", name)[0].lower() for name in requirements}


def _pinned(lock: str) -> set[str]:
    """Names that a lock pins with hashes; every line does."""
    lines = (ROOT / lock).read_text().replace("\\\n", " ").splitlines()
    pinned = [line for line in lines if re.match(r"[a-z0-9-]+==[^ ]+ +--hash=sha256:[0-9a-f]{64}", line)]
    assert [line for line in lines if line and line[0] != "#" and line not in pinned] == []
    return {line.split("==")[0] for line in pinned}


def test_system_check_names_what_is_missing():
    assert "3.10.13 is too old" in (system_check.python_problem((3, 10, 13)) or "")
    assert system_check.python_problem((3, 11, 0)) is None
    assert "install libgl1" in (system_check.library_problem("libAbsent.so.1", "libgl1") or "")
    assert "install python3-venv" in (system_check.module_problem("absent_module", "python3-venv") or "")
