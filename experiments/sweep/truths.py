"""The simulated runs that a group of tasks needs, asked for at once: the one place where a sweep simulates.

They stay in memory from the run to its last score, unless they are kept in the cache or are large.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from experiments.reporting.failures import PluginError, plugin_code
from railsim.cache import cache_folder
from railsim.errors import InputError
from railsim.scenario import Scenario
from railsim.simulation import simulate, simulate_held, truth_bytes
from railsim.truth import Truth

MOST_HELD = 512e6  # bytes; a larger run goes to the disk, and its columns are read one by one


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
    for one in wanted:
        try:
            with plugin_code("the run"):
                truth = _truth(one, keep)
        except (InputError, PluginError) as error:
            yield error
        else:
            yield truth


def _truth(wanted: Wanted, keep: bool) -> Truth:
    """From the cache where that has it or shall keep it; else made in memory, or aside where it is large."""
    if keep or (cache_folder() / wanted.run).is_dir():
        return simulate(wanted.scenario, wanted.engine)
    if truth_bytes(wanted.scenario) > MOST_HELD:
        return simulate(wanted.scenario, wanted.engine, folder=wanted.aside / "truth")
    return simulate_held(wanted.scenario, wanted.engine)
