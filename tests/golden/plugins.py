"""Where the golden record finds its plug-ins: the only file of it that follows when they move."""

from collections.abc import Mapping

from estimators.interface import ESTIMATORS, Estimator
from experiments.figures.interface import FIGURES, Figure

__all__ = ["Estimator", "Figure", "estimator_kinds", "figure_kinds"]


def estimator_kinds() -> Mapping[str, type[Estimator]]:
    """Every estimator by its name."""
    return ESTIMATORS.classes()


def figure_kinds() -> Mapping[str, type[Figure]]:
    """Every figure by its name."""
    return dict(FIGURES.classes())
