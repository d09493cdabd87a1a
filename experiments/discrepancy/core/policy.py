"""Policy: every number of the inference that is a choice; data of a system (sheets, library) are not among them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from railsim.errors import InputError


@dataclass(frozen=True)
class Losses:
    """What each kind of wrong verdict costs, in one unit; a right one costs nothing.

    Attributes
    ----------
    false_alarm : a healthy system is accused by name. false_unknown : a healthy system is said to miss something.
    wrong : another name. name_for_unknown : a name where something unknown is missing. miss : nothing is said.
    refuse : `unknown` where the library has it. extra : each further name of an ambiguous set. half : one of a pair.
    """

    false_alarm: float = 20.0
    false_unknown: float = 15.0
    wrong: float = 10.0
    name_for_unknown: float = 10.0
    miss: float = 5.0
    refuse: float = 3.0
    extra: float = 1.5
    half: float = 2.0


@dataclass(frozen=True)
class Policy:
    """Eighteen numbers, the losses included; none of them is a threshold.

    Attributes
    ----------
    unknown_median, unknown_spread : median of an unknown error, relative to what acts there, and sd of its log: an
    error that one would want to be told of.
    none, effect, unknown, pair : probabilities of the kinds of hypothesis beforehand; rates of faults.
    beside : share of the pairs that are an effect with something unknown beside it.
    tolerance : two rounds agree where their evidence differs by less [nats]. candidates : effects that are fitted
    whole. longest_step : of the search, in standard deviations of the priors. These three change time, not meaning.
    losses : eight numbers, the user's.
    """

    unknown_median: float = 0.2
    unknown_spread: float = 0.8
    none: float = 0.5
    effect: float = 0.35
    unknown: float = 0.08
    pair: float = 0.05
    beside: float = 0.4
    tolerance: float = 0.2
    candidates: int = 12
    longest_step: float = 6.0
    losses: Losses = field(default_factory=Losses)

    def but(self, changes: Mapping[str, Any]) -> "Policy":
        """The same with other numbers, those of the losses as `losses.miss`.

        Raises
        ------
        InputError : there is no such number, or it is not a positive one.
        """
        own: dict[str, Any] = {}
        losses: dict[str, float] = {}
        for key, value in changes.items():
            names = {f"losses.{one.name}" for one in fields(Losses)} | {one.name for one in fields(self)} - {"losses"}
            if key not in names:
                raise InputError(f"policy: there is no number '{key}'; there are {', '.join(sorted(names))}")
            if not isinstance(value, int | float) or isinstance(value, bool) or not 0.0 < value < 1e6:
                raise InputError(f"policy: {key} must be a positive number, not {value!r}")
            (losses if key.startswith("losses.") else own)[key.removeprefix("losses.")] = value
        return replace(self, **own, losses=replace(self.losses, **losses))

    def numbers(self) -> dict[str, float]:
        """All of them by name, those of the losses as `losses.miss`."""
        own = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "losses"}
        return own | {f"losses.{one.name}": getattr(self.losses, one.name) for one in fields(Losses)}
