"""A track-recording car's file becomes a track file."""

from pathlib import Path

import numpy as np

from railsim.errors import InputError
from railsim.field.align import shifts
from railsim.field.channels import convert
from railsim.field.chord import alignment
from railsim.field.guard import Guard
from railsim.field.map import Chord, Kilometrage, Registration, TrackMap
from railsim.field.places import columns_of, places
from railsim.field.readers.interface import Wanted
from railsim.field.regular import How, Series, regular
from railsim.field.source import find_format, read_tables
from railsim.field.tables import Notes
from railsim.track.files import read_track, write_track
from railsim.track.track import UNITS, Track

HEAD = "railsim import"
_MIRRORED = ("curvature", "lateral", "left_lateral", "right_lateral", "cant", "cross_level")
"""Change sign where left and right are exchanged."""
_EVEN = 1e-3  # of the spacing


def import_track(
    path: Path, mapped: TrackMap, folder: Path, out: Path, notes: Notes, guard: Guard | None = None
) -> Track:
    """Write the track file `out`; assumptions and repairs stand in its comments.

    Parameters are those of `recording.import_recording`.

    Raises
    ------
    InputError : map and file do not fit together, the file is damaged, or `out` is a file of somebody else.
    """
    _check_path(out)
    units = _units(mapped)
    kind = find_format(path, mapped.format, notes)
    kilometrage = mapped.kilometrage
    names = dict.fromkeys([*columns_of(kilometrage), *(one.column for one in mapped.columns.values())])
    lost = {one.column: [m for m in one.lost if isinstance(m, str)] for one in mapped.columns.values()}
    for column in columns_of(kilometrage):
        lost[column] = [*lost.get(column, []), *(m for m in kilometrage.lost if isinstance(m, str))]
    table = read_tables(path, kind, mapped.csv, [Wanted(mapped.group, tuple(names))], lost, notes, guard)[0]
    values = {key: convert(key, mapped.columns[title], table, UNITS[key], notes) for key, title in units.items()}
    run = places(kilometrage, table, mapped.repair, notes)
    how = How("kilometrage (in the direction of the run)", "m", mapped.repair, notes)
    series = _filled(regular(run, values, mapped.spacing, how), how)
    columns = {key: _straightened(key, mapped.columns[title].chord, series, notes) for key, title in units.items()}
    s, columns = _oriented(series.axis, columns, kilometrage, notes)
    if mapped.align is not None:
        s = _aligned(s, columns, mapped.align, folder, notes)
    comments = [f"{HEAD}: {mapped.origin}", f"file: {path.name}"]
    comments += [f"assumption: {one}" for one in notes.assumptions] + [f"repair: {one}" for one in notes.repairs]
    track = Track(s, columns, out.stem, [" ".join(line.split()) for line in comments])
    write_track(track, out)
    return track


def _check_path(out: Path) -> None:
    """Only a file that an import wrote is replaced."""
    if out.suffix.lower() != ".csv":
        raise InputError(f"'{out}': a track is a CSV file; give --out a name that ends in .csv")
    if out.is_dir():
        raise InputError(f"'{out}' is a folder; name a file")
    if out.exists():
        with out.open("rb") as file:
            if file.read(len(HEAD) + 2) != f"# {HEAD}".encode():
                raise InputError(f"'{out}' is a file that railsim import did not write; name another")
    out.parent.mkdir(parents=True, exist_ok=True)


def _units(mapped: TrackMap) -> dict[str, str]:
    """Title by key of the track's columns."""
    known = {f"{key} [{unit}]": key for key, unit in UNITS.items()}
    for title, column in mapped.columns.items():
        if title not in known:
            raise InputError(f"columns.{title}: a track knows {', '.join(known)}")
        if column.pulses is not None:
            raise InputError(f"columns.{title}.pulses: a track has no speed; leave it out")
    return {known[title]: title for title in mapped.columns}


