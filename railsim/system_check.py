"""What this machine lacks to run railsim, in words: runs on any Python from 3.6 with nothing installed.

`make` calls it with the system's Python before it makes the virtual environment, so the syntax here stays old.
"""

import ctypes
import importlib.util
import sys

OLDEST_PYTHON = (3, 11)
LIBRARIES = {"libGL.so.1": "libgl1", "libX11.so.6": "libx11-6"}  # shared library -> Debian and Ubuntu package
MODULES = {"venv": "python3-venv", "ensurepip": "python3-venv"}


def python_problem(version: "tuple[int, ...]" = sys.version_info[:3]) -> "str | None":
    """One line when `version` is older than Python 3.11, else None."""
    if version[:2] >= OLDEST_PYTHON:
        return None
    running, python = ".".join(map(str, version)), "python{}.{}".format(*OLDEST_PYTHON)
    remedy = f"install {python} and {python}-venv (Debian package names), then call make PYTHON={python}"
    return f"Python {running} is too old, 3.11 or newer is needed: {remedy}"


def library_problem(library: str, package: str) -> "str | None":
    """One line when the shared `library` cannot be loaded, else None."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return f"the system library {library} is missing (Exudyn needs it): install {package} (Debian package name)"
    return None


def module_problem(module: str, package: str) -> "str | None":
    """One line when Python's own `module` was split off by the system's packager, else None."""
    if importlib.util.find_spec(module) is None:
        return f"Python's module {module} is missing: install {package} (Debian package name)"
    return None


def problems() -> "list[str]":
    """Everything that is missing: a list of lines, empty when railsim can run here."""
    messages = [python_problem()]
    messages += [library_problem(library, package) for library, package in LIBRARIES.items()]
    messages += [module_problem(module, package) for module, package in MODULES.items()]
    return [line for line in messages if line]


def main() -> int:
    """Print what is missing to stderr; exit code 2 where something is, 0 otherwise."""
    messages = problems()
    for line in messages:
        print("railsim: " + line, file=sys.stderr)
    return 2 if messages else 0


if __name__ == "__main__":
    sys.exit(main())
