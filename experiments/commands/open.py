"""`railsim open`: show the report of a result in the browser.

examples:
  railsim open results/default
  railsim open sweep
  railsim open verdict --no-browser
"""

import argparse
import webbrowser
from pathlib import Path

from experiments.reporting.outcome import Outcome
from railsim.errors import InputError

OWN = "overview.html"


def configure(parser: argparse.ArgumentParser) -> None:
    """Result."""
    parser.add_argument("result", metavar="RESULT", help="folder of a result, or a page (.html)")
    parser.add_argument("--no-browser", action="store_true", help="only say which page it is")


def execute(given: argparse.Namespace) -> Outcome:
    """Find the page, or make one of the folder's tables and pictures, and show it.

    Raises
    ------
    InputError : there is nothing to show.
    """
    path = _page(Path(given.result))
    shown = not given.no_browser and webbrowser.open(path.resolve().as_uri())
    if given.no_browser:
        return Outcome({"page": str(path), "shown": False}, str(path))
    said = f"{path}: shown in the browser" if shown else f"{path}: no browser was found; open this file in one"
    return Outcome({"page": str(path), "shown": bool(shown)}, said)


def _page(result: Path) -> Path:
    """The page that the command made, or an overview that is made now."""
    from experiments.reporting.overview import overview
    from railsim.files import replace_file

    if result.is_file() and result.suffix == ".html":
        return result
    if not result.is_dir():
        raise InputError(f"there is no folder or page '{result}'; name what --out named")
    made = sorted(path for path in result.glob("*.html") if path.name != OWN)
    if made:
        return next((path for path in made if path.name == "report.html"), made[0])
    replace_file(result / OWN, overview(result).encode())
    return result / OWN
