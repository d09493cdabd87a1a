"""Keys that a message names as a cure exist, those of track files and of sensors too; `speed_source` is read."""

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import railsim.field
from railsim.field import map as maps
from railsim.field import time_bases
from railsim.spec import Spec

FOLDER = Path(railsim.field.__file__).parent
SOURCES = sorted(FOLDER.rglob("*.py"))


def specs() -> list[type[Spec]]:
    """Classes whose fields are the keys of a map."""
    found = {
        one
        for module in (maps, time_bases)
        for _, one in inspect.getmembers(module, inspect.isclass)
        if issubclass(one, Spec) and one is not Spec and one.__module__.startswith("railsim.field")
    }
    return sorted(found, key=lambda one: one.__name__)


def trees() -> Iterator[ast.AST]:
    yield from (ast.parse(path.read_text(encoding="utf-8")) for path in SOURCES)


def test_the_keys_that_were_once_read_by_nothing_are_there():
    assert {"RecordingMap", "Kilometrage", "Channel", "TableMap", "Csv"} <= {one.__name__ for one in specs()}
    assert "speed_source" in maps.RecordingMap.model_fields
    assert {"lost", "post", "scale"} <= set(maps.Kilometrage.model_fields)
    odometry = Path(railsim.field.__file__).parents[2] / "estimators" / "speed" / "odometry.py"
    assert '"speed_source"' in odometry.read_text(encoding="utf-8")


def messages() -> list[str]:
    """Texts of the import's source, the pieces of a formatted or split one put together."""
    found = []
    for tree in trees():
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr):
                parts = [str(one.value) if isinstance(one, ast.Constant) else "*" for one in node.values]
                found.append("".join(parts))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return found


def test_every_cure_that_a_message_names_exists():
    keys = {name for spec in specs() for name in spec.model_fields}
    sensor = {"rotation", "channels"}
    repairs = set(get_args(maps.Repair))
    named: dict[str, str] = {}
    for text in messages():
        for found in re.finditer(r"(?:add|state|correct|give|set|write|with) '([a-z_]+)(?::[^']*)?'", text):
            named[found[1]] = text
        for found in re.finditer(r"'([a-z_]+)' (?:to|in|of) (?:the )?repair", text):
            assert found[1] in repairs, text
        for found in re.finditer(r"\bcsv\.([a-z_]+)", text):
            assert found[1] in maps.Csv.model_fields, text
        for found in re.finditer(r"'lost' of '?(time|kilometrage|the channel)", text):
            owner = {"time": time_bases.Seconds, "kilometrage": maps.Kilometrage}.get(found[1], maps.Channel)
            assert "lost" in owner.model_fields
    assert {"continue", "direction"} & set(named) and len(named) > 5
    unknown = {name: text for name, text in named.items() if name not in keys | repairs | sensor}
    assert unknown == {}
