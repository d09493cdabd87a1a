"""What a conformance check is: a function that tells, in sentences, where a plug-in falls short."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from experiments.reporting.failures import one_line
from railsim.spec import Spec

T = TypeVar("T")
Check = Callable[[T], Iterable[str]]
"""Sentences on what falls short; none where all is well."""
UNIT = re.compile(r"\S.* \[[^\[\]]+\]")
"""A column: name and unit."""


@dataclass(frozen=True)
class Result:
    """Outcome of one check: its name, whether all is well, and what falls short."""

    check: str
    ok: bool
    message: str


def run_checks(plugin: T, checks: Sequence[Check[T]]) -> list[Result]:
    """Results in the order of the checks; an exception that one ends with falls short, too."""
    return [_result(plugin, check) for check in checks]


def _result(plugin: T, check: Check[T]) -> Result:
    name = getattr(check, "__name__", "check").replace("_", " ")
    try:
        short = list(check(plugin))
    except Exception as error:  # noqa: BLE001 - whatever a stranger's code raises is a result
        short = [f"raised {one_line(error)}"]
    return Result(name, not short, "; ".join(" ".join(text.split()) for text in short))


def described(kind: type) -> Iterable[str]:
    """The class has a docstring that begins with a sentence."""
    if not re.match(r"\S.{10,}", kind.__doc__ or ""):
        yield f"class {kind.__name__} has no docstring; begin it with a sentence on what it is"


def fields_with_unit_and_source(kind: type[Spec]) -> Iterable[str]:
    """Every setting says its unit and where its number comes from."""
    for name, field in kind.model_fields.items():
        nested = isinstance(field.annotation, type) and issubclass(field.annotation, Spec)
        if not nested and not all(kind.about(name)):
            yield f"field '{name}' has no unit or no source; make it by railsim.spec.quantity"
