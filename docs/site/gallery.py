"""The gallery: every figure of `railsim figure`, its caption and, once `make gallery` has run, its picture."""

import re
from pathlib import Path

from experiments.figures.interface import FIGURES

PICTURES = Path(__file__).parents[2] / "results" / "gallery"
WIDE = "---\nhide: [navigation]\n---\n\n"
"""The column of the list of pages gives its room, a third more width, to the pictures."""
PICTURE = re.compile(r"^!\[[^\]]*\]\(([^)\s]+\.png)\)$", re.MULTILINE)


def opening(markdown: str) -> str:
    """The page, with every picture that stands on a line of its own as a link to its full size."""
    return PICTURE.sub(r"[\g<0>](\g<1>)", markdown)


def pictures() -> dict[str, Path]:
    """Pictures that have been drawn, by file name."""
    return {path.name: path for path in sorted(PICTURES.glob("*.png"))}


def page() -> str:
    """One heading a figure: caption, picture, and the command that draws it."""
    drawn = pictures()
    parts = [
        WIDE + "# Gallery",
        "Every figure that railsim draws, from the reduced runs of `--fast`. "
        "Without that option a figure has more runs or longer ones. "
        "Figures named `fig` and a number follow Ward et al. (2011); their numbers are the paper's.",
    ]
    for name, found in FIGURES.classes().items():
        parts += [f"## {name}", found.summary(), " ".join((found.__doc__ or "").split())]
        parts += [
            f"![{name}](gallery/{picture})" for picture in drawn if Path(picture).stem.removesuffix("_picture") == name
        ]
        parts += [f"`railsim figure {name} --out figures`"]
    return "\n\n".join(parts)
