"""Places along the track as recording cars write them: one number, kilometre plus metres, a post and a remainder."""

import re
from collections.abc import Sequence

import numpy as np

from railsim.errors import InputError
from railsim.field.channels import numbers
from railsim.field.map import Kilometrage
from railsim.field.tables import Column, Notes, Table
from railsim.field.units import parse_unit

_PLUS = re.compile(r"\s*[A-Za-z]{0,3}\.?\s*(\d+(?:[.,]\d+)?)\s*\+\s*(\d+(?:[.,]\d+)?)\s*(?:m)?\s*")
_EVEN = 0.5  # of the usual step, by which other steps differ at most where a place was set
_NEAR = 3  # usual steps; so near to a whole kilometre or mile the places begin again at each post
_POSTS = ((1000.0, "km", "kilometre"), (1609.344, "mi", "mile"))
_WHOSE = "of 'kilometrage' and 'drop_untimed' to repair"


def columns_of(kilometrage: Kilometrage) -> list[str]:
    """Columns that tell the place."""
    return [kilometrage.column] + ([kilometrage.post.column] if kilometrage.post else [])


def places(kilometrage: Kilometrage, table: Table, repairs: Sequence[str], notes: Notes) -> np.ndarray:
    """Place of each row along the run, m, increasing as the car ran where it was not set on the way; NaN is lost.

    Raises
    ------
    InputError : a cell is no place, or places go back as no repair that the map names can explain.
    """
    column = table.columns[kilometrage.column]
    if isinstance(column.values, list) and any("+" in text[1:] for text in column.values):
        at = _plus(column, column.values, table, kilometrage.lost)
        notes.assume(f"places of '{column.name}' are written as kilometre + metres")
    else:
        at = parse_unit(kilometrage.unit).to_si(numbers(column, table, kilometrage.lost, _WHOSE)) * kilometrage.scale
    if kilometrage.post is not None:
        post = numbers(table.columns[kilometrage.post.column], table, kilometrage.lost, _WHOSE)
        at = at + parse_unit(kilometrage.post.unit).to_si(post)
    run = at if kilometrage.direction == "up" else -at
    return _unset(run, column.name, repairs, table, notes)


def _plus(column: Column, texts: list[str], table: Table, lost: tuple[float | str, ...]) -> np.ndarray:
    values = np.full(len(texts), np.nan)
    markers = {"", *(str(one) for one in lost)}
    for row, text in enumerate(texts):
        if text.strip() in markers:
            continue
        found = _PLUS.fullmatch(text)
        if found is None:
            raise InputError(
                f"column '{column.name}' row {table.line(row)} holds '{text[:40]}', no place as 12+950.25 (kilometre + "
                f"metres); mend it, or add it to 'lost' {_WHOSE}"
            )
        kilometre, metres = (float(part.replace(",", ".")) for part in found.groups())
        values[row] = 1000.0 * kilometre + metres
    return values


def _unset(run: np.ndarray, name: str, repairs: Sequence[str], table: Table, notes: Notes) -> np.ndarray:
    """Places that go on by the usual step where the car's place was set, if the map allows that."""
    known = np.flatnonzero(np.isfinite(run))
    steps = np.diff(run[known])
    usual = float(np.median(steps)) if steps.size else 0.0
    set_back = np.flatnonzero(steps < 0)
    if usual <= 0:
        if not set_back.size:
            return run
        row = int(set_back[0])
        first, second = abs(run[known[row]]), abs(run[known[row + 1]])
        raise InputError(
            f"kilometrage: '{name}' goes back from {first:.10g} to {second:.10g} m at row "
            f"{int(known[row + 1]) + 1} of the data, and so at most others: the car ran the other way; correct "
            "'direction'"
        )
    if "continue" in repairs:
        return _continued(run, known, steps, usual, name, table, notes)
    others = np.abs(np.delete(steps, set_back) - usual) > _EVEN * usual
    if not set_back.size or others.any():
        return run  # in order, or rows out of order, which `regular` sees to
    row = int(known[set_back[0] + 1])
    size = usual - steps[set_back]
    length = next((post for post in _POSTS if (np.abs(size - post[0]) < _NEAR * usual).all()), None)
    head = f"kilometrage: '{name}' is set back by {size[0]:.6g} m at row {table.line(row)} ({size.size} such places)"
    if length is not None:
        raise InputError(
            f"{head}, as a place within a {length[2]} is; name the column that counts these: 'post: {{column: ..., "
            f"unit: {length[1]}}}' of kilometrage"
        )
    raise InputError(
        f"{head}, and all other rows follow each other evenly: the car's place was set; add 'continue' to repair, "
        "and the distance goes on by the usual step, or name the car's own count of rows as column, with 'scale'"
    )


def _continued(
    run: np.ndarray, known: np.ndarray, steps: np.ndarray, usual: float, name: str, table: Table, notes: Notes
) -> np.ndarray:
    odd = np.abs(steps - usual) > _EVEN * usual
    if not odd.any():
        return run
    added = np.where(odd, usual - steps, 0.0)
    moved = run.copy()
    moved[known[1:]] += np.cumsum(added)
    first = int(np.argmax(odd))
    notes.repair(
        f"kilometrage: '{name}' was set at {int(odd.sum())} places, first at row {table.line(int(known[first + 1]))} "
        f"by {steps[first] - usual:+.6g} m; the distance goes on by {usual:.6g} m there, {added.sum():+.6g} m in all"
    )
    return moved
