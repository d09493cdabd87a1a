"""The error model, term by term, against what its data sheet says."""

import numpy as np
import pytest
from scipy.signal import buttap, welch

from railsim.sensors.errors import SensorErrors, gauss_markov, low_pass, sample

RATE = 1024.0


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def sine(frequency: float, count: int = 8192) -> np.ndarray:
    return np.sin(2 * np.pi * frequency * np.arange(count) / RATE)


def test_ideal_sensor_changes_nothing() -> None:
    signal = rng().standard_normal(999)
    np.testing.assert_array_equal(SensorErrors().apply(signal, RATE, 1, rng()), signal)
    np.testing.assert_array_equal(SensorErrors().apply(signal, RATE, 4, rng()), signal[::4])


@pytest.mark.parametrize("step", [1, 4])
def test_noise_has_the_stated_density_at_every_sample_rate(step: int) -> None:
    density, count = 0.02, 2**18
    samples = SensorErrors(noise_density=density).apply(np.zeros(count * step), RATE, step, rng())
    rate = RATE / step
    std = density * np.sqrt(rate / 2)
    assert abs(samples.std() / std - 1) < 5 / np.sqrt(2 * count)
    assert abs(samples.mean()) < 5 * std / np.sqrt(count)
    frequency, power = welch(samples, rate, nperseg=256)
    assert np.all(np.abs(np.sqrt(power[1:-1]) / density - 1) < 0.1)
    assert frequency[-1] == rate / 2


def test_quantisation_steps_and_error() -> None:
    signal = np.linspace(-1, 1, 10_001)
    samples = SensorErrors(resolution=0.01).apply(signal, RATE, 1, rng())
    np.testing.assert_allclose(samples / 0.01, np.round(samples / 0.01), atol=1e-9)
    assert np.abs(samples - signal).max() <= 0.005 + 1e-12
    assert np.unique(np.round(samples, 6)).size == 201


def test_range_saturates_both_ways() -> None:
    samples = SensorErrors(range=0.5, resolution=0.3).apply(np.linspace(-1, 1, 101), RATE, 1, rng())
    assert (samples.min(), samples.max()) == (-0.5, 0.5)


def test_scale_and_bias_are_as_stated() -> None:
    signal = sine(3)
    samples = SensorErrors(scale_error=0.02, bias=0.3).apply(signal, RATE, 1, rng())
    np.testing.assert_allclose(samples, 1.02 * signal + 0.3)


@pytest.mark.parametrize("step", [1, 4])
def test_drift_rate_is_per_second_at_every_sample_rate(step: int) -> None:
    """3 units a second: 24 over the 8 s of the signal, from nothing at the start."""
    samples = SensorErrors(drift_rate=3.0).apply(np.zeros(8 * 1024 + 1), RATE, step, rng())
    np.testing.assert_allclose(samples, np.linspace(0.0, 24.0, samples.size), atol=1e-12)


def test_bias_and_scale_are_drawn_once_a_run_with_the_stated_deviation() -> None:
    errors = SensorErrors(bias_std=0.2, scale_error_std=0.05)
    biases, scales = [], []
    for seed in range(2000):
        low, high = errors.disturb(np.array([0.0, 1.0]), RATE, rng(seed))
        biases.append(low)
        scales.append(high - low - 1)
    for values, std in [(biases, 0.2), (scales, 0.05)]:
        assert abs(np.std(values) / std - 1) < 5 / np.sqrt(4000)
        assert abs(np.mean(values)) < 5 * std / np.sqrt(2000)
    constant = errors.apply(np.zeros(100), RATE, 1, rng(7))
    assert np.ptp(constant) == 0
    np.testing.assert_array_equal(constant, errors.apply(np.zeros(100), RATE, 1, rng(7)))


def test_drift_is_a_stationary_gauss_markov_process() -> None:
    values = gauss_markov(400_000, 10.0, 0.5, 5.0, rng())
    independent = 400_000 / (2 * 50)
    assert abs(values.std() / 0.5 - 1) < 5 / np.sqrt(2 * independent)
    for seconds in (1.0, 5.0):
        lag = round(seconds * 10)
        correlation = np.mean(values[lag:] * values[:-lag]) / np.mean(values**2)
        assert correlation == pytest.approx(np.exp(-seconds / 5), abs=5 / np.sqrt(independent))
    starts = [gauss_markov(2, 10.0, 0.5, 5.0, rng(seed))[0] for seed in range(2000)]
    assert np.std(starts) == pytest.approx(0.5, rel=5 / np.sqrt(4000))


