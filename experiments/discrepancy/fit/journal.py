"""Journal of an unfinished case: fits that are done, by the digest of all that went into them, until it is through.

A case that was stopped finds them again; what comes out is the same, for each fit depends on what its key holds only.
"""

import hashlib
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.fit.stored import read_arrays, write_arrays
from experiments.discrepancy.rule import rule_hash
from railsim.cache import cache_folder
from railsim.scenario import digest_of
from railsim.simulation import code_digest

FOLDER = "unfinished"
KEPT = 3 * 86400.0  # s that an unfinished case is kept
Arrays = dict[str, np.ndarray]


@dataclass(frozen=True)
class Journal:
    """A folder of what is done."""

    folder: Path

    def kept(self, key: str, make: Callable[[], Arrays]) -> Arrays:
        """What was made under a key before, else what is made now; arrays come back as they were, bit by bit."""
        path = self.folder / f"{key}.arrays"
        found = read_arrays(path)
        if not found:
            found = make()
            with suppress(OSError):  # a full disk only costs the time
                write_arrays(path, found)
        return found


@contextmanager
def journal_of(evidence: Evidence, options: Sequence[str]) -> Iterator[Journal]:
    """The journal of a case; it goes when the case is through or was refused, and stays when it is stopped."""
    above = cache_folder().parent / FOLDER
    folder = above / _digest(evidence, options)
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        _tidy(above)
    try:
        yield Journal(folder)
    except Exception:  # a stop by the user is none
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)


def key_of(*parts: str | np.ndarray | None) -> str:
    """Digest of texts and arrays."""
    total = hashlib.blake2b(digest_size=16)
    for part in parts:
        if isinstance(part, np.ndarray):
            total.update(f"{part.dtype.str}{part.shape}".encode())
            total.update(np.ascontiguousarray(part).view(np.uint8).reshape(-1).data)
        else:
            total.update(f"|{part}|".encode())
    return total.hexdigest()


def _digest(evidence: Evidence, options: Sequence[str]) -> str:
    plain = {
        "code": [code_digest(evidence.scenario), rule_hash()],
        "options": list(options),
        "scenario": evidence.scenario.to_yaml(),
        "track": evidence.track.digest(),
        "track_errors": evidence.track_errors.model_dump(mode="json"),
        "track_estimated": evidence.track_estimated,
        "sensors": [sensor.model_dump(mode="json") for sensor in evidence.sensors],
        "rates": evidence.rates,
        "samples": key_of(*(evidence.samples[name] for name in evidence.channels), *evidence.speed[:2]),
    }
    return digest_of(plain)


def _tidy(folder: Path) -> None:
    """Remove cases that nobody went on with."""
    for path in folder.iterdir():
        if time.time() - path.stat().st_mtime > KEPT:
            shutil.rmtree(path, ignore_errors=True)
