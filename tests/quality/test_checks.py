"""Each kind of fault in a synthetic rigid bogie: found, named, placed, repaired; the clean bogie: nothing."""

from collections.abc import Callable
from typing import cast

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter, resample

from railsim.measurements import TIME, Measurements
from railsim.quality.agreement import agreement
from railsim.quality.companions import sized
from railsim.quality.gravity import weighed
from railsim.quality.inspection import checks, inspect
from railsim.quality.interface import Finding
from railsim.quality.repair import repaired
from railsim.quality.repairs import Shift

RATE, LENGTH, SPEED = 256.0, 20.0, 20.0
ARM = np.array([1.2, 1.0, 0.0])
ERRORS = {"noise_density": 4e-4, "bias_std": 0.02, "resolution": 1e-5, "scale_error_std": 0.002, "range": 80.0}
Frames = dict[float, dict[str, np.ndarray]]


def _movement(rng: np.random.Generator) -> np.ndarray:
    """Band-limited random motion, 1 to 15 Hz, standard deviation 1, shape (n,)."""
    count = round(RATE * LENGTH)
    at = np.fft.rfftfreq(count, 1 / RATE)
    spectrum = (rng.standard_normal(at.size) + 1j * rng.standard_normal(at.size)) * ((at > 1) & (at < 15))
    values = np.fft.irfft(spectrum, count)
    return values / values.std()


