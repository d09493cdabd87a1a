"""How every kernel of the project is compiled."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])

# Contraction and reassociation are allowed; NaN and infinity keep their meaning, so that a run that diverges is seen.
_OPTIONS: dict[str, Any] = {
    "cache": True,
    "fastmath": {"contract", "reassoc", "nsz"},
    "error_model": "numpy",
    "_nrt": False,
}


def kernel(function: F) -> F:
    """Compiled, cached on disk; division by zero gives infinity as in NumPy."""
    return cast(F, njit(**_OPTIONS)(function))


def inlined(function: F) -> F:
    """A kernel that is copied into its callers: for small functions that are given many arrays, whose passing would
    cost more.
    """
    return cast(F, njit(forceinline=True, **_OPTIONS)(function))
