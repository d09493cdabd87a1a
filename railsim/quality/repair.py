"""What a finding changes in a recording: a cleaned copy, with a log; the original is only read."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from railsim.measurements import TIME, Measurements
from railsim.quality._restore import restored
from railsim.quality._signals import filled
from railsim.quality.clock import gridded, numbers
from railsim.quality.companions import predicted
from railsim.quality.interface import Finding
from railsim.recording import Recording, write_recording

_Columns = dict[str, np.ndarray]
WHOLE = 0.15  # steps by which a shift may miss a whole number of samples and is still taken as that


def repaired(measured: Measurements, findings: Sequence[Finding]) -> Measurements:
    """A copy in which each finding's repair is made; notes change nothing."""
    faults = [one for one in findings if one.severity == "fault" and one.repair != "none"]
    if not faults:
        return measured
    frames = tables_of(measured)
    for one in (fault for fault in faults if fault.repair not in ("regrid", "shift")):
        if one.repair == "restore" and one.samples is not None:
            _restore(measured, frames[_rate(measured, one)], one.channel, one.samples)
        else:
            _change(frames[_rate(measured, one)], one)
    for one in (fault for fault in faults if fault.repair == "shift"):
        latest = max(float(table[TIME][-1]) + 1.0 / rate for rate, table in frames.items())
        frames[_rate(measured, one)] = _shifted(frames[_rate(measured, one)], one.amount, latest)
    for rate in {_rate(measured, one) for one in faults if one.repair == "regrid"}:
        frames[rate] = _regrid(frames[rate], rate)
    return Measurements(measured.about, frames, measured.track)


def write_repaired(
    recording: Recording, measured: Measurements, findings: Sequence[Finding], folder: Path | str
) -> Path:
    """Write the cleaned copy; its about.json holds the log under "inspection".

    Parameters
    ----------
    recording : the original, from which truth (if any) is copied.
    measured : the cleaned measurements.
    findings : what was found and done.

    Raises
    ------
    InputError : the folder cannot be written, or is the original's.
    """
    log = [one.stated() | {"done": _done(one)} for one in findings]
    about: dict[str, Any] = {**measured.about, "inspection": {"of": recording.folder.name, "findings": log}}
    frames = {rate: pd.DataFrame(columns) for rate, columns in tables_of(measured).items()}
    written = write_recording(
        folder,
        frames,
        about,
        recording.truth,
        track=measured.track,
        true_track=recording.true_track,
        scenario=recording.scenario,
    )
    return Path(written)


def _done(one: Finding) -> str:
    """The repair in words."""
    if one.severity == "note":
        return "nothing"
    words = {
        "none": "nothing",
        "mask": "nothing",
        "blank": "samples left out",
        "fill": "samples interpolated",
        "restore": "samples put back by the channel's autoregressive model and the other channels, long runs left out",
        "subtract": f"{one.amount:.6g} subtracted",
        "put": f"samples put back from {one.other}",
        "swap": f"exchanged with {one.other}",
        "negate": "sign turned round",
        "scale": f"divided by {one.amount:.6g}",
        "shift": f"moved by {one.amount:+.6g} s",
        "regrid": "even times, missing rows left empty",
    }
    return words[one.repair]


def tables_of(measured: Measurements) -> dict[float, _Columns]:
    """A recording's tables by sample rate, to be changed."""
    frames: dict[float, _Columns] = {}
    for name in measured:
        table = frames.setdefault(measured.rate(name), {TIME: measured.time(name).copy()})
        table[name] = measured[name].copy()
    return frames


def _rate(measured: Measurements, one: Finding) -> float:
    if one.channel.startswith(TIME):
        return float(one.channel.removeprefix(f"{TIME} at ").removesuffix(" Hz"))
    return measured.rate(one.channel)


def _change(table: _Columns, one: Finding) -> None:
    time = table[TIME]
    half = 0.5 * float(np.median(np.diff(time)))
    at = one.samples if one.samples is not None else np.flatnonzero((time > one.start - half) & (time < one.end + half))
    before = table[one.channel].copy() if one.channel in table else np.zeros(0)
    for name in _together(table, one.channel):
        values = table[name]
        if one.repair in ("mask", "blank", "fill"):
            lost = np.isnan(values)
            values[at] = np.nan
            if one.repair == "fill":
                table[name] = np.where(lost, np.nan, filled(values))
        elif one.repair == "put" and one.values is not None:
            moving = np.abs(before) > 0.1 * np.nanmax(np.abs(before))
            unit = 1.0 if name == one.channel else float(np.nanmedian(values[moving] / before[moving]))
            values[at] = unit * one.values
        elif one.repair == "subtract":
            values[at] -= one.amount
        elif one.repair == "negate":
            values *= -1.0
        elif one.repair == "scale":
            values[at] /= one.amount
    if one.repair == "swap" and one.other is not None:
        table[one.channel], table[one.other] = table[one.other], table[one.channel]


def _restore(measured: Measurements, table: _Columns, name: str, at: np.ndarray) -> None:
    """Limited samples, by the channel's own model and what the other channels say."""
    values = table[name]
    sound = np.isfinite(values)
    sound[at] = False
    table[name] = restored(values, at, measured.rate(name), predicted(measured, name, values, sound))


def _together(table: _Columns, name: str) -> list[str]:
    """A tachometer's two channels are one measurement."""
    for ending, other in ((".speed [m/s]", ".wheel_speed [rad/s]"), (".wheel_speed [rad/s]", ".speed [m/s]")):
        twin = name.removesuffix(ending) + other
        if name.endswith(ending) and twin in table:
            return [name, twin]
    return [name]


def _shifted(table: _Columns, amount: float, latest: float) -> _Columns:
    """Values moved to stamps that are `amount` s later, on the times as they are and on as many more as they reach
    until `latest`, s; by whole samples where it is nearly that many, else by cubic splines. Ends and neighbours of lost
    samples are empty.
    """
    step = float(np.median(np.diff(table[TIME])))
    more = max(0, min(math.floor(amount / step), math.floor((latest - float(table[TIME][-1])) / step - 0.5)))
    table = {name: np.concatenate([values, np.full(more, math.nan)]) for name, values in table.items()}
    time = table[TIME]
    time[time.size - more :] = time[time.size - more - 1] + step * np.arange(1, more + 1)
    steps = amount / step
    near = np.arange(time.size) - round(steps)
    inside = (near >= 0) & (near < time.size)
    whole = abs(steps - round(steps)) < WHOLE
    new: _Columns = {TIME: time}
    for name in list(table)[1:]:
        values = table[name]
        source = np.where(inside, values[near.clip(0, time.size - 1)], math.nan)
        if not whole:
            between = CubicSpline(time, filled(values))(np.clip(time - amount, time[0], time[-1]))
            source = np.where(np.isnan(source), math.nan, between)
        new[name] = source
    return new


def _regrid(table: _Columns, rate: float) -> _Columns:
    """Rows on the even grid, those that are missing empty."""
    place = numbers(table[TIME], rate).astype(int)
    even = gridded(table[TIME], rate)
    count = int(place[-1]) + 1
    new: _Columns = {TIME: np.interp(np.arange(count), place, even)}
    for name in list(table)[1:]:
        new[name] = np.full(count, math.nan)
        new[name][place] = table[name]
    return new
