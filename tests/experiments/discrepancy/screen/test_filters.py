"""One signature of a filter makes all others: held against the sensors' own model, sample by sample."""

from typing import Any

import numpy as np
import pytest

from experiments.discrepancy.baseline.frames import frames_of, transform
from experiments.discrepancy.fit.candidates import Candidate, Context, candidates
from experiments.discrepancy.screen.filters import forms
from railsim.sensors.errors import SensorErrors, sample

RATE, DURATION = 4096.0, 12.0  # Hz, s; so fast that the bilinear transform of the sensors warps little
CONTEXT = Context(("bogie.rate_yaw",), (50.0, 900.0), (1.0, 30.0), ())
FRAMES = frames_of(DURATION, 200.0)


def _candidate(name: str) -> Candidate:
    return next(one for one in candidates(CONTEXT) if one.name == name)


def _through(name: str, values: dict[str, float], signal: np.ndarray) -> np.ndarray:
    if name == "sensor_delay":
        return sample(signal, 1, values["delay"] * RATE)
    errors: Any = SensorErrors(resonance=1.0 / values["period"], resonance_damping=values["damping"])
    return errors.shake(signal, RATE)


@pytest.mark.parametrize("finely", [False, True])
@pytest.mark.parametrize("name", ["sensor_delay", "sensor_resonance"])
def test_any_form_is_made_of_one(name: str, finely: bool):
    one = _candidate(name)
    assert one.reference is not None
    spectrum = np.fft.rfft(np.random.default_rng(3).standard_normal(int(DURATION * RATE)))
    f = np.fft.rfftfreq(int(DURATION * RATE), 1.0 / RATE)
    signal = np.fft.irfft(spectrum / (1.0 + (f / 5.0) ** 2), int(DURATION * RATE))
    plain = transform(FRAMES, signal, RATE)
    base = transform(FRAMES, _through(name, one.reference, signal), RATE) - plain
    checked = 0
    for values, factor in forms(one, FRAMES.frequencies, finely):
        if values.get("delay", 0.0) > 0.15 or values.get("damping", 1.0) < 0.1:
            continue  # long against the frames: what comes late leaves them
        there = transform(FRAMES, _through(name, values, signal), RATE) - plain
        made = base * factor
        likeness = np.vdot(there, made).real / np.linalg.norm(there) / np.linalg.norm(made)
        assert likeness > 0.96, values
        assert 0.85 < np.linalg.norm(made) / np.linalg.norm(there) < 1.18, values
        checked += 1
    assert checked > 20


def test_forms_reach_from_the_smallest_to_the_bounds():
    for name in ("sensor_delay", "sensor_resonance"):
        one = _candidate(name)
        found = [values for values, _ in forms(one, FRAMES.frequencies, finely=False)]
        for number, free in one.parameters.items():
            here = [values[number] for values in found]
            assert max(here) > 0.85 * free.high
            if free.smallest is not None:
                assert min(here) <= free.smallest
    assert _candidate("sensor_gain").reference is None
    with pytest.raises(ValueError, match="no filter"):
        forms(_candidate("sensor_gain"), FRAMES.frequencies, finely=False)
