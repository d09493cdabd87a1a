"""Parts of a long study, one call each."""

from collections.abc import Sequence
from typing import TypeVar

from railsim.errors import InputError

T = TypeVar("T")


def sliced(items: Sequence[T], text: str | None) -> Sequence[T]:
    """Every N-th item from the I-th one on, for a text "I/N"; all where it is None.

    Raises
    ------
    InputError : the text is not such a slice.
    """
    if text is None:
        return items
    first, stroke, count = text.partition("/")
    if not (stroke and first.isdecimal() and count.isdecimal() and 1 <= int(first) <= int(count)):
        raise InputError(f"--slice {text}: write I/N with I from 1 to N, for example 1/4")
    return items[int(first) - 1 :: int(count)]
