"""Track stiffness: closed forms, the likelihood's derivatives, and records made by hand from a wheel on springs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from estimators.track.stiffness_likelihood import Likelihood
from estimators.track.stiffness_model import ROOT, Common, Springs, acceleration_over_roughness, foundation, receptance
from estimators.track.stiffness_windows import Windows, smearing, tapers
from estimators.track.track_stiffness import TrackStiffness
from estimators.vehicle.wheel_on_track import BENDING
from railsim import InputError
from railsim.measurements import TIME, Measurements

RATE, SPEED = 1024.0, 25.0
VEHICLE = {"wheelset_mass": 1400.0, "wheel_radius": 0.46, "half_gauge": 0.75, "design_wheel_load": 60e3}
COMMON = Common(700.0, 1.2e9, 60.0, 220.0, 150e6, 70e3, 100e3, 5e-5)
NONE = Springs(0.0, 0.0)


def path_over_roughness(omega: np.ndarray, stiffness: float) -> np.ndarray:
    """Of a wheel of 700 kg on two lumped masses: rail of 90 kg on pads, half a sleeper of 350 kg on ballast, solved as
    a system for each frequency; the contact is a link without give. Infinite stiffness: the contact's spring alone.
    """
    if np.isinf(stiffness):
        return 1.2e9 / (1.2e9 - 700.0 * omega**2)
    pad = 300e6 + 1j * omega * 75e3
    ballast = 1.0 / (1.0 / stiffness - 1.0 / 300e6) + 1j * omega * 120e3
    found = np.empty(len(omega), dtype=complex)
    for i, w in enumerate(omega):
        matrix = np.array([[pad[i] - 790.0 * w**2, -pad[i]], [-pad[i], pad[i] + ballast[i] - 350.0 * w**2]])
        found[i] = 1.0 + np.linalg.solve(matrix, [700.0 * w**2, 0.0])[0]  # wheel: the roughness and the rail below it
    return found


def record(
    pieces: list[tuple[float, float]], noise: float = 0.01, seed: int = 3, highest: float = 250.0
) -> Measurements:
    """Accelerations of both wheels over the same roughness of power k^-3, on springs that follow each other: (seconds,
    N/m); without waves above the highest frequency, Hz.
    """
    rng = np.random.default_rng(seed)
    parts = []
    for seconds, spring in pieces:
        count = round(seconds * RATE)
        hertz = np.maximum(np.fft.rfftfreq(2 * count, 1.0 / RATE), 1e-3)
        power = 4e-10 * (hertz / SPEED) ** -3.0 / SPEED * (hertz > 3.0) * (hertz < highest)
        draws = rng.standard_normal(len(hertz)) + 1j * rng.standard_normal(len(hertz))
        omega = 2.0 * np.pi * hertz
        spectrum = -(omega**2) * path_over_roughness(omega, spring) * np.sqrt(power * 2 * count * RATE / 4.0) * draws
        parts.append(np.fft.irfft(spectrum, 2 * count)[:count])
    values = np.concatenate(parts)
    table = {TIME: np.arange(len(values)) / RATE, "wheelset1.speed [m/s]": np.full(len(values), SPEED)}
    sheets = []
    for side in ("left", "right"):
        name = f"axlebox1_{side}"
        channel = f"{name}.acceleration_z [m/s2]"
        table[channel] = 9.81 + values + noise * np.sqrt(RATE / 2.0) * rng.standard_normal(len(values))
        place = [0.0, 0.75 if side == "left" else -0.75, 0.0]
        errors = {"noise_density": noise}
        sheets.append({"name": name, "channels": [channel], "position": place, "errors": errors})
    return Measurements({"origin": "test", "vehicle": VEHICLE, "sensors": sheets}, {RATE: table})


def columns(measured: Measurements, **settings: object) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns of the estimate by short names, and its warnings."""
    found = TrackStiffness.build(settings).estimate(measured)
    series = {str(name).partition(" [")[0]: np.asarray(found.series[name]) for name in found.series.columns}
    return series, found.about["warnings"]


def test_receptance_at_rest_is_that_of_a_beam_on_springs() -> None:
    """The integral of the beam's equation over waves; foundation and stiffness as Zimmermann has them."""
    below = 60e6
    whole, _ = quad(lambda k: 1.0 / (BENDING * k**4 + below) / np.pi, 0.0, np.inf, epsabs=0.0)
    assert foundation(np.array([1.0 / whole]))[0] == pytest.approx(below, rel=1e-4)
    assert receptance(np.array([1e-3]), np.array([1.0 / whole]), COMMON)[0].real == pytest.approx(whole, rel=1e-4)


