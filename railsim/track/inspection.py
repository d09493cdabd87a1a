"""What is suspicious about a track: for `railsim inspect`."""

import numpy as np

from railsim.track.track import UNITS, Track

_DESIGN = ("curvature", "cant", "gradient")
_STUCK_LENGTH = 10.0
_FEWEST_STUCK = 20
_SHARPEST = 1 / 80.0
_JUMP_SIZE = {"m": 3e-3, "1/m": 5e-4, "-": 5e-3}


def problems(track: Track) -> list[str]:
    """Sentences on everything that a measured or hand-made track should not have; empty where nothing is suspicious.

    Looked for: irregular spacing, spikes and steps, values that are stuck, cant that leans out of its curve, curves
    sharper than 80 m, means that a deviation should not have, and wheels' worth of friction above 1.
    """
    findings = _spacing(track)
    for key, column in track.columns().items():
        if key not in ("friction", "stiffness"):
            findings += _jumps(track, key, column)
        if key not in (*_DESIGN, "friction", "stiffness"):
            findings += _stuck(track, key, column) + _offset(key, column)
    return findings + _cant_sign(track) + _sizes(track)


def _spacing(track: Track) -> list[str]:
    steps = np.diff(track.s)
    usual = float(np.median(steps))
    odd = np.flatnonzero(np.abs(steps - usual) > 0.01 * usual)
    if not odd.size:
        return []
    first = float(track.s[odd[0]])
    return [
        f"spacing is irregular: {odd.size} of {steps.size} rows are not {usual:g} m after the row before"
        f" (the first after s = {first:g} m; {steps.min():g} to {steps.max():g} m)"
    ]


def _jumps(track: Track, key: str, column: np.ndarray) -> list[str]:
    """Differences from row to row that are both large in themselves and far beyond the usual ones."""
    change = np.abs(np.diff(column))
    per_row = change / np.maximum(np.diff(track.s) / track.spacing, 1)
    usual = float(np.sqrt(np.mean(np.sort(per_row)[: max(1, int(0.99 * per_row.size))] ** 2)))
    high = np.flatnonzero(per_row > max(10 * usual, _JUMP_SIZE[UNITS[key]]))
    if not high.size:
        return []
    worst = int(high[np.argmax(per_row[high])])
    kind = "spike" if _returns(column, worst) else "step"
    return [
        f"{key} jumps at {high.size} place(s): a {kind} of {column[worst + 1] - column[worst]:.3g} {UNITS[key]}"
        f" between s = {track.s[worst]:g} and {track.s[worst + 1]:g} m"
    ]


def _returns(column: np.ndarray, row: int) -> bool:
    """Whether the value jumps back one row after (or before) the jump from `row` to `row + 1`."""
    jump = column[row + 1] - column[row]
    after = column[row + 2] - column[row + 1] if row + 2 < column.size else 0.0
    before = column[row] - column[row - 1] if row else 0.0
    return bool(min(after / jump, before / jump) < -0.5)


def _stuck(track: Track, key: str, column: np.ndarray) -> list[str]:
    """The longest stretch of one value that is not zero (zero may mean clean track)."""
    edges = np.flatnonzero(np.diff(column) != 0) + 1
    starts, ends = np.concatenate([[0], edges]), np.concatenate([edges, [column.size]]) - 1
    rows = np.where(column[starts] != 0, ends - starts + 1, 0)
    lengths = np.where(rows >= _FEWEST_STUCK, track.s[ends] - track.s[starts], 0.0)
    longest = int(np.argmax(lengths))
    if lengths[longest] < _STUCK_LENGTH:
        return []
    return [
        f"{key} is stuck at {column[starts[longest]]:g} {UNITS[key]} for {lengths[longest]:g} m"
        f" from s = {track.s[starts[longest]]:g} m"
    ]


def _offset(key: str, column: np.ndarray) -> list[str]:
    mean, spread = float(column.mean()), float(column.std())
    if abs(mean) <= max(3 * spread, 1e-3):
        return []
    return [f"{key} has the mean {mean:g} m, far beyond its spread of {spread:g} m: a unit or an offset?"]


def _cant_sign(track: Track) -> list[str]:
    against = (track.curvature * track.cant < 0) & (np.abs(track.curvature) > 2e-4) & (np.abs(track.cant) > 0.01)
    share = float(np.mean(against))
    if share < 0.01:
        return []
    where = float(track.s[np.argmax(against)])
    return [
        f"cant leans out of the curve on {100 * share:.0f} % of the track (first at s = {where:g} m):"
        " both are positive in a left-hand curve with the right rail higher"
    ]


def _sizes(track: Track) -> list[str]:
    findings = []
    sharpest = float(np.abs(track.curvature).max())
    if sharpest > _SHARPEST:
        findings.append(f"curvature reaches {sharpest:g} 1/m, a radius of {1 / sharpest:.0f} m: in 1/m and not 1/km?")
    highest = float(np.abs(track.cant).max())
    if highest > 0.25:
        findings.append(f"cant reaches {highest:g} m, more than any railway has: in m and not mm?")
    largest = max(float(np.abs(column).max()) for column in track.totals().values())
    if largest > 0.1:
        findings.append(f"irregularities reach {largest:g} m: in m and not mm?")
    if track.friction is not None and track.friction.max() > 1:
        findings.append(f"friction reaches {track.friction.max():g}, more than steel on steel has")
    return findings
