"""All checks in their order, each on what the repairs of those before it have left."""

from collections.abc import Callable
from dataclasses import dataclass

from railsim.measurements import Measurements
from railsim.progress import counting
from railsim.quality._signals import kind_of
from railsim.quality.blocks import LONGEST, joined, parts, together
from railsim.quality.interface import CHECKS, Check, Finding
from railsim.quality.repair import repaired

_COMPARED = ("accelerometer", "gyro", "displacement")


@dataclass(frozen=True)
class Inspection:
    """What was found, and the measurements with every repair made."""

    findings: list[Finding]
    cleaned: Measurements

    @property
    def faults(self) -> list[Finding]:
        """Findings that are not mere notes."""
        return [one for one in self.findings if one.severity == "fault"]


def checks() -> list[Check]:
    """Every check with its default limits, in the order of their stages."""
    found = CHECKS.classes()
    return [found[name].build({}) for name in sorted(found, key=lambda name: (found[name].stage, name))]


SHORTEST = 2.0
"""s; checks compare parts of a record, of which a shorter one has too few."""


def inspect(measured: Measurements, clean: bool = True, progress: bool = False) -> Inspection:
    """Verify a recording before use (Ward et al. 2011, section 6); a record of less than `SHORTEST` is only noted.

    One of more than `LONGEST` is inspected in parts, and what is alike in several is one finding.

    Parameters
    ----------
    clean : whether the repaired measurements of a record of several parts are wanted; without, they are as they were.
    progress : show it on stderr, where that is a terminal.
    """
    short = _too_short(measured)
    if short is not None:
        return Inspection([short], measured)
    first, last = measured.span()
    with counting(len(checks()), "inspecting", "checks", wanted=progress) as bar:
        if last - first <= LONGEST:
            found, cleaned = _checked(measured, bar.update)
            return Inspection(_ordered(found), cleaned)
        each, mended, count = [], [], 1
        for part in parts(measured):
            count = part.count
            bar.total = len(checks()) * count
            found, cleaned = _checked(part.measured, bar.update)
            each += [(part.number, part.placed(one)) for one in found]
            mended += [cleaned] if clean else []
    return Inspection(_ordered(together(each, count)), joined(measured, mended) if clean else measured)


def _checked(measured: Measurements, done: Callable[[], object]) -> tuple[list[Finding], Measurements]:
    """What all checks find, and the measurements with every lasting repair; `done` is called after each check."""
    findings: list[Finding] = []
    cleaned = measured
    for check in checks():
        new = check.find(measured)
        measured = repaired(measured, new)
        cleaned = repaired(cleaned, [one for one in new if one.repair is not None and one.repair.lasting])
        findings += new
        done()
    return findings, cleaned


def _ordered(findings: list[Finding]) -> list[Finding]:
    return sorted(findings, key=lambda one: (one.severity != "fault", one.start))


def _too_short(measured: Measurements) -> Finding | None:
    """A note where the shortest table of inertial sensors, or else the longest table, has too little for any check."""
    lengths = {name: measured[name].size / measured.rate(name) for name in measured}
    inertial = {name: length for name, length in lengths.items() if kind_of(measured, name) in _COMPARED}
    name = min(inertial, key=inertial.__getitem__) if inertial else max(lengths, key=lengths.__getitem__)
    if lengths[name] >= SHORTEST:
        return None
    time = measured.time(name)
    extent = f"{lengths[name]:.3g} s are too short to be checked, {SHORTEST:g} s are needed"
    ends = (float(time[0]), float(time[-1])) if time.size else (0.0, 0.0)
    return Finding("too short", name, *ends, extent, "record longer", severity="note")