def test_receptance_of_a_beam_on_sleepers_with_mass() -> None:
    """At 60 Hz the same integral with rail, sleepers, pads and ballast as a chain below each metre of rail."""
    omega, stiffness = 2.0 * np.pi * 60.0, 90e6
    below = (stiffness / ROOT) ** (4.0 / 3.0)
    share = below / (below + COMMON.pad)
    pad = below / share + 1j * omega * COMMON.pad_damping
    bed = below / (1.0 - share) + 1j * omega * COMMON.bed_damping
    # forces on sleeper and rail of a metre that moves by 1: the sleeper follows from its own equation
    sleeper = pad / (pad + bed - COMMON.sleeper * omega**2)
    chain = pad * (1.0 - sleeper) - COMMON.rail * omega**2

    def part(k: float, take: str) -> float:
        return float(getattr(1.0 / (BENDING * k**4 + chain), take)) / np.pi

    real, imaginary = (quad(part, 0.0, 50.0, args=(take,), limit=400, epsabs=0.0)[0] for take in ("real", "imag"))
    found = receptance(np.array([omega]), np.array([stiffness]), COMMON)[0]
    assert found == pytest.approx(real + 1j * imaginary, rel=1e-3)


def test_a_softer_track_resonates_lower() -> None:
    """As sqrt(K / mass) with the wheel and what moves with it; below 1 of that without the track's own mass."""
    hertz = np.linspace(5.0, 150.0, 2000)
    for stiffness in (40e6, 90e6):
        gain = acceleration_over_roughness(2.0 * np.pi * hertz, np.array([[stiffness]]), COMMON, NONE)[0]
        peak = hertz[(gain / hertz**4).argmax()]
        alone = np.sqrt(stiffness / COMMON.mass) / (2.0 * np.pi)
        assert 0.7 * alone < peak < alone


def test_tapers_and_what_they_smear() -> None:
    weights = tapers(500)
    assert weights @ weights.T == pytest.approx(np.eye(len(weights)), abs=1e-9)
    smear = smearing(500, 60)
    assert smear[:, 30].sum() == pytest.approx(1.0, abs=1e-9)
    rng = np.random.default_rng(1)
    tone = [
        np.mean(
            np.abs(np.fft.rfft(weights * np.cos(2 * np.pi * 30 * np.arange(500) / 500 + phase))[:, 28:35]) ** 2, axis=0
        )
        for phase in rng.uniform(0, 6.28, 200)
    ]
    share = np.mean(tone, axis=0) / np.sum(np.mean(tone, axis=0))
    assert share == pytest.approx(smear[30, 28:35] / smear[30, 28:35].sum(), abs=0.06)


def test_gradient_is_that_of_the_objective() -> None:
    """By finite differences; and Fisher's matrix is symmetric and positive."""
    rng = np.random.default_rng(2)
    k = 0.05 * np.arange(1, 90)
    speed = np.array([20.0, 25.0, 30.0])
    power = rng.exponential(size=(3, len(k)))
    windows = Windows(
        np.zeros(3),
        np.zeros(3),
        speed,
        k,
        power,
        np.ones_like(power),
        speed[:, None] * k > 14.0,
        smearing(1000, len(k)),
    )
    likelihood = Likelihood(windows, COMMON, NONE)
    state = likelihood.start(np.log(80e6))
    state = replace(state, own=state.own + 0.1 * rng.standard_normal(state.own.shape), common=state.common + 0.05)
    normal, step = likelihood.normal(state), 1e-5

    def slope(own: np.ndarray, others: np.ndarray) -> float:
        ahead, behind = (likelihood.objective(state.moved(sign * step * own, sign * step * others)) for sign in (1, -1))
        return (behind - ahead) / (2.0 * step)

    still = np.zeros(len(normal.to_common))
    for place in ((0, 0), (1, 1), (2, 2)):
        one = np.zeros_like(state.own)
        one[place] = 1.0
        assert slope(one, still) == pytest.approx(normal.to_own[place], rel=1e-3, abs=1e-3)
    for i in range(len(still)):
        assert slope(np.zeros_like(state.own), np.eye(len(still))[i]) == pytest.approx(
            normal.to_common[i], rel=1e-3, abs=2e-3
        )
    assert np.linalg.eigvalsh(normal.covariance()).min() > 0.0


@pytest.fixture(scope="module")
def two_halves() -> tuple[dict[str, np.ndarray], list[str]]:
    """8 s on 50 MN/m, then 8 s on 120 MN/m."""
    return columns(record([(8.0, 50e6), (8.0, 120e6)]))


