"""Every key and word that a message of the import names is one of the map, and every key of the map is read."""

import ast
import re
from pathlib import Path
from typing import Any, get_args

import pytest
import yaml

from railsim.field import map as maps
from railsim.field import time_bases
from railsim.spec import Spec

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "railsim" / "field").rglob("*.py"))
DOCS = (ROOT / "docs" / "field_data.md").read_text(encoding="utf-8")
SPECS = [
    one for module in (maps, time_bases) for one in vars(module).values()
    if isinstance(one, type) and issubclass(one, Spec) and one is not Spec
]  # fmt: skip
KEYS = {name for spec in SPECS for name in spec.model_fields}
TOLD = [
    maps.Csv, maps.Selection, maps.TableMap, time_bases.Seconds, time_bases.Epoch, time_bases.Iso, time_bases.Counter,
    time_bases.Own,
]  # fmt: skip
REPAIRS = set(get_args(maps.Repair))


def texts() -> list[str]:
    """Every text of the import's sources, with {} for what is put in."""
    found = []
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = [one.value if isinstance(one, ast.Constant) else "{}" for one in node.values]
                found.append("".join(map(str, parts)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return found


def proposals() -> list[str]:
    """Lines of the map in quotes, as "'rows: {last: 12}'"."""
    return sorted({line for text in texts() for line in re.findall(r"'([a-z_]+: ?[^']*)'", text) if "\n" not in line})


def keys_of(value: Any) -> set[str]:
    if isinstance(value, dict):
        return {str(key) for key in value} | {one for inner in value.values() for one in keys_of(inner)}
    return {one for inner in value for one in keys_of(inner)} if isinstance(value, list) else set()


def test_there_are_proposals():
    assert len(proposals()) > 20


@pytest.mark.parametrize("line", proposals())
def test_line_that_a_message_proposes_is_one_of_the_map(line: str):
    """Keys exist; `where` has names of columns as keys."""
    plain = re.sub(r"\{(?:where: )?\{.*", "", line.replace("{}", "1").replace('""', '"x"').replace("...", "1"))
    try:
        keys = keys_of(yaml.safe_load(plain)) if ":" in plain else set()
    except yaml.YAMLError:
        keys = set(re.findall(r"([a-z_]+):", plain))
    assert {key for key in keys if not key.isdigit()} <= KEYS


def test_words_that_messages_propose_for_repair_exist():
    named = {
        word for text in texts() for word in re.findall(r"'([a-z_]+)' (?:to|in) repair|and '([a-z_]+)' to repair", text)
    }
    words = {word for pair in named for word in pair if word}
    assert words and words <= REPAIRS


def test_every_repair_stands_in_the_docs():
    assert all(f"`{word}`" in DOCS for word in REPAIRS)


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.__name__)
def test_every_key_of_the_map_is_read(spec: type[Spec]):
    """A key stands as an attribute somewhere in the import beside its definition."""
    source = "\n".join(path.read_text(encoding="utf-8") for path in SOURCES)
    unread = [name for name in spec.model_fields if not re.search(rf"\.{name}\b|\"{name}\"", source)]
    assert unread == []


@pytest.mark.parametrize("spec", TOLD, ids=lambda spec: spec.__name__)
def test_keys_of_tables_text_and_time_stand_in_the_docs(spec: type[Spec]):
    missing = [name for name in spec.model_fields if not re.search(rf"\b{name}\b", DOCS)]
    assert missing == []
