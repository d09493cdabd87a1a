"""Forces of the rails on the wheelsets by a filter that floats on its contacts: what three estimators share."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.adhesion.channels import RATE, WHEELSETS, LateralRecord
from estimators.adhesion.creep_model import (
    BODIES,
    COUNT,
    FORCES,
    ROLL_BODIES,
    SECONDARY,
    Floating,
    Shaping,
    floating,
)
from estimators.filters.dropout_filter import run_filter, shifted
from estimators.filters.dropout_smoother import smooth
from estimators.vehicle.plan_view import COORDINATES

FORCE_NAMES = tuple(
    f"{wheelset}.{quantity}"
    for wheelset in WHEELSETS
    for quantity in ("lateral_creep_force [N]", "creep_yaw_moment [N m]")
)
MOTIONS = (
    "wheelset1.lateral_creepage [-]",
    "wheelset2.lateral_creepage [-]",
    "wheelset1.yaw_rate [rad/s]",
    "wheelset2.yaw_rate [rad/s]",
    "bogie.acceleration_y [m/s2]",
    "bogie.yaw_rate [rad/s]",
    "body.acceleration_y [m/s2]",
)
SIGNALS = FORCE_NAMES + MOTIONS
BOGIE, BOGIE_YAW, BODY = (COORDINATES.index(name) for name in ("bogie.y", "bogie.yaw", "body.y"))


@dataclass(frozen=True)
class Forces:
    """What the filter found, over a uniform grid of 256 Hz, all high-passed.

    Attributes
    ----------
    record : what it took.
    signals : by the order of `SIGNALS`, (n, 11). spread : standard deviations, (n, 11).
    parameters : the vehicle's.
    """

    record: LateralRecord
    signals: np.ndarray
    spread: np.ndarray
    parameters: dict[str, float]

    @property
    def time(self) -> np.ndarray:
        """Of the samples, s, (n,)."""
        return self.record.time

    def complete(self, channels: Sequence[str]) -> np.ndarray:
        """Where all of these channels were in use, (n,)."""
        columns = [self.record.names.index(name) for name in channels]
        return np.asarray(np.isfinite(self.record.samples[:, columns]).all(axis=1))


def find_forces(record: LateralRecord, p: dict[str, float], shaping: Shaping) -> Forces:
    """Run the filter over the record of one bogie.

    Parameters
    ----------
    p : parameters of the half vehicle.
    """
    model = floating(p, RATE, shaping)
    H, D = record.observation(model)
    filtered, spread = run_filter(
        np.ascontiguousarray(model.A),
        np.ascontiguousarray(model.Q),
        np.ascontiguousarray(model.B),
        H,
        D,
        record.R,
        np.zeros(len(model.A)),
        model.start.copy(),
        shifted(record.inputs),
        record.inputs,
        record.samples,
        _rows(model),
    )
    return Forces(record, *_signals(filtered, spread, record, model, p), p)


def smoothed_forces(record: LateralRecord, p: dict[str, float], shaping: Shaping) -> Forces:
    """As `find_forces`, each sample by what follows it as well.

    An unknown force that cannot be told from one of `SIGNALS` stays in it, and in its stated deviation.
    """
    model = floating(p, RATE, shaping)
    H, D = record.observation(model)
    rows, whole = _rows(model), [(one.within, one.std) for one in shaping.others]
    for state, (signal, _) in enumerate(whole, SECONDARY + 1):
        if signal is not None:
            rows[signal, state] = 1.0
    values, spread = smooth(
        model.A, model.Q, model.B, H, D, record.R, model.start, record.inputs, record.samples, rows, RATE
    )
    for signal, std in whole:
        if signal is not None:
            spread[:, signal] = np.hypot(spread[:, signal], std)
    return Forces(record, *_signals(values, spread, record, model, p), p)


def _rows(model: Floating) -> np.ndarray:
    """States or rows behind `SIGNALS`, in between the lateral rate and the yaw of each wheelset."""
    rows = np.zeros((13, len(model.A)))
    rows[:4, FORCES] = np.eye(4)
    for number, wheelset in enumerate(WHEELSETS):
        y, yaw = BODIES[wheelset]
        rows[4 + number, COUNT + y] = 1.0
        rows[6 + number, int(yaw or 0)] = 1.0
        rows[8 + number, COUNT + int(yaw or 0)] = 1.0
    rows[10], rows[12] = model.acceleration[BOGIE], model.acceleration[BODY]
    rows[11, COUNT + BOGIE_YAW] = 1.0
    return rows


def _signals(
    filtered: np.ndarray, spread: np.ndarray, record: LateralRecord, model: Floating, p: dict[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """`SIGNALS` from the rows; creepage (y' + r phi') / V - psi, its spread as if y' and psi were independent."""
    speed = record.speed[:, None]
    rolling = record.inputs[:, [len(ROLL_BODIES) + ROLL_BODIES.index(one) for one in WHEELSETS]]
    creepage = (filtered[:, 4:6] + p["wheel_radius"] * rolling) / speed - filtered[:, 6:8]
    creepage_spread = np.hypot(spread[:, 4:6] / speed, spread[:, 6:8])
    filtered[:, 10] += record.inputs @ model.acceleration_input[BOGIE]
    filtered[:, 12] += record.inputs @ model.acceleration_input[BODY]
    signals = np.hstack([filtered[:, :4], creepage, filtered[:, 8:]])
    return signals, np.hstack([spread[:, :4], creepage_spread, spread[:, 8:]])


