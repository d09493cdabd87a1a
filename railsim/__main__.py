"""Start of the command `railsim` (also `python -m railsim`).

The command itself stands in `experiments`, a name that another program on the path may have as well: that is said in
one line here, in the one package that nobody else has.
"""

import os
import sys
from collections.abc import Sequence
from importlib import import_module

from railsim.distribution import check_packages
from railsim.errors import InputError

LIBRARIES = ("OPENBLAS", "MKL", "BLIS")
"""Of linear algebra; stated before they are loaded: one thread, so that sums depend on no number of threads."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with these words, those of the command line where None; returns its exit code."""
    os.environ |= {f"{library}_NUM_THREADS": "1" for library in LIBRARIES}
    try:
        check_packages()
    except InputError as error:
        print(f"railsim: {error}", file=sys.stderr)
        return 2
    return import_module("experiments.cli").main(arguments)


if __name__ == "__main__":
    sys.exit(main())