def test_two_halves_of_a_line(two_halves: tuple[dict[str, np.ndarray], list[str]]) -> None:
    """Level within two stated deviations, ratio of both halves within 15 %."""
    series, warnings = two_halves
    assert warnings == []
    s = series["s"]
    soft, stiff = (s > 15.0) & (s < 180.0), (s > 220.0) & (s < 385.0)
    value, std = series["track_stiffness"], series["track_stiffness_std"]
    assert np.isfinite(value[soft | stiff]).all()
    ratio = np.exp(np.mean(np.log(value[stiff])) - np.mean(np.log(value[soft])))
    assert ratio == pytest.approx(120.0 / 50.0, rel=0.15)
    true = np.where(soft, 50e6, 120e6)
    inside = np.abs(value - true)[soft | stiff] <= 2.0 * std[soft | stiff]
    assert inside.mean() >= 0.85
    assert (std[soft | stiff] < 0.25 * true[soft | stiff]).all()


def test_ratio_is_over_the_geometric_mean(two_halves: tuple[dict[str, np.ndarray], list[str]]) -> None:
    series, _ = two_halves
    value, ratio = series["track_stiffness"], series["track_stiffness_ratio"]
    known = np.isfinite(value)
    assert np.mean(np.log(ratio[known])) == pytest.approx(0.0, abs=1e-9)
    assert ratio[known] == pytest.approx(value[known] / np.exp(np.mean(np.log(value[known]))))


@pytest.mark.parametrize("seed", [3, 4])
def test_rails_that_do_not_give_have_no_stiffness(seed: int) -> None:
    series, warnings = columns(record([(16.0, np.inf)], seed=seed))
    assert np.isnan(series["track_stiffness"]).all()
    assert len(warnings) == 1
    assert "withheld" in warnings[0]


def test_noise_alone_gives_nothing() -> None:
    series, warnings = columns(record([(10.0, 90e6)], noise=30.0))
    assert np.isnan(series["track_stiffness"]).all()
    assert "noise" in warnings[0]


def test_few_windows_give_nothing_and_lost_samples_are_not_used() -> None:
    series, warnings = columns(record([(2.0, 90e6)]))
    assert np.isnan(series["track_stiffness"]).all()
    assert "fewer than 4 windows" in warnings[0]
    whole = record([(12.0, 90e6)])
    left = "axlebox1_left.acceleration_z [m/s2]"
    table = {TIME: whole.time(left), **{name: np.array(whole[name]) for name in whole}}
    table[left][round(5.0 * RATE) : round(5.4 * RATE)] = np.nan
    series, _ = columns(Measurements(dict(whole.about), {RATE: table}))
    lost = (series["s"] > 115.0) & (series["s"] < 145.0)
    assert not series["valid"][lost].any()
    assert np.isnan(series["track_stiffness"][lost]).all()
    assert np.isfinite(series["track_stiffness"]).sum() >= 8


def test_a_wheel_out_of_round_is_left_out() -> None:
    """Two lines of a turn in all windows, ten times the roughness there: the level stays within two deviations."""
    whole = record([(14.0, 80e6)])
    time = whole.time("wheelset1.speed [m/s]")
    turn = SPEED / (2.0 * np.pi * 0.46)
    table = {TIME: time, **{name: np.array(whole[name]) for name in whole}}
    for side in ("left", "right"):
        tone = 3.0 * np.cos(2 * np.pi * 3 * turn * time) + 4.0 * np.cos(2 * np.pi * 5 * turn * time)
        table[f"axlebox1_{side}.acceleration_z [m/s2]"] += tone
    series, warnings = columns(Measurements(dict(whole.about), {RATE: table}))
    value, std = series["track_stiffness"], series["track_stiffness_std"]
    known = np.isfinite(value)
    assert warnings == []
    assert known.sum() >= 10
    assert np.mean(np.abs(value - 80e6)[known] <= 2.0 * std[known]) >= 0.85


def test_parameters_are_needed() -> None:
    whole = record([(2.0, 90e6)])
    table = {TIME: whole.time("wheelset1.speed [m/s]"), **{name: whole[name] for name in whole}}
    with pytest.raises(InputError, match="'wheelset_mass', 'wheel_radius', 'half_gauge', 'design_wheel_load'"):
        TrackStiffness().estimate(Measurements(dict(whole.about) | {"vehicle": {}}, {RATE: table}))


@pytest.mark.parametrize(("shortest", "stiffness"), [(0.55, 70e6), (0.55, np.inf), (1.0, 70e6)])
def test_waves_that_end_are_no_resonance(shortest: float, stiffness: float) -> None:
    """Roughness that ends at 45 or 25 Hz: nothing is given, on rails that give and on those that do not."""
    whole = record([(14.0, stiffness)], highest=SPEED / shortest)
    series, warnings = columns(whole)
    assert np.isnan(series["track_stiffness"]).all()
    assert warnings
