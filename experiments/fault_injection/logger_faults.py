"""Seven more kinds of fault: clock rate, uncalibrated gyro, packets, byte order, unit, wrong axis."""

from itertools import permutations, product

import numpy as np

from experiments.fault_injection.faults import ACCELEROMETERS, BOXES, GYROS, TRANSDUCERS, Fault, Spoiler
from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.measurements import TIME
from railsim.sensors.errors import sample_at
from railsim.sensors.logger import reversed_bytes, word

_DEGREE = float(np.radians(1.0))
_SENSORS = [
    ACCELEROMETERS[:3], ACCELEROMETERS[3:], GYROS, *([one] for one in TRANSDUCERS), BOXES[:2], BOXES[2:4], BOXES[4:]
]  # fmt: skip
"""Channels of each sensor."""
_ON_BOGIE = [*ACCELEROMETERS, *GYROS, *TRANSDUCERS]


def clock_rate(spoiler: Spoiler) -> Fault:
    """The axleboxes' clock is 0.05 to 2 % slow or fast; rows after the end of the run are lost, or the last ones."""
    rate = spoiler.measured.rate(BOXES[0])
    table = spoiler.tables[rate]
    scale = float(np.exp(spoiler.rng.uniform(np.log(5e-4), np.log(0.02)))) * float(spoiler.rng.choice([-1.0, 1.0]))
    places = np.arange(table[TIME].size) * (1.0 + scale)
    kept = places <= table[TIME].size - 1
    for column in list(table):
        table[column] = table[column][kept] if column == TIME else sample_at(table[column], places)[kept]
    ends = float(table[TIME][0]), float(table[TIME][-1])
    return Fault("clock rate", (f"{TIME} at {rate:g} Hz",), *ends, f"{100 * scale:+.2g} %")


def gyro_bias(spoiler: Spoiler) -> Fault:
    """A gyro that nobody calibrated: 0.5 to 1.8 deg/s off, as seen on a train."""
    name, values, _ = spoiler.choose(GYROS)
    size = spoiler.rng.uniform(0.5, 1.8) * float(spoiler.rng.choice([-1.0, 1.0]))
    values += size * _DEGREE
    return spoiler.done("offset", (name,), slice(None), f"{size:+.2g} deg/s")


def _packets(spoiler: Spoiler) -> tuple[tuple[str, ...], float, int, np.ndarray]:
    """Channels of a packet (one sensor, or all of a table's), their rate, rows of a packet, first rows of some."""
    groups = [*_SENSORS, _ON_BOGIE, BOXES]
    names = groups[int(spoiler.rng.integers(len(groups)))]
    rate = spoiler.measured.rate(names[0])
    size = int(spoiler.rng.choice([16, 32, 64]))
    part = spoiler.stretch(rate, 2.0, 15.0)
    places = np.arange(part.start // size + 1, part.stop // size - 1, 3)
    count = min(places.size, int(spoiler.rng.integers(1, 6)))
    return tuple(names), rate, size, np.sort(spoiler.rng.choice(places, count, replace=False)) * size


def repeated(spoiler: Spoiler) -> Fault:
    """1 to 5 packets of 16 to 64 rows come twice: beside those that follow, or in the place of the next."""
    names, rate, size, firsts = _packets(spoiler)
    table = spoiler.tables[rate]
    count = table[TIME].size
    rows = np.arange(count)
    inserted = spoiler.rng.uniform() < 0.5
    if inserted:
        rows = np.insert(rows, np.repeat(firsts + size, size), (firsts[:, None] + np.arange(size)).ravel())[:count]
        firsts = firsts + size * np.arange(firsts.size)
    else:
        for first in firsts:
            rows[first + size : first + 2 * size] = rows[first : first + size]
    for name in names:
        table[name] = table[name][rows]
    at = (firsts[:, None] + size + np.arange(size)).ravel()
    words = "put in" if inserted else "in place of the next"
    return spoiler.done("repeated", names, at[at < count], f"{firsts.size} of {size} rows, {words}")


def reordered(spoiler: Spoiler) -> Fault:
    """1 to 5 packets of 16 to 64 rows are overtaken by the next."""
    names, rate, size, firsts = _packets(spoiler)
    table = spoiler.tables[rate]
    rows = np.arange(table[TIME].size)
    for first in firsts:
        rows[first : first + 2 * size] = np.roll(rows[first : first + 2 * size], size)
    for name in names:
        table[name] = table[name][rows]
    changed = np.flatnonzero(rows != np.arange(rows.size))
    return spoiler.done("reordered", names, changed, f"{firsts.size} of {size} rows")


def byte_order(spoiler: Spoiler) -> Fault:
    """The words of a sensor are read in the wrong byte order."""
    names = _SENSORS[int(spoiler.rng.integers(len(_SENSORS)))]
    table = spoiler.tables[spoiler.measured.rate(names[0])]
    sheet = data_sheet(spoiler.measured.about, names[0])
    bits = word(sheet.error("resolution"), sheet.error("range"))
    for name in names:
        table[name] = reversed_bytes(table[name], sheet.error("resolution"), bits)
    return spoiler.done("byte order", tuple(names), slice(None), f"{bits} bits")


def unit(spoiler: Spoiler) -> Fault:
    """An accelerometer writes g, or mg, where m/s2 is stated."""
    groups = [names for names in _SENSORS if "acceleration" in names[0]]
    names = groups[int(spoiler.rng.integers(len(groups)))]
    table = spoiler.tables[spoiler.measured.rate(names[0])]
    factor, words = ((1.0 / GRAVITY, "g"), (1e3 / GRAVITY, "mg"))[int(spoiler.rng.uniform() < 0.3)]
    for name in names:
        table[name] *= factor
    return spoiler.done("unit", tuple(names), slice(None), words)


def turned(spoiler: Spoiler) -> Fault:
    """A box is mounted with another axis forward or up: one of 23 right-angled turns; the gyro's axes go with it."""
    boxes = [[ACCELEROMETERS[:3], GYROS], [ACCELEROMETERS[3:]]]
    box = boxes[int(spoiler.rng.integers(2))]
    matrices = [np.diag(signs)[list(order)] for order, signs in product(permutations(range(3)), _SIGNS)]
    matrices = [one for one in matrices if np.linalg.det(one) > 0.0 and np.trace(one) < 2.5]
    matrix = matrices[int(spoiler.rng.integers(len(matrices)))]
    table = spoiler.tables[spoiler.measured.rate(box[0][0])]
    for names in box:
        values = matrix @ np.array([table[name] for name in names])
        for name, row in zip(names, values, strict=True):
            table[name] = np.ascontiguousarray(row)
    words = " ".join("-" * int(row.sum() < 0) + "xyz"[int(np.argmax(np.abs(row)))] for row in matrix)
    return spoiler.done("turned", tuple(name for names in box for name in names), slice(None), words)


_SIGNS = list(product((1.0, -1.0), repeat=3))
