"""Numbers of the policy and scales of the healthy levels as a file that a user can read and change."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.systems.half_car import SCALES
from experiments.discrepancy.systems.half_car_benchmark import learn
from railsim.errors import InputError


def learned_policy(say: Callable[[str], None]) -> str:
    """YAML of all numbers, with scales that are learned from healthy records anew."""
    scales = {name: round(value, 5) for name, value in learn(say).items()}
    return yaml.safe_dump({"numbers": Policy().numbers(), "scales": scales}, sort_keys=False)


def read_policy(path: Path) -> tuple[Policy, dict[str, float]]:
    """Policy and scales; what a file does not say stays as it is.

    Raises
    ------
    InputError : there is no such file, or it says something that is not known.
    """
    try:
        given: Any = yaml.safe_load(path.read_text())
    except (OSError, yaml.YAMLError) as error:
        raise InputError(f"--policy {path}: cannot be read: {str(error).splitlines()[0]}") from None
    if not isinstance(given, dict) or not set(given) <= {"numbers", "scales"}:
        raise InputError(f"--policy {path}: give 'numbers' and 'scales'; --learn {path} writes such a file")
    scales: dict[str, float] = given.get("scales") or {}
    for name, value in scales.items():
        if name not in SCALES:
            raise InputError(f"--policy {path}: there is no level '{name}'; there are {', '.join(SCALES)}")
        if not isinstance(value, int | float) or isinstance(value, bool) or not 0.0 < value < 1.0:
            raise InputError(f"--policy {path}: scale of '{name}' must be a number from 0 to 1, not {value!r}")
    return Policy().but(given.get("numbers") or {}), SCALES | scales
