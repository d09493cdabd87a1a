"""What is suspicious about a recording: lost samples, gaps in time, values stuck or at the end of the range."""

import numpy as np

from railsim.errors import InputError
from railsim.measurements import Measurements

STUCK = 1.0  # s of one and the same value
FEWEST_STUCK = 16  # samples
MOST_LOST = 0.01  # share of the samples
CLOSE_TO_RANGE = 0.999


def of_recording(measured: Measurements) -> list[str]:
    """Sentences on what a good recording should not have; empty where nothing is suspicious."""
    found: dict[str, list[str]] = {}
    for name in measured.channels:
        for text in _channel(measured, name):
            found.setdefault(text, []).append(name)
    return [f"{', '.join(names)}: {text}" for text, names in found.items()] + _gaps(measured)


def _channel(measured: Measurements, name: str) -> list[str]:
    values, time = measured[name], measured.time(name)
    lost = np.isnan(values)
    if lost.all():
        return ["holds no samples at all"]
    found = []
    if lost.mean() > MOST_LOST:
        found.append(f"{100 * lost.mean():.1f} % of the samples are lost, the first at t = {time[lost.argmax()]:.2f} s")
    first, count = longest_run(values)
    length = count / measured.rate(name)
    if length > STUCK and count >= FEWEST_STUCK and _kind(measured, name) != "tachometer":
        found.append(f"stuck at {values[first]:g} for {length:.2f} s from t = {time[first]:.2f} s")
    limit = _range(measured, name)
    if limit is not None:
        ended = np.abs(values) >= CLOSE_TO_RANGE * limit
        if ended.any():
            share = 100 * ended.mean()
            found.append(f"at the end of its range ({limit:g}) in {share:.2g} % of the samples")
    return found


def longest_run(values: np.ndarray) -> tuple[int, int]:
    """First index and length of the longest run of one value; lost samples are no value."""
    edges = np.flatnonzero(~(values[1:] == values[:-1])) + 1
    starts = np.concatenate([[0], edges])
    lengths = np.diff(np.concatenate([starts, [values.size]]))
    longest = int(np.argmax(lengths))
    return int(starts[longest]), int(lengths[longest])


def _gaps(measured: Measurements) -> list[str]:
    found = []
    for rate in sorted({measured.rate(name) for name in measured.channels}):
        time = measured.time(next(name for name in measured.channels if measured.rate(name) == rate))
        steps = np.diff(time) * rate
        wide = steps > 1.5
        if wide.any():
            where = float(time[int(wide.argmax())])
            text = f"times at {rate:g} Hz have {int(wide.sum())} gap(s) of up to {steps.max() / rate:.3g} s"
            found.append(f"{text}, the first after t = {where:.2f} s")
    return found


def _kind(measured: Measurements, name: str) -> str:
    try:
        return str(measured.sensor(name).get("kind", ""))
    except InputError:
        return ""


def _range(measured: Measurements, name: str) -> float | None:
    try:
        limit = measured.sensor(name).get("errors", {}).get("range")
    except InputError:
        return None
    return float(limit) if isinstance(limit, int | float) else None
