"""The rule: the source of all that shapes a verdict, as one number."""

import hashlib
from pathlib import Path

from railsim import effects as library

OUTSIDE = (
    "benchmark.py",
    "benchmark_rows.py",
    "benchmark_score.py",
    "countdown.py",
    "elsewhere.py",
    "estimated_track.py",
    "explain.py",
    "pictures.py",
    "planning.py",
    "report.py",
    "separating.py",
)
"""Files of the workflow that only show, count or go on from a verdict."""


def rule_hash() -> str:
    """SHA-256 over the source of the workflow and of the effects: rows of other rules do not count."""
    folders = [Path(__file__).parent, Path(str(library.__file__)).parent]
    total = hashlib.sha256()
    for path in sorted(path for folder in folders for path in folder.glob("*.py")):
        if path.name not in OUTSIDE:
            total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()[:16]
