"""Plan of the blind cases: what kind each number is, over which section, at which speed, on which vehicle and line.

Kinds, settings and effects are dealt from shuffled decks, so that any first part of the cases is a fair sample and
the stated shares hold to within a deck.
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from railsim.scenario import Scenario, load_scenario
from railsim.speed import Constant

HIDDEN = {"effect": 9, "pair": 2, "withheld": 2, "foreign": 2}
"""Of 15 cases with something in them: an effect of the library; two; one that the workflow is then denied; a law from
outside.
"""
EMPTY = {"null": 24, "decoy": 6}
"""Of 30 cases without: a build within tolerance; two nuisances at 2 to 3 standard deviations."""
SETTINGS = {"home": 4, "section": 2, "speed": 2, "line": 2}
"""Of 10 cases: the nominal scenario; another section of its line; at 0.8 of its speed; another vehicle on another line
(`held_out.yaml`). Only the first is ever used in development.
"""
SLOWER = 0.8
SPARE = 50.0  # m left behind the last section
HELD_OUT = Path(__file__).with_name("held_out.yaml")
A = TypeVar("A")


def kind_of(seed: int, number: int) -> str:
    """Kind of a case; of three in a row from a multiple of three one has something in it."""
    triple, place = divmod(number, 3)
    hidden = int(np.random.default_rng([seed, 1, triple]).integers(3))
    if place == hidden:
        return dealt(_cards(HIDDEN), seed, 2, triple)
    return dealt(_cards(EMPTY), seed, 3, 2 * triple + place - (place > hidden))


def setting_of(seed: int, number: int) -> str:
    """Setting of a case; those with something in them and those without are dealt apart."""
    kind = kind_of(seed, number)
    deck, group = (4, HIDDEN) if kind in HIDDEN else (5, EMPTY)
    return dealt(_cards(SETTINGS), seed, deck, _turn(seed, number, tuple(group)))


def name_of(seed: int, number: int, names: Sequence[str]) -> str:
    """Effect of a case, so that each has its turn before any comes again; of each kind of case by itself."""
    kind = kind_of(seed, number)
    return dealt(sorted(names), seed, 6 + list(HIDDEN).index(kind), _turn(seed, number, (kind,)))


def nominal_of(model: str, setting: str, duration: float) -> Scenario:
    """The nominal scenario of a setting.

    Raises
    ------
    InputError : the model cannot be read; its line is too short for another section.
    """
    if setting == "line":
        return load_scenario(HELD_OUT, {"duration": duration})
    home = load_scenario(model, {"duration": duration})
    if setting == "section":
        last = float(home.geometry.s[-1]) - home.overhang[1] - (home.distance or 0.0) - SPARE
        return load_scenario(model, {"duration": duration, "start": max(home.start, round(last, 1))})
    if setting == "speed" and isinstance(home.speed, Constant):
        return load_scenario(model, {"duration": duration, "speed.speed": SLOWER * home.speed.speed})
    return home


def dealt(cards: Sequence[A], seed: int, deck: int, turn: int) -> A:
    """The card of a turn; the deck is shuffled anew each time that it is through."""
    order = np.random.default_rng([seed, 100 + deck, turn // len(cards)]).permutation(len(cards))
    return cards[int(order[turn % len(cards)])]


def _cards(shares: dict[str, int]) -> list[str]:
    return [kind for kind, count in shares.items() for _ in range(count)]


@cache
def _turn(seed: int, number: int, kinds: tuple[str, ...]) -> int:
    """How many cases of these kinds came before."""
    return sum(kind_of(seed, earlier) in kinds for earlier in range(number))
