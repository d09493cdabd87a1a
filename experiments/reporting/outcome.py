"""What a command gives back."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Outcome:
    """Result of a command: the JSON object, the same as text for people, and whether every check held."""

    result: dict[str, Any]
    text: str
    held: bool = True
