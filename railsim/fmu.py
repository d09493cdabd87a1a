"""A scenario as an FMI 3.0 co-simulation unit: vehicle and sensors for other simulation programs.

The unit needs Python with railsim where it runs. It has no inputs, so that the whole run is known once its parameters
are: it is simulated by the compiled engine when initialization ends, and each step gives out what has been measured
until then. A sensor's channel holds its last sample; a channel of the truth is interpolated linearly.
"""

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.files import new_file
from railsim.scenario import Scenario, load_scenario
from railsim.scratch import scratch_folder
from railsim.simulation import measure, simulate_held
from railsim.track.files import write_track

ENGINE = "compiled"
SCENARIO = "scenario.yaml"
TRACK = "track.csv"
TRUTH = "truth."
"""Begins the names of channels of the truth."""
MODEL = "RailsimUnit"
_CHANNEL = re.compile(r"(.+) \[([^\[\]]+)\]")
_EXACT = 1e-9  # s; how far rounding may put a time before its sample
_SCRIPT = '''"""Unit that railsim wrote; it needs Python with railsim, numpy and what these need."""

from pathlib import Path

from pythonfmu3 import DefaultExperiment, Float64, Fmi3Causality, Fmi3Initial, Fmi3Slave, Fmi3Variability, Int32
from railsim.fmu import Channels


class @MODEL@(Fmi3Slave):
    """Vehicle and sensors of a scenario."""

    def __init__(self, **given):
        super().__init__(**given)
        folder = Path(self.resources or Path(__file__).parent)
        self.channels = Channels(folder)
        self.description = self.channels.scenario.description
        self.default_experiment = DefaultExperiment(0.0, self.channels.scenario.duration, self.channels.step)
        self.clock = 0.0
        fixed = {"causality": Fmi3Causality.parameter, "variability": Fmi3Variability.fixed}
        clock = {"causality": Fmi3Causality.independent, "variability": Fmi3Variability.continuous}
        self.register_variable(Float64("time", getter=lambda: self.clock, **clock))
        for name, unit in self.channels.parameters.items():
            kind = Int32 if name == "seed" else Float64
            more = {} if name == "seed" else {"description": f"in {unit}"}
            self.register_variable(kind(name, getter=self._getter(name), setter=self._setter(name), **fixed, **more))
        for name, unit in self.channels.units.items():
            output = {"causality": Fmi3Causality.output, "initial": Fmi3Initial.calculated}
            self.register_variable(Float64(name, description=f"in {unit}", getter=self._output(name), **output))

    def _getter(self, name):
        return lambda: self.channels.values[name]

    def _setter(self, name):
        return lambda value: self.channels.change(name, value)

    def _output(self, name):
        return lambda: self.channels.value(name, self.clock)

    def exit_initialization_mode(self):
        self.channels.run()

    def do_step(self, current_time, step_size):
        self.clock = current_time + step_size
        return True
'''


class Channels:
    """What the unit gives out, from the scenario in its folder of resources.

    Attributes
    ----------
    scenario : as it is stored. units : of each output, SI, by its name without the unit.
    parameters : unit of each number that may be changed before the run: the seed, and the vehicle's own numbers as
        "vehicle.body_mass". values : of the parameters.
    step : s, of the fastest sensor.
    """

    def __init__(self, folder: Path | str) -> None:
        self.scenario = load_scenario(Path(folder) / SCENARIO, {"track": str(Path(folder) / TRACK)})
        vehicle = self.scenario.vehicle
        numbers = {name: value for name, value in vehicle.nominal().items() if isinstance(value, float)}
        numbers = {name: value for name, value in numbers.items() if name in type(vehicle).model_fields}
        self.values: dict[str, Any] = {"seed": self.scenario.seed}
        self.values |= {f"vehicle.{name}": value for name, value in numbers.items()}
        self.parameters = {"seed": "-"} | {f"vehicle.{name}": vehicle.about(name)[0] for name in numbers}
        self.step = 1.0 / max([sensor.rate for sensor in self.scenario.sensors] or [self.scenario.output_rate])
        self._changed: dict[str, Any] = {}
        self._measured: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self._truth: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self.units = dict(map(_split, self._names()))

    def change(self, name: str, value: Any) -> None:
        """Set a parameter; it holds for the next `run`."""
        self.values[name] = self._changed[name] = value

    def run(self) -> None:
        """Simulate and measure with the parameters as they are.

        Raises
        ------
        InputError : a parameter is out of bounds, or the run leaves track or rails.
        """
        scenario = self._as_changed()
        truth = simulate_held(scenario, ENGINE)
        measured = measure(truth, scenario).measurements
        self._measured = {_split(name)[0]: (measured.time(name), measured[name]) for name in measured}
        self._truth = {TRUTH + _split(name)[0]: (truth.time, truth[name]) for name in truth.columns[1:]}

    def value(self, name: str, time: float) -> float:
        """Output `name` at `time` [s]; NaN before the run, and where a sensor lost the sample."""
        if name in self._measured:
            stamps, values = self._measured[name]
            place = int(np.searchsorted(stamps, time + _EXACT, side="right")) - 1
            return float(values[place]) if place >= 0 else np.nan
        if name in self._truth:
            stamps, values = self._truth[name]
            return float(np.interp(time, stamps, values))
        return np.nan

    def _as_changed(self) -> Scenario:
        vehicle = {name.partition(".")[2]: value for name, value in self._changed.items() if name != "seed"}
        changes: dict[str, Any] = {"seed": int(self.values["seed"])}
        if vehicle:
            changes["vehicle"] = self.scenario.vehicle.but(**vehicle)
        return self.scenario.but(**changes)

    def _names(self) -> list[str]:
        from railsim.dynamics.channels import channel_names

        true = [TRUTH + name for name in channel_names(self.scenario.model)[1:]]
        return [name for sensor in self.scenario.sensors for name in sensor.channels()] + true


def export_unit(scenario: Scenario, path: Path, overwrite: bool = False) -> Mapping[str, str]:
    """Write a unit (.fmu) of the scenario; returns its outputs with their units.

    Raises
    ------
    InputError : the exporter is not installed, the file is there already or does not end in .fmu, or it cannot be
        written.
    """
    try:
        from pythonfmu3 import FmuBuilder
    except ImportError:
        raise InputError("a unit needs the package 'pythonfmu3'; install railsim with the extra 'fmu'") from None
    if path.suffix != ".fmu":
        raise InputError(f"'{path}' does not end in .fmu; name the file so")
    if path.exists() and not overwrite:
        raise InputError(f"'{path}' is there already; name another file, or add --overwrite")
    with scratch_folder("railsim-unit") as scratch:
        folder = Path(scratch)
        resources = [folder / SCENARIO, folder / TRACK]
        resources[0].write_text(scenario.to_yaml(track=TRACK), encoding="utf-8")
        write_track(scenario.geometry, resources[1])
        channels = Channels(folder)
        script = folder / "railsim_unit.py"
        script.write_text(_SCRIPT.replace("@MODEL@", MODEL), encoding="utf-8")
        built = FmuBuilder.build_FMU(script, folder / "built", resources, canHandleVariableCommunicationStepSize=True)
        with new_file(path) as aside:
            shutil.copyfile(built, aside)
    return channels.units


def _split(name: str) -> tuple[str, str]:
    """Name and unit of "name [unit]"."""
    found = _CHANNEL.fullmatch(name)
    return (found[1], found[2]) if found else (name, "-")
