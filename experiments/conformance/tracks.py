"""What every track must be."""

from collections.abc import Iterable

from experiments.conformance.interface import Check
from railsim.track.files import format_track, parse_track, read_track
from railsim.track.inspection import problems

Source = str
"""Name or path."""


def says_where_it_is_from(source: Source) -> Iterable[str]:
    """Its first comment line says what it is."""
    if not any(read_track(source).comments):
        yield "begin the file with a comment line '# what it is, where it is from, its licence'"


def written_as_it_was_read(source: Source) -> Iterable[str]:
    """Reading what is written gives the same track."""
    track = read_track(source)
    if parse_track(format_track(track), track.name).digest() != track.digest():
        yield "is another track once it is written and read again"


def nothing_suspicious(source: Source) -> Iterable[str]:
    """Nothing that a measured or made track should not have."""
    yield from problems(read_track(source))


CHECKS: tuple[Check[Source], ...] = (says_where_it_is_from, written_as_it_was_read, nothing_suspicious)
