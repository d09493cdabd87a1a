"""The one exception that a user's mistake raises."""


class InputError(ValueError):
    """Input that cannot be used: one line that says what is wrong and how to mend it (the command exits with 2)."""
