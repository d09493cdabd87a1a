"""Whether what is asked for fits on the disk and into memory, looked at before the work begins; how long it takes."""

import shutil
import time
import warnings
from pathlib import Path

from railsim.errors import InputError, Noticed

BYTES = 8  # of a number
_FIRST = 2.0  # s of work by which the time of a run is told
_LONG = 300.0  # s; a longer run is announced
_MEMORY = Path("/proc/meminfo")


def check_disk(needed: float, folder: Path, what: str, cure: str) -> None:
    """Raise `InputError` where `needed` bytes are more than the disk of a folder has left.

    Parameters
    ----------
    folder : to be written; it or folders above need not be there yet. what : that is written. cure : how to need less.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    free = shutil.disk_usage(there).free
    if needed > free:
        raise InputError(f"{what} takes up to {_size(needed)}; the disk of '{there}' has {_size(free)} free; {cure}")


def check_memory(needed: float, what: str, cure: str) -> None:
    """Raise `InputError` where `needed` bytes are more than the memory that this machine can give now."""
    free = available_memory()
    if free is not None and needed > free:
        raise InputError(f"{what} takes about {_size(needed)} of memory, of which {_size(free)} are free; {cure}")


def available_memory() -> float | None:
    """Bytes that a process can still take, by the kernel's own estimate; None where it gives none."""
    try:
        lines = _MEMORY.read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    found = [float(line.split()[1]) * 1024.0 for line in lines if line.startswith("MemAvailable:")]
    return found[0] if found else None


class Forecast:
    """Says once how long a run will take, where that is long: by what its first seconds made."""

    def __init__(self, rows: int) -> None:
        self._left, self._done, self._began = rows, 0, time.monotonic()
        self._said = False

    def update(self, rows: int) -> None:
        """Take note of rows that were made."""
        self._done += rows
        past = time.monotonic() - self._began
        if self._said or past < _FIRST:
            return
        self._said = True
        ahead = past * (self._left / self._done - 1.0)
        if ahead > _LONG:
            how = f"{ahead / 3600.0:.1f} hours" if ahead > 7200.0 else f"{ahead / 60.0:.0f} minutes"
            warnings.warn(f"this run will take about {how}; to stop it, press Ctrl-C", Noticed, stacklevel=2)


def _size(count: float) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e8 else f"{count / 1e6:.3g} MB"
