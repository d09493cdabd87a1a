"""Whether what is asked for fits on the disk and into memory, looked at before the work begins."""

import shutil
from pathlib import Path

from railsim.errors import InputError

BYTES = 8  # of a number
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


def _size(count: float) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e8 else f"{count / 1e6:.3g} MB"
