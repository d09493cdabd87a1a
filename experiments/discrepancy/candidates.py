"""Candidates: every effect of the library, in each of its variants, at sizes from just worth naming to large."""

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from railsim import effects as library
from railsim.effects.interface import Effect, Parameter
from railsim.registry import discover

MOST_VARIANTS = 8
MOST_SIZES = 4
FAR = 0.9  # of the way to a bound


@dataclass(frozen=True)
class Candidate:
    """An effect with its choices made; numbers stay free.

    Attributes
    ----------
    kind : class of the effect. choices : fields that are fixed (sides, wheelsets, places).
    """

    kind: type[Effect]
    choices: tuple[tuple[str, Any], ...] = ()

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.kind.__module__.rpartition(".")[2]

    @property
    def label(self) -> str:
        """Name with the choices."""
        made = ", ".join(f"{key} {value}" for key, value in self.choices)
        return f"{self.name} ({made})" if made else self.name

    @property
    def equivalence(self) -> str:
        """Class of effects that look alike."""
        return self.kind.equivalence()

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Free numbers."""
        fixed = {name for name, _ in self.choices} | set(self.kind.held)
        return {name: one for name, one in self.kind.parameters().items() if name not in fixed}

    def build(self, values: Mapping[str, float]) -> Effect:
        """The effect with these numbers."""
        whole = {name: round(value) if self._whole(name) else value for name, value in values.items()}
        return self.kind.build({**dict(self.choices), **whole})

    def _whole(self, name: str) -> bool:
        return self.kind.model_fields[name].annotation is int

    def sizes(self) -> Iterator[dict[str, float]]:
        """Values of the free numbers to screen with: small, middle, large, to both sides of where it is absent."""
        free = self.parameters
        sized = [name for name, one in free.items() if one.absent is not None]
        rest = {name: one.default for name, one in free.items() if name not in sized}
        if not sized:
            yield rest
            return
        ways = [list(_ladder(free[name])) for name in sized]
        for steps in itertools.zip_longest(*ways):
            values = {
                name: step if step is not None else ways[i][-1]
                for i, (name, step) in enumerate(zip(sized, steps, strict=True))
            }
            yield {**rest, **values}


def candidates() -> list[Candidate]:
    """All effects of the library with their variants."""
    return [one for kind in discover(library, Effect).values() for one in _variants(kind)]


def _variants(kind: type[Effect]) -> Iterator[Candidate]:
    options = {}
    for name, field in kind.model_fields.items():
        values = _options(field.annotation)
        if 1 < len(values) <= MOST_VARIANTS:
            options[name] = values
    combinations = list(itertools.product(*options.values()))
    if len(combinations) > MOST_VARIANTS:
        combinations = combinations[:1]
    for chosen in combinations:
        yield Candidate(kind, tuple(zip(options, chosen, strict=True)))


def _options(annotation: Any) -> tuple[Any, ...]:
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    return (False, True) if annotation is bool else ()


def _ladder(parameter: Parameter) -> Iterator[float]:
    """Sizes on each side of `absent`: the smallest worth naming, and between it and the bound."""
    absent = parameter.absent if parameter.absent is not None else parameter.default
    smallest = parameter.smallest if parameter.smallest is not None else absent + 0.1 * (parameter.high - absent)
    near = max(abs(smallest - absent), 1e-12)
    signs = [1.0 if smallest >= absent else -1.0]
    other = parameter.low if signs[0] > 0 else parameter.high
    if abs(other - absent) > 0.5 * near:
        signs.append(-signs[0])
    for sign in signs:
        far = FAR * abs((parameter.high if sign > 0 else parameter.low) - absent)
        middle = math.sqrt(near * far) if far > near else far
        for size in sorted({min(near, far), middle, far} if len(signs) == 1 else {middle, min(near, far)}):
            yield absent + sign * size
