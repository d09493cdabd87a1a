"""Every plug-in that is found conforms: the checks of `railsim check`, and that these find what falls short."""

import json
import textwrap
from pathlib import Path

import pytest

from experiments.cli import main
from experiments.conformance.interface import fields_with_unit_and_source
from experiments.conformance.plugins import Subject, everything, subjects
from railsim import load_scenario
from railsim.scenario import Scenario
from railsim.sensors.errors import SensorErrors
from railsim.spec import Spec
from railsim.track.survey import TrackErrors

ELSEWHERE = {"figures"}
"""Kinds whose checks are another test's: tests/experiments/figures and tests/golden compute each once."""
KNOWN: dict[tuple[str, str], set[str]] = {}
"""What falls short and is known to."""


@pytest.mark.parametrize("subject", everything(), ids=lambda one: f"{one.kind}-{one.name}")
def test_plugin_conforms(subject: Subject):
    checks = subject.checks[:1] if subject.kind in ELSEWHERE else subject.checks
    results = Subject(subject.kind, subject.name, subject.plugin, checks).results()
    short = {result.check: result.message for result in results if not result.ok}
    known = KNOWN.get((subject.kind, subject.name), set())
    assert {check: text for check, text in short.items() if check not in known} == {}
    assert known <= set(short), "mended: take it from KNOWN"


@pytest.mark.parametrize("kind", [Scenario, SensorErrors, TrackErrors], ids=lambda kind: kind.__name__)
def test_settings_have_unit_and_source(kind: type[Spec]):
    assert list(fields_with_unit_and_source(kind)) == []


def test_a_scenario_in_a_new_file_needs_nothing_else(tmp_path: Path):
    path = tmp_path / "mine.yaml"
    path.write_text("track: smooth\nvehicle: manchester\nspeed: {kind: constant, speed: 9}\nduration: 1\n")
    assert load_scenario(path).name == "mine"


ESTIMATOR = '''
import numpy as np
import pandas as pd

from estimators.interface import Estimate, Estimator
from railsim.spec import quantity

CALLS = []


class Careless(Estimator, frozen=True):
    """Does what no estimator may."""

    gain: float = quantity(1.0, unit="-", source="")

    requires = ("bogie.rate_pitch [rad/s]", "bogie.acceleration_z [m/s2]")

    def estimate(self, measurements):
        CALLS.append(1)
        name = self.requires[0]
        if name not in measurements:
            self.need_one(measurements)
        measurements.vehicle["bogie_mass"], measurements.vehicle["wheel_radius"]
        values = np.nan_to_num(measurements[name]) + len(CALLS)
        about = {"measured": measurements[name]}
        return Estimate(self.name, pd.DataFrame({"time [s]": measurements.time(name), "bias": values}), about)

    def need_one(self, measurements):
        from railsim.errors import InputError

        raise InputError(f"{self.requires[0]} is missing")
'''


def test_what_falls_short_of_an_estimator_is_told(tmp_path: Path):
    file = tmp_path / "careless.py"
    file.write_text(textwrap.dedent(ESTIMATOR))
    (subject,) = subjects(str(file))
    short = {result.check: result.message for result in subject.results() if not result.ok}
    told = {
        "fields with unit and source": "field 'gain' has no unit or no source",
        "units in every column": "column 'bias' has no unit",
        "about is json": "its about is not JSON",
        "pure": "gives another estimate for the same measurements",
        "lost samples": "bias: values where all samples are lost, without a mark",
        "names every missing channel": "does not name bogie.acceleration_z [m/s2], missing as well",
        "names every missing parameter": "raised KeyError: 'bogie_mass'",
    }
    assert set(short) == set(told)
    for check, text in told.items():
        assert text in short[check]


MUTE = "track: smooth\nvehicle: manchester\nspeed: {kind: constant, speed: 9}\nduration: 1\n"
HEAVY = '''"""A vehicle with passengers, in a folder that nobody has named."""

from railsim.spec import quantity
from railsim.vehicles.half_vehicle import HalfVehicle


class Heavy(HalfVehicle, frozen=True):
    """Forty passengers in each half."""

    body_mass: float = quantity(19200.0, unit="kg", source="illustrative: 40 passengers of 80 kg", gt=0.0)
'''


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("laden.yaml", "base: manchester\nbody_mass: 20000\n", ""),
        ("rough.csv", "s [m],vertical [m]\n0,0\n1,0\n2,0.5\n3,0\n4,0\n5,0\n6,0\n", "says where it is from: begin the"),
        ("mute.yaml", MUTE, "no estim"),
        ("heavy.py", HEAVY, ""),
        ("by_path.yaml", MUTE.replace("manchester", "heavy.py"), "put it into FOLDER/vehicles"),
    ],
)
def test_what_falls_short_of_a_file_is_told(
    name: str, text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / name).write_text(text)
    code = main(["check", str(tmp_path / name)])
    assert code == (1 if told else 0)
    assert told in capsys.readouterr().out


def test_a_scenario_with_the_file_of_a_vehicle_beside_it_conforms(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "scenario").mkdir()
    (tmp_path / "laden.yaml").write_text("base: manchester\nbody_mass: 20000\n")
    gyro = "sensors: [{kind: gyro, name: bogie, body: bogie, axes: [pitch], rate: 256}]\n"
    text = "description: laden\n" + MUTE.replace("manchester", "../laden.yaml") + gyro
    (tmp_path / "scenario" / "ride.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    assert main(["check", "scenario/ride.yaml"]) == 0, capsys.readouterr().out


def test_exit_codes_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["check", "smooth", "--json"]) == 0
    checks = json.loads(capsys.readouterr().out)["checks"]
    assert {row["kind"] for row in checks} == {"scenarios", "tracks"}
    assert all(set(row) == {"kind", "name", "check", "ok", "message"} and row["ok"] is True for row in checks)
    (tmp_path / "nothing.py").write_text("NUMBER = 1\n")
    for what, line in (("smoth", "did you mean 'smooth'"), (str(tmp_path / "nothing.py"), "defines no plug-in")):
        assert main(["check", what]) == 2
        assert line in capsys.readouterr().err
