"""A channel that fails for a while: the same estimate, to the byte, as from a recording without it in that time."""

from functools import lru_cache

import numpy as np
import pytest

from estimators.adhesion.adhesion_creep_forces import AdhesionCreepForces
from estimators.adhesion.adhesion_creep_forces_profile import AdhesionCreepForcesProfile
from estimators.adhesion.adhesion_level import AdhesionLevel
from estimators.interface import Estimator
from estimators.signals.channel_health import GUARD
from estimators.suspension.suspension_ekf import SuspensionEkf
from estimators.suspension.suspension_ml import SuspensionMl
from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.suspension_ukf import SuspensionUkf
from experiments.runs.adhesion import run, scenario, sensors
from railsim.measurements import Measurements
from tests.estimators.suspension_rig import recording

SECONDS = 12.0
SUSPENSION: dict[str, Estimator] = {
    "rbpf": SuspensionRbpf(particles=50, keep_every=4),
    "ml": SuspensionMl(keep_every=4, starts=4),
    "ekf": SuspensionEkf(keep_every=4, every=2),
    "ukf": SuspensionUkf(keep_every=4, every=4),
}
ADHESION: dict[str, Estimator] = {
    "creep_forces": AdhesionCreepForces(),
    "creep_forces_profile": AdhesionCreepForcesProfile(),
    "level": AdhesionLevel(hop=1.0),
}
FAULTS = ("lost", "stuck", "saturated", "partly saturated")
CHANNEL = "wheelset2.acceleration_y [m/s2]"


@lru_cache(maxsize=2)
def measured(kind: str) -> Measurements:
    """Twelve seconds of the suspension's scenario, or with the sensors of the adhesion estimators."""
    if kind in SUSPENSION:
        return recording(SECONDS).measurements
    settings = {"track": "straight_erri_low", "vehicle": {"name": "class175", "adhesion": "dry"}}
    return run(scenario(settings, 30.0, SECONDS, sensors()), 3)[1]


def replaced(given: Measurements, values: np.ndarray | None, limit: float | None = None) -> Measurements:
    """The same recording with other samples of a channel, or without it, and another range in its data sheet."""
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in given:
        table = tables.setdefault(given.rate(name), {"time [s]": given.time(name)})
        if name != CHANNEL or values is not None:
            table[name] = values if name == CHANNEL and values is not None else given[name]
    about = given.about
    if limit is not None:
        sheets = [
            {**one, "errors": {**one["errors"], "range": limit}} if CHANNEL in one.get("channels", ()) else one
            for one in about["sensors"]
        ]
        about = {**about, "sensors": sheets}
    return Measurements(about, tables, given.track)


def faulty(given: Measurements, fault: str) -> tuple[Measurements, Measurements]:
    """A recording with a fault of an accelerometer, and one in which these samples, or all, are not there."""
    values, time = given[CHANNEL].copy(), given.time(CHANNEL)
    bad, limit = (time >= 5.0) & (time < 6.5), None
    if fault == "lost":
        return replaced(given, np.full(len(values), np.nan)), replaced(given, None)
    if fault == "stuck":
        values[bad] = 0.1234
    elif fault == "saturated":
        values[bad] = float(given.sensor(CHANNEL)["errors"]["range"]) * (1.0 + 1e-6 * np.arange(bad.sum()))
    else:
        limit = 0.85 * float(np.abs(values).max())
        values = np.clip(values, -limit, limit)
        bad = np.abs(values) >= limit
        assert 1 < bad.sum() < 0.05 * len(bad)
    if "saturated" in fault:  # the sensor's own filter shows it a little before and after
        bad = np.convolve(bad, np.ones(2 * round(GUARD * given.rate(CHANNEL)) + 1), mode="same") > 0.5
    return replaced(given, values, limit), replaced(given, np.where(bad, np.nan, values), limit)


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("kind", [one for one in (*SUSPENSION, *ADHESION) if one != "ukf"])
def test_a_fault_is_worth_as_much_as_nothing(kind: str, fault: str):
    estimator = {**SUSPENSION, **ADHESION}[kind]
    bad, absent = (estimator.estimate(one) for one in faulty(measured(kind), fault))
    assert bad.series.to_numpy(float).tobytes() == absent.series.to_numpy(float).tobytes()
    said = {entry["reason"] for entry in bad.about["left_out"] if entry["channel"] == CHANNEL}
    assert said - {"settling after that"} == {fault.rpartition(" ")[2]}
    assert any(CHANNEL in line for line in bad.about["warnings"])


@pytest.mark.parametrize("kind", ["rbpf", "ekf", "creep_forces", "level"])
def test_rows_that_are_missing_are_said_and_change_nothing_before_them(kind: str):
    given, estimator = measured(kind), {**SUSPENSION, **ADHESION}[kind]
    fast = max(given.rate(name) for name in given)
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in given:
        rate, time = given.rate(name), given.time(name)
        kept = (time < 10.8) | (time >= 11.0) | (rate != fast)
        tables.setdefault(rate, {"time [s]": time[kept]})[name] = given[name][kept]
    found = estimator.estimate(Measurements(given.about, tables, given.track))
    whole = estimator.estimate(given).series
    before = [series[series["time [s]"] < 9.5 - 5.0 * (kind == "level")] for series in (found.series, whole)]
    if kind == "creep_forces":  # sizes of what is unknown are those of the whole record, and it is smoothed
        columns = [name for name in before[1] if "_std" not in name and name != "time [s]" and name != "valid [-]"]
        for name in columns:
            std = before[1][name.replace(" [", "_std [")]
            assert np.nanmax(np.abs(before[0][name] - before[1][name]) / std) < 0.25
    else:
        assert before[0].equals(before[1])
    (entry,) = [one for one in found.about["left_out"] if one["channel"] == CHANNEL and one["reason"] == "missing"]
    assert (entry["start [s]"], entry["end [s]"]) == pytest.approx((10.8, 11.0), abs=0.01)


def test_the_unscented_filter_leaves_a_stuck_channel_out():
    bad, absent = (SUSPENSION["ukf"].estimate(one).series.to_numpy() for one in faulty(measured("ukf"), "stuck"))
    assert bad.tobytes() == absent.tobytes()


def test_gaps_do_not_spoil_what_comes_after_them():
    """The band-pass remembers what stood in a gap; gaps of the body's channel made a quarter of the yaw damping."""
    given = recording(20.0).measurements
    name = "body.acceleration_y [m/s2]"
    estimator = SuspensionMl(keep_every=4, wheelset_sensors=False, starts=8)
    time = given.time(name)
    tables: dict[float, dict[str, np.ndarray]] = {}
    for one in given:
        gap = (one == name) & (np.mod(time, 6.0) < 1.0) if len(given[one]) == len(time) else False
        table = tables.setdefault(given.rate(one), {"time [s]": given.time(one)})
        table[one] = np.where(gap, np.nan, given[one])
    whole = estimator.estimate(given).series.iloc[-1]
    broken = estimator.estimate(Measurements(given.about, tables, given.track)).series.iloc[-1]
    damping = "secondary_yaw_damping [N m s/rad]"
    assert broken[damping] == pytest.approx(whole[damping], rel=0.1)
