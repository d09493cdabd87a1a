"""All checks in their order, each on what the repairs of those before it have left."""

from dataclasses import dataclass

from railsim.measurements import Measurements
from railsim.quality.interface import CHECKS, Check, Finding
from railsim.quality.repair import repaired


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


def inspect(measured: Measurements) -> Inspection:
    """Verify a recording before use (Ward et al. 2011, section 6)."""
    findings: list[Finding] = []
    cleaned = measured
    for check in checks():
        new = check.find(measured)
        measured = repaired(measured, new)
        cleaned = repaired(cleaned, [one for one in new if one.repair is not None and one.repair.lasting])
        findings += new
    return Inspection(sorted(findings, key=lambda one: (one.severity != "fault", one.start)), cleaned)
