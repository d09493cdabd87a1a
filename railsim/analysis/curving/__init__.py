"""Steady curving of half and whole vehicles from their free-body diagrams, solved apart from the engines."""

from railsim.analysis.curving.balance import Curve, Curving, steady_curving
from railsim.analysis.curving.contact import Wheel

__all__ = ["Curve", "Curving", "Wheel", "steady_curving"]
