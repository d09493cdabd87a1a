"""The one exception that a user's mistake raises, and how its message is made readable."""

import difflib
import unicodedata
from collections.abc import Iterable

LONGEST = 1500  # characters of a message; its begin and its end, which holds the cure, are kept


class InputError(ValueError):
    """Input that cannot be used: one line that says what is wrong and how to mend it (the command exits with 2)."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A question for a message, "did you mean 'NAME'? ", or nothing where no known name is near."""
    found = difflib.get_close_matches(name, list(known), n=1)
    return f"did you mean '{found[0]}'? " if found else ""


class Noticed(UserWarning):
    """Something about the input that the user should know and that stops nothing."""


def printable(text: str) -> str:
    """In one line of at most `LONGEST` characters; control and direction characters as their code points."""
    seen = "".join(_escaped(letter) for letter in " ".join(text.split()))
    if len(seen) <= LONGEST:
        return seen
    kept = (LONGEST - 5) // 2
    return f"{seen[:kept]} ... {seen[-kept:]}"


def _escaped(letter: str) -> str:
    hidden = unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Co", "Zl", "Zp")
    return f"<U+{ord(letter):04X}>" if hidden else letter