class Segments:
    """Signals in Fourier's sense, segment by segment (Welch, Hann): windows that overlap share their segments.

    Parameters
    ----------
    signals : (n, c). length : samples of a segment. highest : only frequencies below it, Hz.
    """

    def __init__(self, signals: np.ndarray, length: int, highest: float = np.inf) -> None:
        self._signals, self._length, self._window = signals, length, np.hanning(length)
        frequency = np.fft.rfftfreq(length, 1.0 / RATE)
        self._wanted = frequency < highest
        self.frequency = frequency[self._wanted]
        self._found: dict[int, np.ndarray] = {}

    def density(self, first: int, last: int) -> np.ndarray:
        """Cross spectral densities of the samples `first` to `last` - 1, half overlap, one-sided, shape (f, c, c); rows
        conjugate.
        """
        starts = range(first, last - self._length + 1, self._length // 2)
        for start in starts:
            if start not in self._found:
                self._found[start] = self._transformed(start)
        parts = np.stack([self._found[start] for start in starts])
        density = np.einsum("kfa,kfb->fab", parts.conj(), parts)
        return density * (2.0 / (len(parts) * RATE * float(np.sum(self._window**2))))

    def _transformed(self, start: int) -> np.ndarray:
        part = self._signals[start : start + self._length]
        return np.fft.rfft((part - part.mean(axis=0)) * self._window[:, None], axis=0)[self._wanted]


def spectra(signals: np.ndarray, length: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, Hz, (f,), and cross spectral densities (f, c, c) of all `signals` (n, c): see `Segments`."""
    segments = Segments(signals, length)
    return segments.frequency, segments.density(0, len(signals))


def force_spectra(forces: Forces, length: int = 1024, highest: float = 15.0) -> dict[str, Any]:
    """One-sided densities of a bogie's estimated forces where they are all known, as plain lists by name."""
    good = np.isfinite(forces.signals[:, :4]).all(axis=1)
    if good.sum() < length:
        return {}
    frequency, density = spectra(forces.signals[good][:, :4], length)
    kept = frequency <= highest
    by_name = {
        forces.record.place.column(name): np.real(density[kept, i, i]).tolist() for i, name in enumerate(FORCE_NAMES)
    }
    return {"frequency [Hz]": frequency[kept].tolist()} | by_name
