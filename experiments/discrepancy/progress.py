"""Progress: the callable that is told in a line of text what is being done."""

from collections.abc import Callable

Progress = Callable[[str], None]


def silent(text: str) -> None:
    """Progress that nobody reads."""
    del text
