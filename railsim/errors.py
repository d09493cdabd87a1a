"""The one exception that a user's mistake raises, and the name that was probably meant."""

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """Input that cannot be used: one line that says what is wrong and how to mend it (the command exits with 2)."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A question for a message, "did you mean 'NAME'? ", or nothing where no known name is near."""
    found = difflib.get_close_matches(name, list(known), n=1)
    return f"did you mean '{found[0]}'? " if found else ""


class Noticed(UserWarning):
    """Something about the input that the user should know and that stops nothing."""
