"""Creep forces on whole vehicles: all four wheelsets, parameters that nobody knows, an independent simulator."""

import lzma
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.adhesion.adhesion_creep_forces import AdhesionCreepForces
from estimators.adhesion.bogie_place import HALF, places
from estimators.adhesion.channels import high_pass, read
from estimators.adhesion.creep_model import ROLL_BODIES, Shaping, floating, parameters
from estimators.adhesion.force_budget import LEVER, PAYLOAD, budgeted
from experiments.runs.adhesion import run, scenario, sensors
from experiments.scoring.creep_forces import true_forces
from experiments.scoring.score import score
from experiments.validation import reference
from railsim.field.importing import import_file
from railsim.measurements import Measurements
from railsim.recording import Recording
from railsim.truth import Truth
from railsim.vehicles.class175_whole import Class175Whole

VEHICLE = Class175Whole()
APART = 8.0
SETTINGS = {"track": "straight_erri_low", "vehicle": {"name": "class175_whole"}, "start": 60.0}
FAULTY = {"yaw_damper_damping": 0.0, "payload": {"mass": 10000.0}}


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> tuple[Truth, Measurements]:
    """Twenty seconds without yaw dampers and with ten tonnes aboard, which the recording does not know."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAILSIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        suite = sensors("industrial", apart=APART)
        real = {**SETTINGS, "vehicle": {**SETTINGS["vehicle"], **FAULTY}}
        return run(scenario(real, 30.0, 20.0, suite), 5, stated=scenario(SETTINGS, 30.0, 20.0, suite))


def without(measured: Measurements, *bodies: str) -> Measurements:
    """The recording without some sensors, by their names."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in measured.channels:
        if name.partition(".")[0] not in bodies:
            tables.setdefault(measured.rate(name), {"time [s]": measured.time(name)})[name] = measured[name]
    return Measurements(measured.about, tables)


def test_forces_of_all_four_wheelsets_within_what_is_stated(faulty: tuple[Truth, Measurements]):
    truth, measured = faulty
    found = score(AdhesionCreepForces().estimate(measured), truth)
    for number in (1, 2, 3, 4):
        for what in ("lateral force", "yaw moment"):
            assert found[f"wheelset{number} {what} rms error over load [-]"] < 0.015
            assert found[f"wheelset{number} {what} within 2 std [-]"] >= 0.85
        true = true_forces(truth, number)
        net = high_pass(true["creep"] + true["gravity"], 0.3, rate=truth.rate)
        assert found[f"wheelset{number} lateral force rms error, gravity's included [N]"] < 0.7 * np.std(net)


def test_a_bogie_whose_wheelsets_bear_no_sensors_has_no_columns(faulty: tuple[Truth, Measurements]):
    series = AdhesionCreepForces().estimate(without(faulty[1], "wheelset4")).series
    assert "wheelset2.lateral_creep_force [N]" in series.columns
    assert not [name for name in series.columns if name.startswith(("wheelset3", "wheelset4"))]


def test_the_leading_bogie_is_as_if_there_was_no_other(faulty: tuple[Truth, Measurements]):
    measured = faulty[1]
    whole = AdhesionCreepForces().estimate(measured).series
    alone = AdhesionCreepForces().estimate(without(measured, "wheelset3", "wheelset4", "bogie2", "body_rear")).series
    assert whole[alone.columns].equals(alone)


def test_a_sensor_of_the_body_counts_for_the_bogie_below_it(faulty: tuple[Truth, Measurements]):
    measured = faulty[1]
    leading, trailing = places(measured.vehicle)
    assert leading.channels(measured, "body", "acceleration_y") == ["body.acceleration_y [m/s2]"]
    assert trailing.channels(measured, "body", "acceleration_y") == ["body_rear.acceleration_y [m/s2]"]
    assert trailing.column("wheelset1.yaw_rate [rad/s]") == "wheelset3.yaw_rate [rad/s]"
    assert places({}) == (HALF,)


def test_budget_is_of_what_was_measured(faulty: tuple[Truth, Measurements]):
    """A yaw damper that may be gone: its nominal moment at the measured yaw rate; the body: its share of m a."""
    measured = faulty[1]
    p = parameters(measured.vehicle)
    good = {name: np.isfinite(measured[name]) for name in measured}
    record = read(measured, ROLL_BODIES, good, 0.3, "tachometer", places(measured.vehicle)[0])
    found = budgeted(measured.vehicle | p, record, Shaping(), lever=0.0)
    _, body, turning, *primary = found.others
    rate = record.samples[:, record.names.index("bogie.rate_yaw [rad/s]")]
    nominal = 2.0 * VEHICLE.yaw_damper_damping * VEHICLE.yaw_damper_half_spacing**2 * np.sqrt(np.mean(rate**2))
    assert turning.std == pytest.approx(nominal, rel=0.01)
    acceleration = record.samples[:, record.names.index("body.acceleration_y [m/s2]")]
    gyration = VEHICLE.body_yaw_inertia / (VEHICLE.body_mass * APART**2)
    share = np.sqrt(2.0 * ((1.0 - gyration) / (1.0 + gyration)) ** 2 + PAYLOAD**2)
    assert body.std == pytest.approx(share * VEHICLE.body_mass / 2.0 * np.sqrt(np.mean(acceleration**2)), rel=0.01)
    assert len(floating(p, 256.0, found).A) == len(floating(p, 256.0, Shaping()).A) + len(found.others)
    unknown_arm = budgeted(measured.vehicle | p, record, Shaping())
    assert unknown_arm.others[4].std == pytest.approx(np.hypot(primary[1].std, LEVER * found.force))


REFERENCE = reference.folder() / "whole_vehicle"


def imported(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Measurements:
    """A recording of the independent simulator, whose table is packed."""
    for one in ("wheel.txt", "rail.txt", "track.csv", f"{name}.map.yaml"):
        shutil.copy(REFERENCE / one, folder / one)
    (folder / f"{name}.csv").write_bytes(lzma.decompress((REFERENCE / f"{name}.csv.xz").read_bytes()))
    monkeypatch.chdir(folder)  # the map names files beside it
    import_file(folder / f"{name}.csv", folder / f"{name}.map.yaml", folder / "recording")
    return Recording.open(folder / "recording").measurements


@pytest.mark.skipif(not REFERENCE.exists(), reason="the independent recordings are not here")
@pytest.mark.parametrize("name", ["healthy_80kmh", "no_yaw_dampers_120kmh"])
def test_moments_of_an_independent_simulator_are_within_what_is_stated(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    measured = imported(name, tmp_path, monkeypatch)
    truth = pd.read_parquet(REFERENCE / f"{name}_truth.parquet")
    series = AdhesionCreepForces().estimate(measured).series
    series = series[series["valid [-]"] > 0.5]
    for number, which in ((1, "leading"), (2, "trailing")):
        left, right = (truth[f"front_{which}_wheelset.{side}.creep_force_x [N]"] for side in ("left", "right"))
        moment = high_pass(-0.75 * (left - right).to_numpy(), 0.3, rate=128.0)
        true = np.interp(series["time [s]"], truth["time [s]"], moment)
        error = series[f"wheelset{number}.creep_yaw_moment [N m]"] - true
        within = np.abs(error) <= 2.0 * series[f"wheelset{number}.creep_yaw_moment_std [N m]"]
        assert within.mean() >= 0.8
