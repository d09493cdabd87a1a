"""Where the parts of the distribution stand: beside `railsim`, whatever else is called the same on the path."""

from importlib.util import find_spec
from pathlib import Path

from railsim.errors import InputError

ROOT = Path(__file__).resolve().parents[1]
CODE = ("railsim", "estimators", "experiments")
"""Our packages of code; Python finds them by the path alone."""


def shipped_folder(*parts: str) -> Path:
    """A folder of shipped data, for example "scenarios"."""
    return ROOT.joinpath(*parts)


def version() -> str:
    """Version of railsim, as in pyproject.toml."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed

    try:
        return installed("railsim")
    except PackageNotFoundError:  # a tree that was copied and never installed
        import tomllib

        return str(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"])


def is_ours(file: Path) -> bool:
    """Whether a file of code came with the program."""
    return any(file.is_relative_to(ROOT / package) for package in CODE)


def check_packages() -> None:
    """Raise `InputError` that names a package of another program that hides one of ours."""
    for name in CODE:
        spec = find_spec(name)
        locations = (spec.submodule_search_locations or [spec.origin or name]) if spec else []
        folders = [Path(place).resolve() for place in locations]
        if ROOT / name not in folders:
            raise InputError(
                f"package '{name}' of railsim is hidden by '{folders[0]}'; rename that, or take its folder off "
                "the path (PYTHONPATH, or start 'railsim' in place of 'python -m')"
                if folders
                else f"package '{name}' of railsim is not installed beside '{ROOT / 'railsim'}'; install railsim again"
            )
