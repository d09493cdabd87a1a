"""Slices: what makes some numbers of a page anew, how long it takes, and how near it must come."""

from functools import cache
from pathlib import Path

from railsim.errors import InputError
from railsim.settings import load_yaml
from railsim.spec import Spec, quantity

FILE = Path(__file__).with_name("slices.yaml")
CHOSEN = "reproduction"


class Slice(Spec, frozen=True):
    """One command whose result holds numbers of a page.

    `command` is what follows `railsim`, without `--json`; {out} in it is a folder of its own, {root} that of the
    program. `fast` is added to it for
    `railsim reproduce --fast`; None leaves the slice out there. `tolerance` is relative to the stored number, `small`
    absolute, in its unit: either will do.
    """

    name: str = quantity(unit="-", source=CHOSEN, pattern=r"^[a-z][a-z0-9_]*$")
    page: str = quantity(unit="path of the page from the top", source=CHOSEN)
    command: str = quantity(unit="-", source=CHOSEN)
    hours: float = quantity(unit="h of one core", source="measured; stated beside the slice", gt=0.0)
    fast: str | None = quantity(None, unit="further words", source=CHOSEN)
    tolerance: float = quantity(1e-6, unit="-", source="rounding between processors", ge=0.0)
    small: float = quantity(1e-9, unit="of the number", source="rounding between processors", ge=0.0)


@cache
def slices(file: Path = FILE) -> dict[str, Slice]:
    """All slices by name, in the order of the file.

    Raises
    ------
    InputError : a wrong key, or a name that appears twice.
    """
    listed = load_yaml(file.read_text(encoding="utf-8"), f"'{file.name}'")
    found: dict[str, Slice] = {}
    for number, values in enumerate(listed):
        one = Slice.build(values, f"{file.name}: {number}")
        if one.name in found:
            raise InputError(f"{file.name}: slice '{one.name}' appears twice; rename one")
        found[one.name] = one
    return found