def _filled(series: Series, how: How) -> Series:
    """Lost values interpolated where the map allows that: a track file has no empty cells."""
    columns = dict(series.columns)
    for name, values in columns.items():
        lost = np.isnan(values)
        if not lost.any():
            continue
        if "fill" not in how.repairs or lost.all():
            where = abs(float(series.axis[int(lost.argmax())]))
            raise InputError(
                f"{name}: {int(lost.sum())} of {lost.size} values are lost (the first at {where:.10g} m); mend them, "
                "or add 'fill' to repair where a straight line may stand for them"
            )
        columns[name] = np.interp(series.axis, series.axis[~lost], values[~lost])
        longest = _longest(lost) * series.step
        how.notes.repair(
            f"{name}: {int(lost.sum())} lost values filled by straight lines, over {longest:.4g} m at most"
        )
    return Series(series.axis, columns, series.step)


def _longest(flags: np.ndarray) -> int:
    edges = np.diff(np.concatenate([[0], flags.astype(int), [0]]))
    return int((np.flatnonzero(edges < 0) - np.flatnonzero(edges > 0)).max())


def _straightened(key: str, chord: Chord | None, series: Series, notes: Notes) -> np.ndarray:
    """The column itself, or the alignment behind its versines."""
    values = series.columns[key]
    if chord is None:
        return values
    uneven = np.abs(np.diff(series.axis) - series.step).max()
    if uneven > _EVEN * series.step:
        raise InputError(
            f"{key}: versines need even rows, these differ by {uneven:.3g} m; add 'snap' or 'resample' to repair"
        )
    return alignment(values, series.step, chord, key, notes)


def _oriented(
    run: np.ndarray, columns: dict[str, np.ndarray], kilometrage: Kilometrage, notes: Notes
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Distance and columns in the direction of the track file, left and right as seen in it."""
    towards = kilometrage.towards or kilometrage.direction
    sides = kilometrage.sides or "running"
    if kilometrage.sides is None and kilometrage.direction == "down":
        notes.assume("left and right are as seen in the running direction")
    seen = kilometrage.direction if sides == "running" else "up"
    s = run
    if towards != kilometrage.direction:
        s, columns = -run[::-1], {key: values[::-1] for key, values in columns.items()}
        if "gradient" in columns:
            columns["gradient"] = -columns["gradient"]
        notes.assume(
            f"rows turned round: the car ran {kilometrage.direction} the kilometrage, the track file goes {towards}"
        )
    if seen != towards:
        columns = _mirrored(columns)
        notes.assume("left and right exchanged: the track file looks the other way than the car's file")
    if towards == "up":
        zero = s[0] if kilometrage.zero is None else kilometrage.zero
        notes.assume(f"s = 0 m is at kilometrage {zero:.10g} m, s goes up with it")
        return s - zero, columns
    zero = -s[0] if kilometrage.zero is None else kilometrage.zero
    notes.assume(f"s = 0 m is at kilometrage {zero:.10g} m, s goes up as it goes down")
    return s + zero, columns


def _mirrored(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    mirrored = {}
    for key, values in columns.items():
        side, _, rest = key.partition("_")
        other = {"left": f"right_{rest}", "right": f"left_{rest}"}.get(side, key)
        mirrored[other] = -values if key in _MIRRORED else values
    return mirrored


def _aligned(
    s: np.ndarray, columns: dict[str, np.ndarray], wanted: Registration, folder: Path, notes: Notes
) -> np.ndarray:
    """Distance moved on to the reference's."""
    key = wanted.column.rpartition(" [")[0]
    reference = read_track(folder / wanted.reference)
    if key not in columns or key not in reference.given:
        raise InputError(f"align.column: '{wanted.column}' must be a column of this file and of '{wanted.reference}'")
    shifted = shifts(
        (s, columns[key]), (reference.s, reference.columns()[key]), wanted.window, wanted.largest, wanted.threshold
    )
    moves = shifted.shift
    notes.repair(
        f"places moved by {moves.mean():.3f} m on average ({moves.min():.3f} to {moves.max():.3f} m) "
        f"on to '{Path(wanted.reference).name}': cross-correlation of {key} in {shifted.at.size} windows of "
        f"{wanted.window:g} m, {shifted.rejected} left out, correlation {np.median(shifted.correlation):.2f}"
    )
    moved = shifted.correct(s)
    if (np.diff(moved) <= 0).any():
        raise InputError("align: neighbouring windows' shifts would turn rows round; use a wider window")
    return moved
