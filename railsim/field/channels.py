"""From a column of a file to a channel in SI units."""

import math
import re

import numpy as np

from railsim.errors import InputError
from railsim.field.geographic import degrees
from railsim.field.map import Channel, Pulses
from railsim.field.tables import Column, Notes, Table
from railsim.field.units import Unit, converter, parse_unit

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\.[A-Za-z][A-Za-z0-9_]* \[([^\[\]]+)\]")


def wanted_unit(name: str) -> str:
    """SI unit in a channel's name; raises `InputError` where it is not "<sensor>.<quantity> [unit]"."""
    match = _NAME.fullmatch(name)
    if not match:
        raise InputError(f"channels.{name}: name it <sensor>.<quantity> [unit], as 'bogie.rate_pitch [rad/s]'")
    return match[1]


def numbers(
    column: Column, table: Table, lost: tuple[float | str, ...] = (), where: str = "of the channel"
) -> np.ndarray:
    """The column's numbers with NaN for lost ones, shape (n,), a copy; `where` says whose key `lost` is.

    Raises
    ------
    InputError : a cell is no number; the line gives its row.
    """
    values = _from_texts(column, table, lost, where) if isinstance(column.values, list) else column.values.copy()
    for marker in lost:
        if not isinstance(marker, str):
            values[values == marker] = np.nan
    return values


def convert(name: str, channel: Channel, table: Table, unit: str, notes: Notes) -> np.ndarray:
    """Values of the channel `name`, whose SI unit is `unit`; shape (n,).

    Raises
    ------
    InputError : the unit is not stated, unknown, of another dimension or contradicts the file's; a cell is no number.
    """
    column = table.columns[channel.column]
    values = numbers(column, table, channel.lost)
    infinite = np.isinf(values)
    if infinite.any():
        values[infinite] = np.nan
        notes.repair(f"{name}: {int(infinite.sum())} infinite values count as lost")
    if channel.unwrap is not None:
        values = _unwrapped(values, channel.unwrap, name, notes)
    conversion = converter(_unit(name, channel, column, notes), unit, name)
    with np.errstate(over="ignore", invalid="ignore"):
        values = channel.sign * conversion.to_si(channel.scale * values + channel.offset)
    if np.isinf(values).any():
        raise InputError(f"{name}: values overflow in {unit}; check scale, offset and the column '{channel.column}'")
    return values


def from_pulses(
    name: str, channel: Channel, table: Table, time: np.ndarray, radius: float | None, notes: Notes
) -> np.ndarray:
    """Speed from a wrapped count of pulses over the `time` since the row before, rad/s or m/s by the channel's name.

    The first row, and rows whose count stands for more than `fastest`, are lost. `radius` in m serves m/s and the
    limit.

    Raises
    ------
    InputError : the channel is no speed, no radius is known where it is needed, or a cell is no number.
    """
    pulses = channel.pulses
    assert pulses is not None
    unit = wanted_unit(name)
    if unit not in ("rad/s", "m/s"):
        raise InputError(f"{name}: pulses make a speed in rad/s or m/s; name the channel in one of these")
    radius = _radius(name, pulses, radius, unit, notes)
    counted = np.diff(numbers(table.columns[channel.column], table, channel.lost), prepend=np.nan) % pulses.modulus
    steps = np.diff(time, prepend=np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = counted * (2 * np.pi / pulses.per_revolution) / steps
    impossible = speed * (radius or 0.46) > pulses.fastest
    speed[impossible | ~(steps > 0)] = np.nan
    if impossible.any():
        where = table.line(int(impossible.argmax()))
        notes.repair(
            f"{name}: {int(impossible.sum())} counts stand for more than {pulses.fastest:g} m/s (the first in row "
            f"{where}); lost, as after a reset of the counter"
        )
    notes.assume(f"{name}: the count wraps at {pulses.modulus:g} at most once between two rows; its first row is lost")
    return channel.sign * speed * (radius if unit == "m/s" and radius else 1.0)


def _radius(name: str, pulses: Pulses, nominal: float | None, unit: str, notes: Notes) -> float | None:
    if pulses.radius is not None:
        return pulses.radius
    if nominal is not None:
        if unit == "m/s":
            notes.assume(f"{name}: wheel radius {nominal:g} m, the vehicle's nominal one")
        return nominal
    if unit == "m/s":
        raise InputError(f"{name}: no wheel radius; give pulses.radius or the vehicle's wheel_radius")
    notes.assume(f"{name}: wheel radius 0.46 m for the limit of {pulses.fastest:g} m/s")
    return None


def _unit(name: str, channel: Channel, column: Column, notes: Notes) -> str:
    """The stated unit, or the file's own."""
    stated, own = channel.unit, column.unit
    if stated is None:
        if own is None:
            raise InputError(f"{name}: neither the map nor the file states the unit of '{column.name}'; add 'unit'")
        notes.assume(f"{name}: unit '{own}', as the file states")
        return own
    if own is None or channel.other_unit_in_file:
        return stated
    try:
        other = parse_unit(own)
    except InputError:
        notes.assume(f"{name}: unit '{stated}' as the map says; the file's '{own}' is not known")
        return stated
    if not _same(other, parse_unit(stated)) and channel.scale == 1.0:
        raise InputError(
            f"{name}: the map says '{stated}', the file '{own}' for '{column.name}'; correct the map, or add "
            "'other_unit_in_file: true'"
        )
    return stated


def _same(first: Unit, second: Unit) -> bool:
    alike = math.isclose(first.factor, second.factor, rel_tol=1e-9)
    return first.dimension == second.dimension and alike and first.offset == second.offset


def _from_texts(column: Column, table: Table, lost: tuple[float | str, ...], where: str) -> np.ndarray:
    texts = column.values
    assert isinstance(texts, list)
    if column.fault is not None and "°" in column.fault[1]:
        return degrees(column.name, texts, table, lost)
    markers = {"", *(str(marker) for marker in lost)}
    row, cell = column.fault or (0, texts[0] if len(texts) else "")
    values = np.full(len(texts), np.nan)
    if column.fault is None:
        for row, cell in enumerate(texts):
            if cell not in markers:
                try:
                    values[row] = float(cell)
                except ValueError:
                    break
        else:
            return values
    shown = str(cell)[:40]
    raise InputError(
        f"column '{column.name}' row {table.line(row)} holds '{shown}', no number; mend it, or add it to 'lost' {where}"
    )


def _unwrapped(values: np.ndarray, modulus: float, name: str, notes: Notes) -> np.ndarray:
    """Values continued over the wraps: each step is the smallest one, to either side."""
    good = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[good])
    wraps = np.round(steps / modulus)
    if wraps.any():
        values[good[1:]] -= modulus * np.cumsum(wraps)
        notes.assume(f"{name}: wraps at {modulus:g} ({int(np.abs(wraps).sum())} times), steps are below half of that")
    return values
