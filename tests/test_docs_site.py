"""The documentation's site: whole navigation, tutorials that can run, short sentences, a reference that says enough."""

import ast
import importlib
import inspect
import re
import shlex
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from experiments.cli import build_parser
from railsim.scenario import Scenario, load_scenario

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "docs" / "site"))
gallery, reference, tutorials = (importlib.import_module(name) for name in ("gallery", "reference", "tutorials"))

DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
TUTORIALS = [path for path in sorted((DOCS / "tutorials").glob("*.md")) if path.name != "index.md"]
OUTSIDE = {"overview.md", "contributing.md", "changelog.md", "gallery.md"}
"""Pages of the site that docs/site/hooks.py makes of files beside `docs`, or draws up."""
LONGEST_LINE, LONGEST_SENTENCE = 160, 35  # characters, words
HASH = re.compile(r"\b(?=[0-9a-f]*[a-f])(?=[0-9a-f]*[0-9])[0-9a-f]{7,40}\b(?!\.\.\.)")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def test_every_page_is_in_the_navigation_once():
    text = (ROOT / "mkdocs.yml").read_text()
    listed = list(leaves(yaml.safe_load(text)["nav"]))
    written = {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")}
    assert sorted(listed) == sorted(written | OUTSIDE | set(reference.pages()))


def leaves(node: Any) -> Any:
    """Paths of pages anywhere in a navigation."""
    for child in node if isinstance(node, list) else node.values() if isinstance(node, dict) else ():
        yield from leaves(child)
    if isinstance(node, str):
        yield node


def test_the_reference_names_every_plugin_and_command():
    pages = reference.pages()
    for word in ("speed_refined", "bogie.rate_pitch [rad/s]"):
        assert word in pages["reference/estimators.md"]
    assert "| `duration` | must be given | s |" in pages["reference/scenario.md"]
    assert "| `factor` |" in pages["reference/effects.md"].partition("## weak_yaw_damper")[2].partition("\n## ")[0]
    assert "--line-speed KMH|FILE" in pages["reference/commands.md"]


def test_pictures_of_a_page_open_in_full_size():
    page = "Text.\n\n![two lines](../lanes.png)\n\n| a | ![in a row](b.png) |\n\n[picture](c.png)\n"
    opened = "Text.\n\n[![two lines](../lanes.png)](../lanes.png)\n\n| a | ![in a row](b.png) |\n\n[picture](c.png)\n"
    assert gallery.opening(page) == opened


@pytest.mark.parametrize("key", reference.WRITTEN)
def test_examples_of_scenario_keys_are_taken(key: str):
    assert key in Scenario.model_fields
    assert getattr(load_scenario("curve_r400", [f"{key}={reference.WRITTEN[key][0]}", "duration=20"]), key)


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_cells_of_tutorials_are_understood(page: Path):
    cells = tutorials.parts_of(page.read_text())
    assert {"bash", "python"} <= {kind for kind, _ in cells}
    for kind, text in cells:
        if kind == "python":
            ast.parse(text)
        for line in text.replace("\\\n", " ").splitlines() if kind == "bash" else ():
            words = shlex.split(line.partition(" 2> ")[0])
            assert words[0] != "railsim" or build_parser().parse_args(words[1:]).execute


def test_a_changed_tutorial_counts_as_not_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(tutorials, "SOURCES", tmp_path)
    monkeypatch.setattr(tutorials, "RESULTS", tmp_path / "results")
    (tmp_path / "results").mkdir()
    (tmp_path / "one.md").write_text("# One\n")
    assert tutorials.executed("one") is None
    (tmp_path / "results" / "one.md").write_text("# One, and what it printed" + tutorials.stamp("# One\n"))
    assert tutorials.executed("one")
    (tmp_path / "one.md").write_text("# Another\n")
    assert tutorials.executed("one") is None


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_lines_are_short(page: Path):
    assert [line[:60] for line in page.read_text().splitlines() if len(line) > LONGEST_LINE] == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_sentences_are_short(page: Path):
    long = [sentence[:80] for sentence in sentences(page.read_text()) if len(sentence.split()) > LONGEST_SENTENCE]
    assert long == []


def test_sentences_are_found():
    text = "# T\n\nOne is\nshort. Two [a link](x.md) `and code`; Three:\n\n| a |\n\n- Four\n- five\n\n```\nsix\n```\n"
    assert sentences(text) == ["One is short.", "Two a link code;", "Three:", "Four", "five"]


def sentences(text: str) -> list[str]:
    """Sentences of a page's prose; a quoted bit of code counts as a word, a colon ends one where a capital follows."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^( {4}|\||#|!\[).*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^\s*([-*]|\d+\.) ", "\n\n", text, flags=re.MULTILINE)
    text = re.sub(r"`[^`]*`", "code", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text))
    parts = (" ".join(part.split()) for part in re.split(r"\n\s*\n", text))
    return [one for part in parts for one in re.split(r"(?<=[.!?:;])\s+(?=[A-Z0-9(*]|code)", part) if one]


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent.name != "benchmarks"], ids=name_of)
def test_no_commit_is_named(page: Path):
    assert HASH.findall(page.read_text()) == []


@pytest.mark.parametrize("path", [path for paths in reference.PUBLIC.values() for path in paths])
def test_public_names_say_what_they_are(path: str):
    """Summary; shape or unit where arrays pass; what is raised, where the function itself raises."""
    module, _, name = path.rpartition(".")
    found = getattr(importlib.import_module(module), name)
    members = [(path, found)] if inspect.isfunction(found) else [(path, found), *public_methods(path, found)]
    assert [problem for where, member in members for problem in problems(where, member)] == []


def public_methods(path: str, found: type) -> list[tuple[str, Any]]:
    """Methods and properties that a class itself defines."""
    bare = {
        name: getattr(value, "fget", None) or getattr(value, "__func__", value) for name, value in vars(found).items()
    }
    return [(f"{path}.{name}", value) for name, value in bare.items() if name[0] != "_" and inspect.isfunction(value)]


def problems(where: str, member: Any) -> list[str]:
    """What a docstring lacks."""
    text = inspect.getdoc(member) or ""
    if not text:
        return [f"{where}: no summary"]
    found = [] if text.partition("\n\n")[0].rstrip().endswith((".", ":")) else [f"{where}: the summary is no sentence"]
    if inspect.isfunction(member):
        source = inspect.getsource(member)
        if "ndarray" in str(inspect.signature(member)) and not re.search(
            r"shape|length|\bunits?\b|\bs\b|samples|rows", text
        ):
            found.append(f"{where}: arrays without shape or unit")
        if (
            re.search(r"^\s+raise (InputError|ValueError|KeyError|TypeError)", source, re.MULTILINE)
            and "aise" not in text
        ):
            found.append(f"{where}: raises, and does not say what")
    return found
