"""The rule: the source of all that shapes a verdict, as one number."""

import hashlib
from pathlib import Path

from railsim import effects as library
from railsim.effects.interface import EFFECTS
from railsim.registry import source_digest

OUTSIDE = (
    "baseline/estimated_track.py",
    "blind/benchmark.py",
    "blind/benchmark_rows.py",
    "blind/benchmark_score.py",
    "result/countdown.py",
    "result/elsewhere.py",
    "result/explain.py",
    "result/pictures.py",
    "result/planning.py",
    "result/report.py",
    "result/separating.py",
)
"""Files of the workflow that only show, count or go on from a verdict."""


def rule_hash() -> str:
    """SHA-256 over the source of the workflow and of all effects: rows of other rules do not count."""
    total = hashlib.sha256()
    for folder in (Path(__file__).parent, Path(str(library.__file__)).parent):
        for path in sorted(folder.rglob("*.py")):
            name = path.relative_to(folder).as_posix()
            if name not in OUTSIDE:
                total.update(name.encode() + b"\0" + path.read_bytes())
    total.update(source_digest(EFFECTS.classes().values()).encode())
    return total.hexdigest()[:16]
