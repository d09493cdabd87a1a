"""Vehicle, track, contact, engines, sensors: everything that describes and makes a run.

`from railsim import load_scenario, simulate, measure`: these names are looked up when they are first used, so that
importing a small part stays quick.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from railsim.errors import InputError
    from railsim.many import simulate_many
    from railsim.recording import Recording
    from railsim.scenario import Scenario, load_scenario
    from railsim.simulation import measure, simulate
    from railsim.truth import Truth

    __version__: str

__all__ = ["InputError", "Recording", "Scenario", "Truth", "load_scenario", "measure", "simulate", "simulate_many"]

_HOMES = {"errors": ["InputError"], "recording": ["Recording"], "scenario": ["Scenario", "load_scenario"]} | {
    "many": ["simulate_many"],
    "simulation": ["measure", "simulate"],
    "truth": ["Truth"],
}


def __getattr__(name: str) -> Any:
    """Import one of `__all__` from the module that defines it; `__version__` is looked up too."""
    if name == "__version__":
        return import_module("railsim.distribution").version()
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"railsim.{module}"), name)
    raise AttributeError(f"module 'railsim' has no attribute '{name}'")
