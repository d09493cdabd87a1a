"""Objects of MATLAB's own classes, which only MATLAB reads."""

from railsim.field.readers.tree import Unreadable

CURES = {
    "timetable": "writetimetable(x, 'x.csv')",
    "table": "writetable(x, 'x.csv')",
    "datetime": "x = posixtime(x), which is 'kind: epoch'",
    "duration": "x = seconds(x)",
    "string": "x = cellstr(x)",
    "categorical": "x = cellstr(x)",
    "timeseries": "t = x.Time; v = x.Data",
}
"""What takes the numbers out of an object of a class, in MATLAB."""


def opaque(kind: str) -> Unreadable:
    """An object of a class of MATLAB's, and what makes numbers of it."""
    cure = CURES.get(kind, "save its numbers as vectors of their own")
    return Unreadable(f"is an object of MATLAB's class {kind or '?'}, which MATLAB alone reads; in MATLAB: {cure}")
