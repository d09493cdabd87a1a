"""What a shell needs to complete `railsim`: commands, options, names of plug-ins, files."""

import argparse

import shtab

from railsim.distribution import shipped_folder

_FOLDERS = {
    "SCENARIO": [("scenarios", "*.yaml")],
    "ESTIMATOR": [("estimators", "*/*.py")],
    "NAME|all": [("experiments", "figures/*.py")],
    "RECORDING|SCENARIO|TRACK": [("scenarios", "*.yaml"), ("track_data", "*.csv")],
}
"""Where the names that an argument takes stand, by its metavar."""
_SHARED = ("_", "interface")
_FUNCTION = """
_railsim_names_{number}() {{
  compgen -W "{names}" -- "$1"
  compgen -f -- "$1"
}}
"""


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """Source that the shell evaluates; names of what ships are in it, paths are completed as well.

    Parameters
    ----------
    parser : of all commands, each with its arguments. shell : bash, zsh or tcsh.
    """
    functions = []
    for action in _actions(parser):
        if action.choices is not None or action.nargs == 0:
            continue
        names = _names(action.metavar)
        if names and shell == "bash":
            functions.append(_FUNCTION.format(number=len(functions), names=" ".join(names)))
            action.complete = {"bash": f"_railsim_names_{len(functions) - 1}"}  # pyright: ignore[reportAttributeAccessIssue]
        else:
            action.complete = shtab.FILE  # pyright: ignore[reportAttributeAccessIssue]
    return shtab.complete(parser, shell, preamble="".join(functions))


def _actions(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """Arguments of a parser and of its commands."""
    own = list(parser._actions)
    inner = [one for action in own if isinstance(action.choices, dict) for one in action.choices.values()]
    inner = [one for one in inner if isinstance(one, argparse.ArgumentParser)]
    return own + [action for one in inner for action in _actions(one)]


def _names(metavar: str | tuple[str, ...] | None) -> list[str]:
    """Names of what ships that the argument takes."""
    folders = _FOLDERS.get(metavar, []) if isinstance(metavar, str) else []
    paths = [path for folder, pattern in folders for path in shipped_folder(folder).glob(pattern)]
    return sorted({path.stem for path in paths if not path.stem.startswith(_SHARED)})