@pytest.mark.parametrize("order", [1, 2, 4])
def test_bandwidth_is_where_half_the_power_is_left(order: int) -> None:
    errors = SensorErrors(bandwidth=50.0, bandwidth_order=order)
    for frequency, gain in [(50, np.sqrt(0.5)), (5, 1.0), (200, (50 / 200) ** order)]:
        samples = errors.filter(sine(frequency), RATE)[4096:]
        measured = np.sqrt(2) * samples.std()
        assert measured <= gain * 1.001
        if frequency <= 50:
            assert measured == pytest.approx(gain, rel=6e-3)


def test_filter_is_causal_and_starts_at_rest() -> None:
    errors = SensorErrors(bandwidth=50.0)
    step = np.where(np.arange(200) < 100, 9.81, 12.0)
    samples = errors.filter(step, RATE)
    np.testing.assert_allclose(samples[:100], 9.81, rtol=1e-12)
    assert 9.81 < samples[100] < 12.0


def test_bandwidth_beyond_the_signal_passes_it_unchanged() -> None:
    signal = sine(100)
    np.testing.assert_array_equal(SensorErrors(bandwidth=1000.0).filter(signal, RATE), signal)


@pytest.mark.parametrize("latency", [0.0, 3 / RATE, 0.0021, 0.05])
def test_latency_shifts(latency: float) -> None:
    time = np.arange(8192) / RATE
    samples = SensorErrors(latency=latency).apply(sine(20), RATE, 4, rng())
    settled = time[::4] > 0.1
    np.testing.assert_allclose(samples[settled], np.sin(2 * np.pi * 20 * (time[::4] - latency))[settled], atol=2e-6)


def test_latency_holds_the_first_value_before_the_start() -> None:
    np.testing.assert_array_equal(sample(np.arange(1.0, 9.0), 2, 4.0), [1, 1, 1, 3])


def test_changing_one_error_leaves_the_draws_of_the_others() -> None:
    plain = SensorErrors(noise_density=0.1, bias_std=1.0)
    drifting = SensorErrors(noise_density=0.1, bias_std=1.0, bias_instability=0.4)
    only_drift = SensorErrors(bias_instability=0.4)
    silence = np.zeros(500)
    total = plain.apply(silence, RATE, 1, rng(3)) + only_drift.apply(silence, RATE, 1, rng(3))
    np.testing.assert_allclose(drifting.apply(silence, RATE, 1, rng(3)), total, atol=1e-12)


def test_mounting_is_a_rotation_by_the_stated_angles() -> None:
    axes = SensorErrors(misalignment=(0.0, 0.0, 0.1)).mounting(rng())
    np.testing.assert_allclose(axes[:, 0], [np.cos(0.1), np.sin(0.1), 0], atol=1e-15)
    drawn = [SensorErrors(misalignment_std=0.01).mounting(rng(seed))[1, 0] for seed in range(2000)]
    assert np.std(drawn) == pytest.approx(0.01, rel=5 / np.sqrt(4000))


def test_data_sheet_hides_what_the_field_does_not_know() -> None:
    sheet = SensorErrors(bias=1.0, bias_std=2.0, misalignment=(0.1, 0, 0)).data_sheet()
    assert sheet["bias_std"] == 2.0
    assert not {"bias", "scale_error", "misalignment"} & set(sheet)


def test_resonance_has_its_gain_at_its_frequency_and_passes_what_is_slow():
    """1 / (2 z) at the resonance."""
    time = np.arange(20480) / 1024.0
    errors = SensorErrors(resonance=80.0, resonance_damping=0.05)
    for frequency, gain in ((80.0, 10.0), (2.0, 1.0)):
        shaken = errors.shake(np.sin(2 * np.pi * frequency * time), 1024.0)
        assert np.abs(shaken[-4096:]).max() == pytest.approx(gain, rel=0.01)


