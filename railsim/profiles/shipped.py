"""The profiles that come with the program.

`python -m railsim.profiles.shipped [FOLDER]` makes their files again, byte for byte, and prints their checksums.
"""

import hashlib
import sys
from collections.abc import Callable
from pathlib import Path

from railsim.profiles.files import write_profile
from railsim.profiles.profile import Profile
from railsim.profiles.s1002 import s1002
from railsim.profiles.uic60 import uic60
from railsim.profiles.wear import worn

_WHEEL = "y from the taping line to the field side, z up (flange at negative y and z)."
_RAIL = "y from the highest point to the field side (gauge face at negative y), z up from the top."


def profiles() -> dict[str, tuple[Callable[[], Profile], str]]:
    """What makes each shipped profile, and what it is, by its name."""
    wheel = "Wheel S1002, made from its published polynomials and arcs (EN 13715)"
    rail = "Rail head 60E1 (UIC 60), made from its published arcs (EN 13674-1)"
    return {
        "s1002": (s1002, f"{wheel}; {_WHEEL}"),
        "s1002_worn_050": (lambda: worn(s1002(), 0.5), f"{wheel}, worn with severity 0.5 (invented shape); {_WHEEL}"),
        "s1002_worn_100": (lambda: worn(s1002(), 1.0), f"{wheel}, worn with severity 1 (invented shape); {_WHEEL}"),
        "uic60": (uic60, f"{rail}, upright; {_RAIL}"),
        "uic60_20": (lambda: uic60(1.0 / 20.0), f"{rail}, inclined 1:20; {_RAIL}"),
        "uic60_40": (lambda: uic60(1.0 / 40.0), f"{rail}, inclined 1:40; {_RAIL}"),
    }


def main(arguments: list[str]) -> None:
    """Write every shipped profile into `arguments[0]` (default track_data/profiles) and print its SHA-256."""
    folder = Path(arguments[0] if arguments else "track_data/profiles")
    folder.mkdir(parents=True, exist_ok=True)
    for name, (make, what) in profiles().items():
        path = folder / f"{name}.csv"
        write_profile(make(), path, [what, "Made by python -m railsim.profiles.shipped; licence MIT, as the program."])
        print(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}")


if __name__ == "__main__":
    main(sys.argv[1:])
