"""Stand: how far the selection is, and what follows from the fits that were made so far."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.fit.hypothesis import Hypothesis
from experiments.discrepancy.screen.latent import LatentForce
from experiments.discrepancy.screen.locate import locate
from experiments.discrepancy.select.decide import ENOUGH, Judged, ahead, judge, needs_far
from experiments.discrepancy.select.refining import something_left

FAR_BEHIND = 300.0  # nats behind the best from which a hypothesis is not followed any further,
OUT_OF_REACH = 0.3  # or this share of what the best brings, if that is more
NO_RIVAL = 0.8  # of what the best brings, from which a fit is given up that leaves more than noise


@dataclass(frozen=True)
class Stand:
    """How far it is.

    Attributes
    ----------
    problem : with the noise as it is known. null : nuisances alone. fitted : all effects that were fitted beside them.
    tabled : a law without a name, and where it acts.
    """

    problem: Problem
    null: Hypothesis
    fitted: Sequence[Hypothesis]
    tabled: tuple[Hypothesis, LatentForce] | None = None

    @cached_property
    def judged(self) -> list[Judged]:
        """The fitted ones with their figures, the most probable first."""
        return judge(self.problem, self.null, self.fitted)

    @cached_property
    def best(self) -> Hypothesis:
        """The most probable where it has evidence enough, else nuisances alone."""
        return self.judged[0].hypothesis if self.judged and self.judged[0].evidence >= ENOUGH else self.null

    @cached_property
    def most(self) -> Hypothesis | None:
        """The fitted one that takes most."""
        return max(self.fitted, key=lambda one: one.log_evidence, default=None)

    @cached_property
    def level(self) -> float:
        """Cost from which a fit is not followed any further: far behind that of the one that takes most, closer where
        that leaves only noise.
        """
        if self.most is None:
            return math.inf
        gain = self.most.log_evidence - self.null.log_evidence if something_left(self.problem, self.most) else 0.0
        return self.most.fit.cost(self.problem.train) + max(FAR_BEHIND, NO_RIVAL * gain)

    @property
    def leader(self) -> Hypothesis:
        """The law without a name where it is ahead of the best, else the best."""
        law = self.tabled[0] if self.tabled else None
        return law if law is not None and ahead(self.null, self.best, law) else self.best

    @cached_property
    def far(self) -> bool:
        """Whether the best explains it only with nuisances far from their data sheets."""
        gain = self.judged[0].evidence if self.best is not self.null else 0.0
        return needs_far(self.problem, self.best, locate(self.problem, self.best.fit), gain)

    @property
    def by_law(self) -> bool:
        """Whether the best needs nuisances far from their data sheets, and a law without a name explains something."""
        return self.tabled is not None and self.far and ahead(self.null, self.null, self.tabled[0])

    @cached_property
    def unexplained(self) -> bool:
        """Whether the best leaves more than noise."""
        return something_left(self.problem, self.best)