def test_resonance_is_at_rest_at_the_first_value_and_rings_at_its_own_frequency():
    """Gravity does not shake it; a step rings at f sqrt(1 - z^2) and loses z 2 pi / sqrt(1 - z^2) of its log a turn."""
    errors = SensorErrors(resonance=40.0, resonance_damping=0.05)
    np.testing.assert_allclose(errors.shake(np.full(500, 9.81), 4096.0), 9.81, rtol=1e-9)
    shaken = errors.shake(np.repeat([0.0, 1.0], [1, 4096]), 4096.0) - 1.0
    tops = np.flatnonzero((shaken[1:-1] > shaken[:-2]) & (shaken[1:-1] > shaken[2:]))[:6] + 1
    assert np.diff(tops).mean() == pytest.approx(4096.0 / (40.0 * np.sqrt(1 - 0.05**2)), rel=0.01)
    lost = 2 * np.pi * 0.05 / np.sqrt(1 - 0.05**2)
    assert np.log(shaken[tops[0]]) - np.log(shaken[tops[5]]) == pytest.approx(5 * lost, rel=0.01)
    assert shaken[tops[0]] == pytest.approx(np.exp(-lost / 2), rel=0.01)  # the overshoot of a step


def test_resonance_above_what_the_rate_shows_passes_all():
    signal = rng().standard_normal(200)
    np.testing.assert_array_equal(SensorErrors(resonance=470.0).shake(signal, 1024.0), signal)
    assert not np.allclose(SensorErrors(resonance=450.0).shake(signal, 1024.0), signal)


def test_the_stated_low_pass_is_that_of_the_filter():
    """Against SciPy's analogue design, which is not ours."""
    omega = np.geomspace(1.0, 1e4, 50)
    for order in (1, 2, 5):
        poles = buttap(order)[1]
        expected = 1.0 / np.prod(1j * omega[:, None] / (2.0 * np.pi * 80.0) - poles, axis=1)
        assert low_pass(omega, 80.0, order) == pytest.approx(expected, abs=1e-12)


def test_rectification_makes_a_bias_of_the_mean_square_even_of_what_the_filter_takes_out():
    """A vibration of 200 Hz behind a filter of 20 Hz: r a^2 / 2 is what is left."""
    vibration = 30.0 * np.sin(2 * np.pi * 200.0 * np.arange(8192) / RATE)
    errors = SensorErrors(rectification=1e-3, bandwidth=20.0, bandwidth_order=4)
    found = errors.apply(vibration, RATE, 1, rng())[4096:]
    np.testing.assert_allclose(found, 1e-3 * 30.0**2 / 2.0, atol=5e-3)
    plain = errors.model_copy(update={"rectification": 0.0}).apply(vibration, RATE, 1, rng())[4096:]
    assert np.abs(plain).max() < 5e-3


def test_overload_clips_before_the_filter_and_takes_from_the_integral():
    """A pulse of twice the limit loses half of its area, though the filtered pulse never comes near the limit."""
    pulse = np.where(np.abs(np.arange(4096) - 2000) < 3, 200.0, 0.0)
    errors = SensorErrors(overload=100.0, bandwidth=20.0)
    found = errors.apply(pulse, RATE, 1, rng())
    assert found.max() < 100.0
    assert found.sum() == pytest.approx(0.5 * pulse.sum(), rel=1e-6)
    late = SensorErrors(range=100.0, bandwidth=20.0).apply(pulse, RATE, 1, rng())
    assert late.sum() == pytest.approx(pulse.sum(), rel=1e-6)


@pytest.mark.parametrize("step", [1, 4])
def test_warming_moves_the_bias_with_its_time_constant(step: int):
    """0.2 units a kelvin, 10 K, 2 s: 2 (1 - 1/e) after 2 s."""
    errors = SensorErrors(temperature_bias=0.2, warming=10.0, warming_time=2.0)
    found = errors.apply(np.zeros(8 * 1024 + 1), RATE, step, rng())
    assert found[0] == 0.0
    assert found[2048 // step] == pytest.approx(2.0 * (1.0 - np.exp(-1.0)))
    assert "temperature_bias" in errors.data_sheet()
    assert not {"warming", "warming_time"} & set(errors.data_sheet())
