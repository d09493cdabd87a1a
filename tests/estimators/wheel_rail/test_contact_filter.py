"""Conicity filters on the nonlinear wheelset: sample by sample as on the record, with and without the track."""

import numpy as np
import pytest
from scipy.linalg import expm

from estimators.vehicle import single_wheelset as wheelset
from estimators.wheel_rail import contact_filter as kernels
from estimators.wheel_rail.conicity_ekf import ConicityEkf
from estimators.wheel_rail.conicity_ekf_table import ConicityEkfTable
from estimators.wheel_rail.conicity_ekf_track import ConicityEkfTrack
from estimators.wheel_rail.contact_run import NAMES, SPEED, ContactEstimator, read
from experiments.scoring.wheel_rail_truth import ContactTruth, contact_truth
from railsim import load_scenario, measure, simulate
from railsim.measurements import Measurements

DURATION, SETTLED = 30.0, 10.0


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Measurements, ContactTruth]:
    """New S1002 wheels at 30 m/s."""
    scenario = load_scenario("wheelset_new", {"duration": DURATION})
    truth = simulate(scenario, "compiled", tmp_path_factory.mktemp("truth") / "run")
    return measure(truth, scenario, seed=5).measurements, contact_truth(truth)


def settled(estimator: ContactEstimator, measured: Measurements) -> float:
    """Mean conicity after the first seconds."""
    series = estimator.estimate(measured).series
    return float(np.mean(series["conicity [-]"].to_numpy()[series["time [s]"].to_numpy() > SETTLED]))


def test_filters_with_track_and_table_converge(run: tuple[Measurements, ContactTruth]) -> None:
    measured, true = run
    conicity = float(true.half_difference @ true.shift / (true.shift @ true.shift))
    for kind in (ConicityEkfTrack, ConicityEkfTable):
        assert settled(kind(), measured) == pytest.approx(conicity, rel=0.3)


def test_plain_filter_takes_the_whole_movement_for_shift_on_the_rails(run: tuple[Measurements, ContactTruth]) -> None:
    measured, true = run

    def error(kind: type[ContactEstimator]) -> float:
        series = kind().estimate(measured).series
        time = series["time [s]"].to_numpy()
        wrong = series["wheelset1.lateral_shift [m]"].to_numpy() - np.interp(time, true.time, true.shift)
        return float(np.std(wrong[time > SETTLED]))

    assert error(ConicityEkf) > 1.2 * error(ConicityEkfTrack)
    assert not ConicityEkf().estimate(measured).series["track_lateral [m]"].to_numpy().any()


def test_wrong_start_is_forgotten(run: tuple[Measurements, ContactTruth]) -> None:
    measured, _ = run
    about = {**measured.about, "vehicle": {**measured.vehicle, "design_conicity": 0.4}}
    tables = {256.0: {"time [s]": measured.time(NAMES[2]), **{n: measured[n] for n in NAMES if n in measured}}}
    tables[measured.rate(SPEED)] = {"time [s]": measured.time(SPEED), SPEED: measured[SPEED]}
    rate = measured.vehicle["design_contact_angle_rate"] * 0.4 / measured.vehicle["design_conicity"]
    about["vehicle"]["design_contact_angle_rate"] = rate
    other = Measurements(about, tables)
    assert settled(ConicityEkfTrack(), other) == pytest.approx(settled(ConicityEkfTrack(), measured), rel=0.1)


@pytest.mark.parametrize("kind", [ConicityEkf, ConicityEkfTrack, ConicityEkfTable])
def test_online_gives_the_numbers_of_the_record(
    kind: type[ContactEstimator], run: tuple[Measurements, ContactTruth]
) -> None:
    measured, _ = run
    whole = kind().estimate(measured).series.iloc[:500]
    grid = read(measured)
    online = kind().online(measured.about, grid.rate)
    speeds = dict(zip(measured.time(SPEED), measured[SPEED], strict=True))
    rows = [
        online.step({"time [s]": time, SPEED: speeds.get(time, np.nan), **dict(zip(NAMES, sample, strict=True))})
        for time, sample in zip(grid.time[:500], grid.samples[:500], strict=True)
    ]
    for name in ("conicity [-]", "conicity_std [-]", "track_lateral [m]"):
        np.testing.assert_array_equal([row[name] for row in rows], whole[name])


def test_lost_samples_are_bridged(run: tuple[Measurements, ContactTruth]) -> None:
    measured, _ = run
    grid = read(measured)
    samples = grid.samples.copy()
    samples[2000:2500, 0] = np.nan
    samples[4000:4256] = np.nan
    whole = ConicityEkfTrack().online(measured.about, grid.rate).advance(grid.speeds, grid.samples)
    holed = ConicityEkfTrack().online(measured.about, grid.rate).advance(grid.speeds, samples)
    assert np.isfinite(holed[:, 0]).all()
    assert holed[-1, 0] == pytest.approx(whole[-1, 0], rel=0.1)
    assert holed[4255, 4] > whole[4255, 4]


def test_step_in_time_is_that_of_the_linear_equations() -> None:
    """Trapezoidal steps of 1/1024 s against the matrix exponential, a cone on straight track."""
    vehicle = load_scenario("wheelset_new").vehicle.nominal()
    run = ConicityEkfTrack(track_std=0.0).online({"vehicle": vehicle, "sensors": []}, 1024.0)
    model = wheelset.wheelset_model(vehicle)
    a, _ = wheelset.linear(model, model.conicity, 30.0)
    start = np.array([1e-3, 30.0 * 5e-4, 5e-4, 0.0, 2e-3, 0.0])
    c = model.numbers
    start[3] = -2.0 * c.l * c.f11 / c.r0 * model.conicity * 1e-3 / (2.0 * c.l**2 * c.f11 / 30.0)
    run.memory.mean[:6] = start
    for _ in range(256):
        kernels.predict(run.settings, run.memory, 30.0)
    expected = expm(a * 0.25) @ start
    np.testing.assert_allclose(run.memory.mean[:6], expected, atol=2e-3 * np.abs(expected).max())
    covariance = run.memory.covariance
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-12)
    assert np.linalg.eigvalsh(covariance).min() > -1e-12
