"""What a command tells on stderr: lines of the logger `railsim`, by the level that `--quiet` and `--verbose` set."""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from railsim.progress import LOGGER

__all__ = ["LEVELS", "LOGGER", "logged", "tell"]

LEVELS = {"quiet": logging.ERROR, "usual": logging.INFO, "verbose": logging.DEBUG}


class _Format(logging.Formatter):
    """Lines as they are; the steps of `--verbose` with time since the start and where they come from."""

    def format(self, record: logging.LogRecord) -> str:
        """One line."""
        text = super().format(record)
        return text if record.levelno > logging.DEBUG else f"{record.relativeCreated / 1e3:8.2f} s  {text}"


@contextmanager
def logged(level: int) -> Iterator[None]:
    """Write records of the logger `railsim` from `level` on to stderr, as plain lines."""
    logger = logging.getLogger(LOGGER)
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_Format())
    before, passed_on = logger.level, logger.propagate
    logger.addHandler(handler)
    logger.setLevel(level)
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)
        logger.propagate = passed_on


def tell(text: str) -> None:
    """A line about what is being done."""
    logging.getLogger(LOGGER).info(text)
