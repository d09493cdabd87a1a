"""`import_file`: a file and its map become a recording or a track."""

from dataclasses import dataclass
from pathlib import Path

from railsim.errors import InputError
from railsim.field.guard import Guard
from railsim.field.map import TrackMap, load_map
from railsim.field.recording import import_recording
from railsim.field.tables import Notes
from railsim.field.track import import_track


@dataclass(frozen=True)
class Imported:
    """What was made ("recording" or "track"), where, and every assumption and repair."""

    kind: str
    path: Path
    notes: Notes


def import_file(path: Path | str, map_path: Path | str, out: Path | str, guard: Guard | None = None) -> Imported:
    """Read `path` by the map and write a recording (a folder) or, for maps of kind "track", a track (a CSV file).

    `guard` is the process that reads binary formats; None: one for this file alone.

    Raises
    ------
    InputError : map and file do not fit together, the file is damaged, or the place cannot be written; one line.
    """
    path, map_path, out, notes = Path(path), Path(map_path), Path(out), Notes()
    mapped = load_map(map_path)
    if path.is_dir():
        raise InputError(f"'{path}' is a folder; give a CSV, Parquet, MDF4 or TDMS file")
    if isinstance(mapped, TrackMap):
        import_track(path, mapped, map_path.parent, out, notes, guard)
        return Imported("track", out, notes)
    import_recording(path, mapped, map_path.parent, out, notes, guard)
    return Imported("recording", out, notes)
