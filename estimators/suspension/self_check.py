"""Whether readings are as far from a filter's model as it expects, so that what it assumes may hold.

The filters' innovations cannot tell: readings are sampled faster than they change, and what the model leaves of them is
white in the filters and band-limited in the record. So their model is held against the Fourier coefficients within the
band (`spectral_likelihood`): Y' S^-1 Y is chi-square distributed where it holds (Bar-Shalom, Li and Kirubarajan 2001,
section 5.4, for innovations).
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from estimators.signals.windows import HANN
from estimators.suspension.base import SETTLE, SLOWEST, TUNED, Problem
from estimators.suspension.spectral_likelihood import IMPROBABLE, Likelihood, densities
from estimators.suspension.spectral_record import transformed
from estimators.suspension.spectral_vehicle import CONICITY, LATERAL, YAW, nominal_vehicle
from estimators.vehicle.lateral_frequency import respond

WINDOW = 10.0  # s that are looked at, up to each stretch (choice)
LEAST = 5.0  # s, the same at the beginning (choice)
PADDING = 10.0  # s of nothing behind the record: longer than the vehicle remembers
GRID = 0.02  # of the box; models are those of the nearest grid point
SPEED_BIN = 0.2  # m/s; models are those of the nearest speed
HIGHEST = 12.0  # Hz; the band-pass leaves nothing above
BAND = (0.3, 7.5)  # Hz, as `suspension_spectral`
NOTHING = 1e-9  # of the track's power: the error of a track that is known exactly


class Check(NamedTuple):
    """For every stretch: misfit over what is expected, NaN where nothing is known, and whether the model holds; shapes
    (stretches,).
    """

    ratio: np.ndarray
    holds: np.ndarray

    def doubt(self) -> str:
        """Why no verdict is given at the end, in words; empty where the model holds."""
        if self.holds[-1]:
            return ""
        if np.isnan(self.ratio[-1]):
            return "the filter has diverged"
        return (
            f"readings differ from the filter's model by {self.ratio[-1]:.1f} times the expected power (chi-square): "
            "load, rails, wheels or vehicle are not as it assumes; use suspension_spectral, which fits them"
        )


def check(problem: Problem, estimates: np.ndarray) -> Check:
    """Model at the estimate of every stretch, shape (stretches, 3), against the `WINDOW` of readings before its end.

    One estimate, shape (1, 3), is that of the whole record.
    """
    ends, rate = [last for _, last in problem.stretches], problem.record.rate
    ratio, holds = np.full(len(ends), np.nan), np.ones(len(ends), dtype=bool)
    model, begin = _Model(problem), round(SETTLE * rate)
    if len(estimates) == 1:
        ratio[:], holds[:] = model.misfit(estimates[0], begin, ends[-1])
        return Check(ratio, holds)
    for k, (last, estimate) in enumerate(zip(ends, estimates, strict=True)):
        ratio[k], holds[k] = model.misfit(estimate, max(begin, last - round(WINDOW * rate)), last)
    return Check(ratio, holds)


class _Model:
    """The filters' model against the record.

    What the known track makes is taken off over time, so that windows smear only what the model leaves.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem, self._likelihood = problem, _likelihood(problem)
        rails = problem.record.inputs[:, :4]
        count = len(rails) + round(PADDING * problem.record.rate)
        self._rails, self._count = np.fft.rfft(rails, count, axis=0), count
        self._residuals: dict[tuple[tuple[int, ...], float], np.ndarray] = {}

    def misfit(self, estimate: np.ndarray, first: int, last: int) -> tuple[float, bool]:
        """Misfit over what is expected, and whether that is probable; not known where too little was read."""
        record, settings = self._problem.record, self._problem.settings
        if not np.isfinite(estimate).all():
            return np.nan, False
        speed = record.speed[first:last]
        used = tuple(int(j) for j in np.flatnonzero(record.good[first:last].all(axis=0)))
        if not used or last - first < LEAST * record.rate or not np.isfinite(speed).all() or speed.min() < SLOWEST:
            return np.nan, True
        size = np.where(self._problem.high > self._problem.low, self._problem.high - self._problem.low, 1.0)
        cell = tuple(np.rint((estimate - self._problem.low) / size / GRID).astype(int).tolist())
        near = np.clip(self._problem.low + np.array(cell) * GRID * size, self._problem.low, self._problem.high)
        values, rounded = self._values(near), round(float(speed.mean()) / SPEED_BIN) * SPEED_BIN
        if (cell, rounded) not in self._residuals:
            self._residuals[cell, rounded] = record.readings - self._by_track(values, rounded)
        readings = self._residuals[cell, rounded][first:last]
        rest = replace(record, readings=np.zeros_like(record.readings), inputs=np.zeros_like(record.inputs))
        rest.readings[first:last] = readings
        stretch = transformed(rest, used, first, last, BAND, (settings.high_pass, settings.low_pass))
        mean, _ = self._likelihood.on([stretch]).whiteness(values)
        count = len(stretch.frequency) * len(used) / HANN
        return mean, bool(chi2.sf(2.0 * mean * count, 2.0 * count) >= IMPROBABLE)

    def _by_track(self, values: np.ndarray, speed: float) -> np.ndarray:
        """Readings that the known track makes, shape (n, m)."""
        vehicle, record = self._likelihood.vehicle, self._problem.record
        frequency = np.fft.rfftfreq(self._count, 1.0 / record.rate)
        inside = (frequency > 0.0) & (frequency < HIGHEST)
        model = vehicle.matrices(values, speed, range(len(record.channels)))
        response = respond(model, vehicle.dampers, vehicle.shares(values), 2j * np.pi * frequency[inside])
        spectrum = np.zeros((len(frequency), len(record.channels)), dtype=complex)
        spectrum[inside] = np.einsum("kij,kj->ki", response.rails, self._rails[inside])
        return np.fft.irfft(spectrum, self._count, axis=0)[: len(record.time)]

    def _values(self, estimate: np.ndarray) -> np.ndarray:
        """The likelihood's unknowns at an estimate; all else is as built."""
        built = np.where(self._problem.nominal > 0.0, self._problem.nominal, 1.0)
        by_name = {
            LATERAL: estimate[0] / built[0],
            YAW: estimate[1] / built[1],
            CONICITY: float(np.log(estimate[2] / built[2])),
        }
        return np.array([by_name.get(one.name, 0.0) for one in self._likelihood.unknowns])


def _likelihood(problem: Problem) -> Likelihood:
    """The filters' model: half a vehicle, and their noise."""
    settings, record = problem.settings, problem.record
    vehicle = nominal_vehicle(problem.vehicle, {}, record.channels, False, settings.creep, (1.0, 1.0))
    noise = (record.noise**2 + settings.model_errors(record.channels) ** 2 * record.rate / TUNED) * 2.0 / record.rate
    share = {"exact": NOTHING, "uncertain": settings.track_error, "unknown": settings.track_level}[settings.track]
    return Likelihood(vehicle, [], densities(vehicle, settings.forces(problem.vehicle), noise, settings.tracks(share)))
