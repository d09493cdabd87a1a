"""Where the golden record finds its plug-ins: the only file of it that follows when they move."""

from collections.abc import Callable, Mapping

import estimators
from estimators.interface import Estimator
from experiments import figures
from experiments.figures.interface import Figure
from railsim.registry import discover

__all__ = ["Estimator", "Figure", "estimator_kinds", "figure_kinds"]


def estimator_kinds() -> Mapping[str, type[Estimator]]:
    """Every estimator by its name."""
    return discover(estimators, Estimator)


def figure_kinds() -> Mapping[str, Callable[[], Figure]]:
    """Every figure by its name."""
    return dict(discover(figures, Figure))
