"""Bogies and wheelsets that an effect acts on, and where their suspension stands in a vehicle's model.

Elements are known by the beginnings of their names and by the bogie that they join. A linear damper is a part of the
springs' element, or stands in an element of its own; one that is not linear is a law on each side.
"""

import re
from collections.abc import Sequence
from typing import Any, ClassVar, Literal, NamedTuple

from railsim.effects.interface import CHOSEN, Effect, Setup
from railsim.errors import InputError
from railsim.force_laws import Damper, Maxwell, SeriesDamper
from railsim.model import LinearElement, Model, NonlinearElement
from railsim.spec import quantity

Bogie = Literal[1, 2, "both"]
WheelsetNumber = Literal[1, 2, 3, 4]
Wheelsets = Literal["all", 1, 2, 3, 4]
ALL = "all"
DAMPERS = (Damper, Maxwell, SeriesDamper)


class Place(NamedTuple):
    """Where a component stands: beginning of its elements' names, and the axes about which it acts there.

    `coupled`: it acts between these axes as well, and nothing else does.
    """

    beginning: str
    axes: tuple[str, ...]
    coupled: bool = False


class Component(NamedTuple):
    """A part of the suspension: its name, the places where its linear form may stand, and whether these are dampers,
    which may have laws of their own; then elements of the same name hold these.
    """

    name: str
    places: tuple[Place, ...]
    damper: bool = False


YAW_DAMPERS = Component("yaw_damper", (Place("secondary", ("yaw",)), Place("yaw_damper", ("x", "yaw"))), True)
LATERAL_DAMPERS = Component("lateral_damper", (Place("secondary", ("y",)), Place("lateral_damper", ("y",))), True)
VERTICAL_DAMPERS = Component(
    "vertical_damper", (Place("secondary", ("z", "roll")), Place("vertical_damper", ("z", "roll"))), True
)
PRIMARY_DAMPERS = Component("primary_damper", (Place("primary", ("z", "roll")),))
SECONDARY_LATERAL = Component("secondary", (Place("secondary", ("y",)),))
SECONDARY_VERTICAL = Component("secondary", (Place("secondary", ("z", "roll")),))
PRIMARY_VERTICAL = Component("primary", (Place("primary", ("z", "roll")),))
GUIDANCE_LATERAL = Component("guidance", (Place("primary", ("y",)), Place("bushing", ("y",))))
GUIDANCE_LONGITUDINAL = Component(
    "guidance", (Place("primary", ("x", "yaw")), Place("bushing", ("x", "z", "roll", "pitch", "yaw"), coupled=True))
)
"""The guidance along the track: an arm that is not level pulls upwards as well."""


class BogieEffect(Effect, frozen=True):
    """Base of effects on the suspension of one bogie or both."""

    bogie: Bogie = quantity("both", unit="-, 1 leading", source=CHOSEN, role="bogie")

    added: ClassVar[tuple[str, ...]] = ("bogie",)


def wheelset_field() -> Any:
    """Field `wheelset`: the one that an effect acts on."""
    return quantity(1, unit="-, 1 leading", source=CHOSEN, role="wheelset")


def wheelset_place(setup: Setup, effect: Effect, wheelset: int) -> int:
    """Place of a wheelset among those of the model.

    Raises
    ------
    InputError : the vehicle has fewer.
    """
    count = len(setup.model.wheelsets)
    if wheelset > count:
        raise InputError(
            f"effect '{effect.kind}': there is no wheelset {wheelset}; give {'1' if count == 1 else f'1 to {count}'}"
        )
    return wheelset - 1


def bogie_names(model: Model) -> list[str]:
    """Names of the bogies, the leading one first."""
    return [body.name for body in model.bodies if re.fullmatch(r"bogie\d*", body.name)]


def chosen(setup: Setup, effect: BogieEffect) -> str:
    """Name of the bogie that an effect is told to act on; empty for all that there are.

    Raises
    ------
    InputError : the vehicle has no such bogie.
    """
    if effect.bogie == "both":
        return ""
    names = bogie_names(setup.model)
    if effect.bogie > len(names):
        raise InputError(
            f"effect '{effect.kind}': there is no bogie {effect.bogie}; "
            + (f"give {'1 or ' if len(names) == 1 else '1, 2 or '}both" if names else "leave it out")
        )
    return names[effect.bogie - 1]


def _of(element: LinearElement | NonlinearElement, bogie: str, beginning: str) -> bool:
    """Whether an element has such a name, and joins this bogie (any where it is empty)."""
    return element.name.startswith(beginning) and (not bogie or bogie in (element.upper, element.lower))


def springs(setup: Setup, effect: BogieEffect, beginning: str) -> list[LinearElement]:
    """Linear elements of the chosen bogies whose names begin so.

    Raises
    ------
    InputError : there is no such bogie, or no such element.
    """
    bogie = chosen(setup, effect)
    found = [element for element in setup.model.elements if _of(element, bogie, beginning)]
    if not found:
        known = ", ".join(element.name for element in setup.model.elements)
        raise InputError(
            f"effect '{effect.kind}': the vehicle has no element '{beginning}' (it has {known}); take another vehicle"
        )
    return found


def places(setup: Setup, effect: BogieEffect, component: Component) -> list[tuple[LinearElement, Place]]:
    """Linear elements of the chosen bogies in which a component may stand, each with the axes that are its own.

    Raises
    ------
    InputError : there is no such bogie.
    """
    bogie = chosen(setup, effect)
    return [
        (element, place)
        for element in setup.model.elements
        for place in component.places
        if _of(element, bogie, place.beginning)
    ]


def laws(setup: Setup, effect: BogieEffect, component: Component) -> list[NonlinearElement]:
    """Dampers of the chosen bogies that have a law of their own.

    Raises
    ------
    InputError : there is no such bogie.
    """
    bogie = chosen(setup, effect)
    return [
        element
        for element in setup.model.nonlinear
        if component.damper and isinstance(element.law, DAMPERS) and _of(element, bogie, component.name)
    ]


def nonlinear(setup: Setup, effect: BogieEffect, law: type) -> set[str]:
    """Names of elements of the chosen bogies with such a law.

    Raises
    ------
    InputError : there is no such bogie.
    """
    bogie = chosen(setup, effect)
    found = [element for element in setup.model.nonlinear if _of(element, bogie, "")]
    return {element.name for element in found if isinstance(element.law, law)}


def joined(model: Model, body: str, beginnings: Sequence[str]) -> list[LinearElement]:
    """Linear elements at a body whose names begin so."""
    return [e for e in model.elements if e.name.startswith(tuple(beginnings)) and body in (e.upper, e.lower)]
