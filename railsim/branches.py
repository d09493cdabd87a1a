"""Choices without branches (compiled): what they cost is the same whichever way they fall, so that several runs can
take them side by side.
"""

from railsim.compiled import inlined


@inlined
def where(condition, yes, no):
    """`yes` or `no`; both have been computed."""
    return yes if condition else no


@inlined
def may(condition):
    """Whether what follows a condition must be gone through; without it nothing would change."""
    return condition


@inlined
def vanishes(value):
    """Whether a value is nought now, and what it would be multiplied with need not be gone through."""
    return value == 0.0
