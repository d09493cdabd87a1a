"""`import_file`: a file and its map become a recording or a track."""

from collections.abc import Sequence
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


def import_file(
    path: Path | str | Sequence[Path | str], map_path: Path | str, out: Path | str, guard: Guard | None = None
) -> Imported:
    """Read a file by its map and write a recording (a folder) or, for maps of kind "track", a track (a CSV file).

    `path` is several where a recording stands in several files.

    `guard` is the process that reads binary formats; None: one for this file alone.

    Raises
    ------
    InputError : map and file do not fit together, the file is damaged, or the place cannot be written; one line.
    """
    paths = [Path(path)] if isinstance(path, Path | str) else [Path(one) for one in path]
    map_path, out, notes = Path(map_path), Path(out), Notes()
    mapped = load_map(map_path)
    if isinstance(mapped, TrackMap):
        if len(paths) != 1 or paths[0].is_dir():
            raise InputError(f"'{paths[-1]}': a track stands in one file; name that file alone")
        import_track(paths[0], mapped, map_path.parent, out, notes, guard)
        return Imported("track", out, notes)
    import_recording(paths, mapped, map_path.parent, out, notes, guard)
    return Imported("recording", out, notes)