def _bogie(seed: int) -> tuple[dict[str, object], Frames]:
    """Two accelerometers and a gyro on a rigid body, a tachometer and a receiver: description and tables."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(RATE * LENGTH)) / RATE
    turn = [0.02 * _movement(rng) for _ in range(3)]
    alpha = [np.gradient(one, 1 / RATE, edge_order=2) for one in turn]
    force = [0.5 * _movement(rng) for _ in range(3)]
    force[2] = force[2] + 9.81
    x, y, z = ARM
    lead = [
        force[0] + alpha[1] * z - alpha[2] * y,
        force[1] + alpha[2] * x - alpha[0] * z,
        force[2] + alpha[0] * y - alpha[1] * x,
    ]

    def noisy(values: np.ndarray, density: float) -> np.ndarray:
        return values + density * np.sqrt(RATE / 2) * rng.standard_normal(values.size)

    fast = {TIME: time}
    fast |= {f"bogie.acceleration_{a} [m/s2]": noisy(v, 4e-4) for a, v in zip("xyz", force, strict=True)}
    fast |= {f"bogie_lead.acceleration_{a} [m/s2]": noisy(v, 4e-4) for a, v in zip("xyz", lead, strict=True)}
    names = ("roll", "pitch", "yaw")
    fast |= {f"bogie.rate_{a} [rad/s]": noisy(v, 4e-5) for a, v in zip(names, turn, strict=True)}
    slow, eight = np.arange(0, LENGTH, 1 / 64), np.arange(0, LENGTH, 1 / 8)
    speed = SPEED + 0.002 * rng.standard_normal(slow.size)
    frames: Frames = {
        RATE: fast,
        64.0: {TIME: slow, "wheelset1.wheel_speed [rad/s]": speed / 0.46, "wheelset1.speed [m/s]": speed},
        8.0: {TIME: eight, "gnss.speed [m/s]": SPEED + 0.05 * rng.standard_normal(eight.size)},
    }
    gyro = {**ERRORS, "noise_density": 4e-5, "bias_std": 1e-3, "resolution": 1e-6, "range": 8.0}
    sensors = [
        {"kind": "accelerometer", "name": "bogie", "position": [0, 0, 0], "errors": ERRORS},
        {"kind": "accelerometer", "name": "bogie_lead", "position": ARM.tolist(), "errors": ERRORS},
        {"kind": "gyro", "name": "bogie", "position": [0, 0, 0], "errors": gyro},
        {"kind": "tachometer", "name": "wheelset1"},
        {"kind": "gnss", "name": "gnss"},
    ]
    for sheet in sensors:
        quantity = {"accelerometer": "acceleration", "gyro": "rate"}.get(str(sheet["kind"]), "")
        every = [name for table in frames.values() for name in table]
        sheet |= {"body": "wheelset1" if sheet["kind"] == "tachometer" else "bogie"}
        sheet["channels"] = [name for name in every if name.startswith(f"{sheet['name']}.{quantity}")]
    return {"origin": "a test", "vehicle": {"wheel_radius": 0.46}, "sensors": sensors}, frames


def _measured(about: dict[str, object], frames: Frames) -> Measurements:
    return Measurements(about, {rate: pd.DataFrame(table) for rate, table in frames.items()})


PITCH, LEAD_Z, SIDE = "bogie.rate_pitch [rad/s]", "bogie_lead.acceleration_z [m/s2]", "bogie.acceleration_y [m/s2]"
TACHOMETER = "wheelset1.speed [m/s]"


def _lose_rows(frames: Frames) -> None:
    frames[RATE] = {name: np.delete(values, slice(1000, 1300)) for name, values in frames[RATE].items()}


def _put(channel: str, part: slice, value: Callable[[np.ndarray], np.ndarray | float]) -> Callable[[Frames], None]:
    def change(frames: Frames) -> None:
        table = next(table for table in frames.values() if channel in table)
        table[channel][part] = value(table[channel][part])

    return change


def _swap(frames: Frames) -> None:
    table = frames[RATE]
    table[PITCH], table["bogie.rate_roll [rad/s]"] = table["bogie.rate_roll [rad/s]"], table[PITCH]


def _noise(values: np.ndarray) -> np.ndarray:
    return values + 0.1 * np.random.default_rng(5).standard_normal(values.size)


def _spiked(values: np.ndarray) -> np.ndarray:
    changed = values.copy()
    changed[[0, 2, 300]] += [6.0, -6.0, 6.0]
    return changed


def _jitter(values: np.ndarray) -> np.ndarray:
    return values + np.random.default_rng(6).uniform(-0.3, 0.3, values.size) / RATE


ALL, LATER = slice(None), slice(2560, None)
CASES = {
    "offset": (SIDE, _put(SIDE, ALL, lambda v: v + 2.0), 0.0, LENGTH),
    "offset step": (LEAD_Z, _put(LEAD_Z, LATER, lambda v: v + 0.5), 10.0, LENGTH),
    "gain change": (LEAD_Z, _put(LEAD_Z, slice(1280, 2560), lambda v: 0.7 * v), 5.0, 10.0),
    "noise": (SIDE, _put(SIDE, slice(1280, 2560), _noise), 5.0, 10.0),
    "stuck": (LEAD_Z, _put(LEAD_Z, slice(1280, 1536), lambda v: v[0]), 5.0, 6.0),
    "null": (PITCH, _put(PITCH, slice(1280, 1536), lambda _: 0.0), 5.0, 6.0),
    "drop-out": (PITCH, _put(PITCH, slice(1280, 1536), lambda _: np.nan), 5.0, 6.0),
    "spikes": (SIDE, _put(SIDE, slice(1280, 1792), _spiked), 5.0, 5.0 + 300 / RATE),
    "saturation": (SIDE, _put(SIDE, ALL, lambda v: np.minimum(v, np.quantile(v, 0.98))), 0.0, LENGTH),
    "clock": ("time [s] at 256 Hz", _put(TIME, slice(0, 0), lambda v: v), 5.0, 10.0),
    "swapped": (PITCH, _swap, 0.0, LENGTH),
    "inverted": (LEAD_Z, _put(LEAD_Z, ALL, lambda v: -v), 0.0, LENGTH),
    "tachometer": (TACHOMETER, _put(TACHOMETER, ALL, lambda v: 1.15 * v), 0.0, LENGTH),
}


def _spoilt(kind: str) -> Measurements:
    about, frames = _bogie(1)
    if kind == "clock":
        frames[RATE][TIME][1280:2560] = _jitter(frames[RATE][TIME][1280:2560])
    CASES[kind][1](frames)
    return _measured(about, frames)


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_found_in_a_rigid_bogie(seed: int):
    assert inspect(_measured(*_bogie(seed))).findings == []


@pytest.mark.parametrize("kind", CASES)
def test_fault_is_found_named_and_placed(kind: str):
    channel, _, start, end = CASES[kind]
    found = inspect(_spoilt(kind)).faults
    assert [one.kind for one in found] == [kind]
    assert channel in (found[0].channel, found[0].other)
    if kind == "saturation":  # the first and last sample that is cut off
        clean = _measured(*_bogie(1))
        start, end = clean.time(SIDE)[clean[SIDE] > np.quantile(clean[SIDE], 0.98)][[0, -1]]
    assert abs(found[0].start - start) < 0.5
    assert abs(found[0].end - end) < 0.5


def test_noise_is_reported_and_not_taken_out():
    spoilt = _spoilt("noise")
    mended = inspect(spoilt).cleaned
    for name in spoilt:
        np.testing.assert_array_equal(mended[name], spoilt[name], err_msg=name)


@pytest.mark.parametrize("kind", [kind for kind in CASES if kind != "noise"])
def test_repair_brings_the_true_samples_back(kind: str):
    about, frames = _bogie(1)
    clean, mended = _measured(about, frames), inspect(_spoilt(kind)).cleaned
    for name in clean:
        if name == "wheelset1.wheel_speed [rad/s]":
            continue  # the case spoils one of the tachometer's two channels, the repair divides both
        off = mended[name] - clean[name]
        spread = float(clean[name].std())
        allowed = 0.25 if kind in ("offset", "offset step", "spikes") else 1e-9
        allowed = 0.05 if kind == "saturation" else allowed  # 1.6 were cut off
        if kind in ("offset step", "gain change"):
            allowed = 0.01 if name == LEAD_Z else allowed  # as well as the other accelerometer says it; 1 % of 0.5 m/s2
        allowed = 0.02 * 20 if kind == "tachometer" and name == TACHOMETER else allowed * spread
        assert np.nanmax(np.abs(off)) <= allowed, name
        assert np.isfinite(mended[name]).mean() > 0.7


def test_limited_samples_of_a_gyro_come_back_nearly_as_they_were():
    """Movement up to 15 Hz sampled at 256 Hz is known from its neighbours: within a quarter of what was cut off."""
    about, frames = _bogie(1)
    clean = frames[RATE][PITCH].copy()
    limit = float(np.quantile(clean, 0.98))
    frames[RATE][PITCH] = np.minimum(clean, limit)
    done = inspect(_measured(about, frames))
    assert [one.kind for one in done.faults] == ["saturation"]
    cut = clean > limit
    off, lost = (done.cleaned[PITCH] - clean)[cut], clean[cut] - limit
    assert np.isfinite(off).mean() > 0.9
    assert np.sqrt(np.nanmean(off**2)) < 0.25 * np.sqrt(np.mean(lost**2))


def test_missing_rows_come_back_as_a_gap():
    about, frames = _bogie(2)
    whole = frames[RATE][TIME].copy()
    _lose_rows(frames)
    done = inspect(_measured(about, frames))
    assert [(one.kind, one.channel) for one in done.faults] == [("drop-out", "time [s] at 256 Hz")]
    np.testing.assert_allclose(done.cleaned.time(PITCH), whole, atol=1e-9)
    assert np.flatnonzero(np.isnan(done.cleaned[PITCH])).tolist() == list(range(1000, 1300))


def _two_tables(shift: int) -> Measurements:
    """The second accelerometer in a table of 512 Hz that begins `shift` samples late and stamps from zero on."""
    about, frames = _bogie(7)
    names = [name for name in frames[RATE] if name.startswith("bogie_lead")]
    fast = {name: np.asarray(resample(frames[RATE].pop(name), round(2 * RATE * LENGTH)), float) for name in names}
    count = round(2 * RATE * LENGTH) - shift
    frames[2 * RATE] = {TIME: np.arange(count) / (2 * RATE)} | {name: fast[name][shift:] for name in names}
    return _measured(about, frames)


def test_a_table_that_runs_early_is_found_and_moved():
    clean, done = _two_tables(0), inspect(_two_tables(64))
    assert inspect(clean).faults == []
    assert [(one.kind, one.channel, one.other) for one in done.faults] == [
        ("clock shift", "time [s] at 512 Hz", "time [s] at 256 Hz")
    ]
    assert done.faults[0].stated()["amount"] == pytest.approx(64 / 512, abs=5e-4)
    np.testing.assert_array_equal(done.cleaned[LEAD_Z][64:], clean[LEAD_Z][64 : done.cleaned[LEAD_Z].size])
    assert np.isnan(done.cleaned[LEAD_Z][:64]).all()


def test_a_sensor_of_another_gain_throughout_is_named_too():
    about, frames = _bogie(1)
    frames[RATE][PITCH] *= 1.25
    found = inspect(_measured(about, frames)).faults
    assert [(one.kind, one.channel, one.start, one.end) for one in found] == [
        ("gain change", PITCH, 0.0, frames[RATE][TIME][-1])
    ]
    assert found[0].stated()["amount"] == pytest.approx(1.25, rel=0.03)


def test_a_step_that_two_sensors_feel_is_real():
    about, frames = _bogie(3)
    for name in ("bogie.acceleration_x [m/s2]", "bogie_lead.acceleration_x [m/s2]"):
        frames[RATE][name][2560:3328] -= 0.8
    assert not [one for one in inspect(_measured(about, frames)).faults if one.kind == "offset step"]


def test_size_of_an_offset_in_a_slowly_moving_channel():
    rng = np.random.default_rng(8)
    values = np.asarray(lfilter([1.0], [1.0, -1.6, 0.64], rng.standard_normal(7680)))  # correlated over many samples
    deviation = 25.0 * np.sqrt(1 / 2000 + 1 / 5680)  # of a difference of means: gain 25 = 1 / (1 - 1.6 + 0.64)
    values[3000:5000] += 60.0
    for first in (45.0, 80.0):
        assert sized(values, RATE, 3000, 5000, first) == pytest.approx(60.0, abs=4.0 * deviation)


def test_a_sliding_wheel_is_a_note_and_missing_pulses_are_a_fault():
    slide, broken = np.ones(1280), np.ones(1280)
    slide[400:800] = 1 - 0.2 * np.clip(np.minimum(np.arange(400), 400 - np.arange(400)) / 64, 0, 1)
    broken[400:800] = 0.6
    for shape, kind, severity in ((slide, "slip", "note"), (broken, "tachometer", "fault")):
        about, frames = _bogie(4)
        for name in (TACHOMETER, "wheelset1.wheel_speed [rad/s]"):
            frames[64.0][name] *= shape
        found = inspect(_measured(about, frames)).findings
        assert [(one.kind, one.severity) for one in found] == [(kind, severity)]


def test_a_broken_tachometer_follows_the_other_axle_through_a_change_of_speed():
    """Speed falls from 20 to 12 m/s and rises again within the broken stretch, which a straight line would not know."""
    about, frames = _bogie(8)
    for rate, name in ((64.0, TACHOMETER), (8.0, "gnss.speed [m/s]")):
        table = frames[rate]
        table[name] = table[name] - 4.0 * np.clip(2.0 - np.abs(table[TIME] - 10.0), 0.0, None)
    slow = frames[64.0]
    slow["wheelset1.wheel_speed [rad/s]"] = slow[TACHOMETER] / 0.46
    slow["wheelset2.speed [m/s]"] = 1.01 * slow[TACHOMETER]
    second = {"kind": "tachometer", "name": "wheelset2", "body": "wheelset2", "channels": ["wheelset2.speed [m/s]"]}
    about["sensors"] = [*cast(list[object], about["sensors"]), second]
    true = {name: slow[name].copy() for name in (TACHOMETER, "wheelset1.wheel_speed [rad/s]")}
    for name in true:
        slow[name][560:720] *= 0.6
    done = inspect(_measured(about, frames))
    assert [one.kind for one in done.faults] == ["tachometer"]
    for name, values in true.items():
        np.testing.assert_allclose(done.cleaned[name], values, atol=0.01 * values.max())


def test_a_table_that_is_moved_loses_nothing_at_its_end():
    about, frames = _bogie(9)
    whole = _measured(about, frames)
    late = {TIME: frames[RATE][TIME][:-40]} | {n: v[40:] for n, v in frames[RATE].items() if n != TIME}
    start, end = float(late[TIME][0]), float(late[TIME][-1])
    one = Finding("clock shift", f"{TIME} at 256 Hz", start, end, "", "", repair=Shift(40 / RATE))
    moved = repaired(_measured(about, frames | {RATE: late}), [one])
    np.testing.assert_array_equal(moved[PITCH][40:], whole[PITCH][40:])
    assert np.isnan(moved[PITCH][:40]).all()


def test_every_finding_says_what_to_do():
    assert len(checks()) == 17
    for kind in CASES:
        for one in inspect(_spoilt(kind)).findings:
            assert one.advice
            assert one.extent
            assert one.text().startswith(one.channel)


@pytest.mark.parametrize("sound", [1.0, 0.95])
def test_gain_is_relative_to_the_rest_where_a_relation_is_off_throughout(sound: float):
    """A gyro reads `sound` times what the others say, and 1.8 times as much from 10 s on."""
    about, frames = _bogie(3)
    frames[RATE][PITCH] *= np.where(np.arange(frames[RATE][PITCH].size) < 2560, sound, 1.8 * sound)
    measured = _measured(about, frames)
    found = agreement(measured, PITCH, 640, 1280, 1.7)
    assert found.gain(measured[PITCH], RATE, 2560, measured[PITCH].size, 1.7) == pytest.approx(1.8, rel=0.01)


@pytest.mark.parametrize(("factor", "first", "last"), [(1.4, 1111, 3333), (0.6, 2222, None)])
def test_gain_change_of_a_gyro_is_placed_to_some_samples_and_taken_out(factor: float, first: int, last: int | None):
    """Where the reading is nearly zero its gain does not show, and does no harm."""
    about, frames = _bogie(3)
    clean = frames[RATE][PITCH].copy()
    frames[RATE][PITCH][first:last] *= factor
    seen = inspect(_measured(about, frames))
    assert [(one.kind, one.channel) for one in seen.faults] == [("gain change", PITCH)]
    time = frames[RATE][TIME]
    assert seen.faults[0].start == pytest.approx(time[first], abs=5 / RATE)
    assert seen.faults[0].end == pytest.approx(time[-1] if last is None else time[last - 1], abs=5 / RATE)
    assert np.std(seen.cleaned[PITCH] - clean) < 0.02 * np.std(clean)


@pytest.mark.parametrize("kind", ["gain change", "offset step"])
def test_gravity_read_wrong_is_a_gain_where_the_noise_changes_too(kind: str):
    about, frames = _bogie(2)
    values = frames[RATE][LEAD_Z]
    values[2000:3600] = 0.8 * values[2000:3600] if kind == "gain change" else values[2000:3600] - 1.96
    found = weighed(_measured(about, frames))
    if kind == "offset step":
        assert found is None
    else:
        assert found == (LEAD_Z, 2000, 3600, pytest.approx(0.8, abs=0.01))
