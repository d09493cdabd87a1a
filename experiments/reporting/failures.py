"""A plug-in that fails is told in one line, with its line of code; what the others give is kept."""

import errno
import inspect
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from railsim.errors import InputError

MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EROFS)
"""Errors of the machine that a run is on (a full disk, for example); they say nothing of a plug-in."""


class PluginError(Exception):
    """A plug-in raised something else than `InputError`; its text is one line, `details` the traceback."""

    @property
    def details(self) -> str:
        """The traceback of what the plug-in raised."""
        return "".join(traceback.format_exception(self.__cause__))


@contextmanager
def plugin_code(name: str, plugin: object = None) -> Iterator[None]:
    """What runs inside belongs to a plug-in.

    Parameters
    ----------
    name : what the plug-in is called in the line.
    plugin : an object of its class: the line of code that is told is the innermost one in the file of that class.

    Raises
    ------
    PluginError : for any exception but those below.
    InputError, MemoryError, OSError : as they are; of `OSError` only those that speak of the machine.
    """
    try:
        yield
    except (InputError, MemoryError):
        raise
    except Exception as error:
        if any(isinstance(one, OSError) and one.errno in MACHINE for one in (error, error.__context__)):
            raise
        raise PluginError(f"{name} failed: {one_line(error, _file(plugin))}") from error


def one_line(error: BaseException, file: str = "") -> str:
    """Kind of an exception, its text, and the innermost line of code that led to it: of `file` where that is there."""
    frames = traceback.extract_tb(error.__traceback__)
    inside = [frame for frame in frames if frame.filename == file] or frames
    where = f" ({Path(inside[-1].filename).name}, line {inside[-1].lineno})" if inside else ""
    return " ".join(f"{type(error).__name__}: {error}".split()) + where


def _file(plugin: object) -> str:
    try:
        return inspect.getfile(type(plugin))
    except (TypeError, OSError):
        return ""
