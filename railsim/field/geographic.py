"""Latitude and longitude as texts: "61.000000° N", "48°51'24.1\\"N", "S 33.8"."""

import re

import numpy as np

from railsim.errors import InputError
from railsim.field.tables import Table

_SIGNS = {"N": 1.0, "E": 1.0, "O": 1.0, "S": -1.0, "W": -1.0, "": 1.0}
_NUMBER = r"(\d+(?:[.,]\d+)?)"
_ANGLE = re.compile(
    rf"\s*([NSEWO]?)\s*([+-]?)\s*{_NUMBER}\s*°?\s*(?:{_NUMBER}\s*['′’]\s*)?(?:{_NUMBER}\s*[\"″”]\s*)?([NSEWO]?)\s*"
)


def degrees(name: str, texts: list[str], table: Table, lost: tuple[float | str, ...]) -> np.ndarray:
    """Degrees, north and east positive, NaN where lost, shape (n,).

    Raises
    ------
    InputError : a text is no angle; the line gives its row.
    """
    values, markers = np.full(len(texts), np.nan), {"", *(str(one) for one in lost)}
    for row, text in enumerate(texts):
        if text.strip() in markers:
            continue
        found = _ANGLE.fullmatch(text)
        if found is None or (found[1] and found[6]):
            raise InputError(
                f"column '{name}' row {table.line(row)} holds '{text[:40]}', no angle as 48.8566, 48.8566° N or "
                "48°51'24\"N; mend it, or add it to 'lost' of the channel"
            )
        whole, minutes, seconds = (float(part.replace(",", ".")) if part else 0.0 for part in found.group(3, 4, 5))
        sign = _SIGNS[found[1] or found[6]] * (-1.0 if found[2] == "-" else 1.0)
        values[row] = sign * (whole + minutes / 60.0 + seconds / 3600.0)
    return values
