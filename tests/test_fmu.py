"""The co-simulation unit, run back by FMPy, against our own channels."""

import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from railsim import InputError, Scenario, load_scenario, measure
from railsim.fmu import export_unit
from railsim.measurements import Measurements
from railsim.simulation import simulate_held
from railsim.truth import Truth

DURATION = 2.0
RATE = "bogie.rate_pitch"
COUNTER = "wheelset1.wheel_speed"
ROUNDING = 1e-9  # of the largest value: kernels are compiled once more in another process


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    """Two seconds of the default run."""
    return load_scenario("default", {"duration": DURATION})


@pytest.fixture(scope="module")
def unit(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The unit of it."""
    path = tmp_path_factory.mktemp("unit") / "default.fmu"
    export_unit(scenario, path)
    return path


def ours(scenario: Scenario) -> tuple[Truth, Measurements]:
    """The same run by our own functions."""
    truth = simulate_held(scenario, "compiled")
    return truth, measure(truth, scenario).measurements


def test_the_unit_is_valid_and_names_every_channel(unit: Path, scenario: Scenario):
    assert validate_fmu(str(unit)) == []
    with zipfile.ZipFile(unit) as packed:
        described = ElementTree.fromstring(packed.read("modelDescription.xml"))
    assert described.get("fmiVersion") == "3.0"
    assert described.find("CoSimulation") is not None
    outputs = {one.get("name"): one.get("description") for one in described.iter("Float64")}
    for sensor in scenario.sensors:
        for channel in sensor.channels():
            name, _, rest = channel.rpartition(" [")
            assert outputs[name] == f"in {rest[:-1]}"


def test_channels_are_ours(unit: Path, scenario: Scenario):
    given = simulate_fmu(str(unit), stop_time=DURATION, output_interval=1 / 256, output=[RATE, "truth.bogie.roll"])
    truth, measured = ours(scenario)
    rate = measured[f"{RATE} [rad/s]"][1 : int(DURATION * 256)]
    roll = np.interp(given["time"], truth.time, truth["bogie.roll [rad]"])
    rows = slice(1, int(DURATION * 256))  # the first values are asked for before the run
    assert np.ptp(rate) > 1e-3
    assert np.max(np.abs(given[RATE][rows] - rate)) <= ROUNDING * np.max(np.abs(rate))
    assert np.max(np.abs(given["truth.bogie.roll"] - roll)) <= ROUNDING * np.max(np.abs(roll))


def test_a_channel_holds_its_last_sample_whatever_the_steps(unit: Path, scenario: Scenario):
    given = simulate_fmu(str(unit), stop_time=1.0, output_interval=0.01, output=[COUNTER])
    _, measured = ours(scenario)
    name = next(name for name in measured if name.startswith(COUNTER))
    time = measured.time(name)
    for place in range(1, len(given)):
        last = np.flatnonzero(time <= given["time"][place] + 1e-9)[-1]
        assert given[COUNTER][place] == pytest.approx(measured[name][last], rel=ROUNDING)


def test_parameters_change_vehicle_and_noise(unit: Path, scenario: Scenario):
    changes = {"seed": 7, "vehicle.body_mass": 15000.0}
    given = simulate_fmu(str(unit), stop_time=1.0, output_interval=1 / 256, start_values=changes, output=[RATE])
    heavy = scenario.but(seed=7, vehicle=scenario.vehicle.but(body_mass=15000.0))
    _, measured = ours(heavy)
    _, before = ours(scenario)
    rate = measured[f"{RATE} [rad/s]"][1:256]
    assert np.max(np.abs(given[RATE][1:256] - rate)) <= ROUNDING * np.max(np.abs(rate))
    assert np.max(np.abs(before[f"{RATE} [rad/s]"][1:256] - rate)) > 1e-5


def test_a_unit_is_not_lost_and_has_its_ending(unit: Path, scenario: Scenario, tmp_path: Path):
    with pytest.raises(InputError, match="is there already"):
        export_unit(scenario, unit)
    with pytest.raises(InputError, match=r"does not end in \.fmu"):
        export_unit(scenario, tmp_path / "unit.zip")
