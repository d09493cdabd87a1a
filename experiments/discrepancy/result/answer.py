"""Answer: the verdict on gathered evidence by the compiled engine alone, as the benchmark asks for it."""

from collections.abc import Sequence
from typing import Any

from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.progress import Progress, silent
from experiments.discrepancy.result.adding import gaps, predicted_after
from experiments.discrepancy.result.verdict import verdict
from experiments.discrepancy.workflow import Findings, investigate


def answer(
    evidence: Evidence, withheld: Sequence[str] = (), progress: Progress = silent
) -> tuple[dict[str, Any], Findings]:
    """The verdict, by the compiled engine, and what it rests on; `withheld`: classes of effects to do without."""
    findings = investigate(evidence, progress, withheld=withheld)
    whole, channels = gaps(findings, predicted_after(findings, "compiled"))
    return verdict(findings, whole, channels), findings
