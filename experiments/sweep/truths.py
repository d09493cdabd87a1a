"""The simulated runs that a group of tasks needs, asked for at once: the one place where a sweep simulates.

They stay in memory from the run to its last score, unless they are kept in the cache or are large.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.reporting.failures import PluginError, plugin_code
from railsim.cache import cache_folder
from railsim.errors import InputError
from railsim.lanes.machine import LANES
from railsim.many import ENGINE, simulate_many
from railsim.scenario import Scenario
from railsim.simulation import simulate, simulate_held, truth_bytes
from railsim.truth import Truth

MOST_HELD = 512e6  # bytes; a larger run goes to the disk, and its columns are read one by one
MOST_TOGETHER = 1.6e9  # bytes of runs that are held side by side


@dataclass(frozen=True)
class Wanted:
    """A run that is asked for: its scenario, engine and digest; `aside`: an empty folder of its own for a large one."""

    scenario: Scenario
    engine: str
    run: str
    aside: Path


def truths(wanted: Sequence[Wanted], keep: bool) -> Iterator[Truth | InputError | PluginError]:
    """The runs one after the other in their order, or in place of one why there is none.

    keep : leave them in the cache.

    Raises
    ------
    OSError, MemoryError : of this machine, which ends the sweep.
    """
    side_by_side = [] if keep else [one for one in wanted if _fits_lanes(one)]
    held: dict[str, Truth | InputError | PluginError] = {}
    for one in wanted:
        if side_by_side and one is side_by_side[0]:
            held = _together(side_by_side[:LANES])
            del side_by_side[:LANES]
        yield held.pop(one.run) if one.run in held else _alone(one, keep)


def _alone(wanted: Wanted, keep: bool) -> Truth | InputError | PluginError:
    try:
        with plugin_code("the run"):
            return _truth(wanted, keep)
    except (InputError, PluginError) as error:
        return error


def _fits_lanes(wanted: Wanted) -> bool:
    """Whether a run is for lanes, small enough to be held with others, and not in the cache."""
    small = wanted.engine == ENGINE and truth_bytes(wanted.scenario) <= MOST_TOGETHER / LANES
    return small and not (cache_folder() / wanted.run).is_dir()


def _together(wanted: Sequence[Wanted]) -> dict[str, Truth | InputError | PluginError]:
    """Runs side by side in lanes, by digest; one by one where a plug-in fails, to know which."""
    try:
        with plugin_code("the run"):
            done = dict(simulate_many(one.scenario for one in wanted))
    except PluginError:
        return {one.run: _alone(one, keep=False) for one in wanted}
    return {one.run: done[number] for number, one in enumerate(wanted)}


def _truth(wanted: Wanted, keep: bool) -> Truth:
    """From the cache where that has it or shall keep it; else made in memory, or aside where it is large."""
    if keep or (cache_folder() / wanted.run).is_dir():
        return simulate(wanted.scenario, wanted.engine)
    if truth_bytes(wanted.scenario) > MOST_HELD:
        return simulate(wanted.scenario, wanted.engine, folder=wanted.aside / "truth")
    return simulate_held(wanted.scenario, wanted.engine)
