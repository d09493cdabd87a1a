"""What a record says of the unknowns of a plane: level of the track, size of what disturbs, parameters of the vehicle.

All of them are found together, as the largest posterior under Whittle's likelihood (`whittle`), with the field's spread
of each as its prior. What is found of the vehicle and what it leaves open go into the filter and into its deviations.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from estimators.filters.information import changed, sensor_noise
from estimators.signals.bands import BANDS, Band
from estimators.speed.odometry import Odometry
from estimators.track.plane import Plane
from estimators.track.whittle import FITTED, Problem, Spectra, chi_square, even_speed, fit, spectra
from estimators.vehicle.state_space import Transfer

LEVELS = (-22.0, -9.0)  # natural logarithm of the level in m rad: 3e-10 to 1e-4; ERRI's lie at -15
SIZES = (-8.0, 5.0)  # natural logarithms of the least and the largest size of a disturbance
PARAMETERS = (-4.0, 1.6)  # natural logarithms of factors on parameters: from nothing left to five times
STEADY = 0.2  # m/s2; less hardly nods a vehicle: a choice, a fifth of what service brakes do
TRUST_SPREAD, TRUST = 1.0, (np.log(0.3), 1.5)
"""The stated errors of scales, distance and model are taken to be known to a factor e; bounds of its logarithm."""


class Misfit(NamedTuple):
    """Self-check of a fit in one band.

    Attributes
    ----------
    ratio : mean square of the whitened readings, 1 where the model is right.
    deviations : its distance from 1 in standard deviations of what chance makes (chi-square).
    """

    ratio: float
    deviations: float


class PlaneFit(NamedTuple):
    """What was found.

    Attributes
    ----------
    plane : with the parameters found. levels : of the quantities of the track, shape (q,).
    sizes : of the disturbances, by kind of place. misfit : by band, empty where too little was measured for a fit.
    cost : minus the logarithm of the posterior, to compare planes with the same readings; 0 without a fit.
    """

    plane: Plane
    levels: np.ndarray
    sizes: list[np.ndarray]
    misfit: dict[str, Misfit]
    cost: float


def fit_plane(plane: Plane, odometry: Odometry, kind: np.ndarray, distance_error: float) -> PlaneFit:
    """Find the unknowns; `kind` : of each place.

    The vehicle and the track's levels are those of the first kind that a record holds, straight track if there is any.
    Places of another kind have local disturbances of their own size. Where the train is braked or driven, bodies nod
    and pull at each other; it is looked at only if there is nothing else.
    """
    levels = np.array([prior.amplitude for prior in plane.priors])
    groups = np.array([one.sized_as for one in plane.regimes])
    sizes, misfit = dict[int, np.ndarray](), dict[str, Misfit]()
    size = np.array([one.size for one in plane.disturbances])
    steady = np.abs(np.gradient(0.5 * even_speed(odometry) ** 2, odometry.spacing)) < STEADY
    known, cost = False, 0.0
    for number in dict.fromkeys(sorted(groups)):
        here = groups[kind] == number
        seen = spectra(plane.observations, odometry, here & steady) or spectra(plane.observations, odometry, here)
        if seen is None:
            sizes[number] = size
            continue
        fixed = [number > 0 and not one.local for one in plane.disturbances]
        search = _Search(plane, plane.at(number), seen, distance_error, levels, size, np.array(fixed), known)
        found = fit(search.problem, search.starts)
        levels, sizes[number] = search.levels(found.x), search.sizes(found.x)
        size = sizes[number] if number == 0 else size
        if not known:
            covariance = found.covariance[search.first :, search.first :]
            plane = plane.found(found.x[search.first :], covariance, float(np.exp(found.x[search.first - 1])))
            misfit = {name: Misfit(*chi_square(seen, found, band)) for name, band in BANDS.items() if _seen(band)}
            cost = found.cost
        known = True
    return PlaneFit(plane, levels, [sizes[number] for number in groups], misfit, cost)


def _seen(band: Band) -> bool:
    """Whether the fit looks into the band."""
    return band.shortest < FITTED[1]


class _AtSpeed:
    """Spectra of the readings by everything that is unknown, at one speed and the wavenumbers of its bins."""

    def __init__(self, whole: Plane, plane: Plane, speed: float, k: np.ndarray, distance_error: float) -> None:
        self.plane, self.speed, self.k = plane, speed, k
        self._densities = [prior.density(k) / prior.amplitude for prior in plane.priors]
        amplitudes = np.array([prior.amplitude for prior in plane.priors])
        self._usual = [one / amplitudes[:, None] for one in whole.usual(speed)]
        self._own = [one.density(k) for one in plane.disturbances]
        self._late = np.stack([one.delay(k) for one in plane.observations], axis=1)[:, :, None]
        self._lag = np.exp(-1j * k * plane.wheelbase)[:, None, None]
        self._wrong = self._off(distance_error)

    def noise(self) -> np.ndarray:
        """Of the sensors, shape (b, m, m)."""
        return sensor_noise(self.k, self.plane.noise(), self.speed)

    def parts(self, logarithms: np.ndarray) -> np.ndarray:
        """By the track, by what the model has wrong, by the disturbances; for each quantity, shape (c, b, m, m)."""
        p = changed(self.plane.vehicle, dict(zip(self.plane.fitted, logarithms, strict=True)))
        transfer = self._transfer(p)
        if self.plane.whole is not None:
            gain = self._late * self.plane.whole(p, self.speed, self.k)
        else:
            lead, trail = np.split(transfer.of_inputs, 2, axis=2)
            gain = lead + trail * self._lag
        parts = [*self._tracks(gain), *self._wrong]
        for disturbance, density, usual in zip(self.plane.disturbances, self._own, self._usual, strict=True):
            parts += [
                disturbance.spectrum(density, transfer, of) if of.any() else np.zeros_like(parts[0]) for of in usual
            ]
        return np.array(parts)

    def _tracks(self, gain: np.ndarray) -> list[np.ndarray]:
        """Spectra of the readings by each quantity of level 1 through a gain, shape (b, m, quantities)."""
        return [
            (gain[:, :, q, None] * density[:, None, None]) @ gain[:, None, :, q].conj()
            for q, density in enumerate(self._densities)
        ]

    def _transfer(self, p: dict[str, float]) -> Transfer:
        """Responses of the readings, with their delays, to inputs and forces."""
        found = self.plane.system(p, self.speed).transfer(self.k * self.speed)
        return Transfer(*(self._late * one for one in found))

    def _off(self, distance_error: float) -> list[np.ndarray]:
        """The same as `_tracks` by what the model has wrong: distance, scales and what it leaves out."""
        plane = self.plane
        lead, trail = np.split(self._transfer(plane.vehicle).of_inputs, 2, axis=2)
        H = lead + trail * self._lag
        scales = np.array([np.hypot(one.scale, plane.structure) for one in plane.observations])
        base = self.k * plane.wheelbase
        late = trail * (np.exp(-1j * base * (1.0 + distance_error)) - np.exp(-1j * base))[:, None, None]
        total = self._tracks(late)
        for row, scale in zip(np.eye(len(scales)), scales, strict=True):
            total = [one + more for one, more in zip(total, self._tracks(H * (scale * row)[:, None]), strict=True)]
        return total


class _Search:
    """The problem of one kind of place: x holds levels, sizes, trust and the logarithms of the fitted parameters."""

    def __init__(
        self,
        whole: Plane,
        plane: Plane,
        seen: Spectra,
        distance_error: float,
        levels: np.ndarray,
        size: np.ndarray,
        fixed: np.ndarray,
        known: bool,
    ) -> None:
        self.plane = plane
        self.quantities, self.disturbed = len(levels), len(plane.disturbances)
        self.first = self.quantities + self.disturbed + 1
        self._at = [
            _AtSpeed(whole, plane, speed, seen.wavenumber[bins], distance_error) for speed, bins in seen.classes
        ]
        self.problem = self._problem(seen, levels, size, fixed, known)
        self.starts = self._starts(seen, levels, known)

    def levels(self, x: np.ndarray) -> np.ndarray:
        return np.exp(x[: self.quantities])

    def sizes(self, x: np.ndarray) -> np.ndarray:
        return np.exp(x[self.quantities : self.first - 1])

    def _parts(self, logarithms: np.ndarray) -> np.ndarray:
        return np.concatenate([one.parts(logarithms) for one in self._at], axis=1)

    def _problem(self, seen: Spectra, levels: np.ndarray, size: np.ndarray, fixed: np.ndarray, known: bool) -> Problem:
        q, d = self.quantities, self.disturbed
        spreads = np.array(list(self.plane.fitted.values()))
        count = self.first + len(spreads)
        exponents = np.zeros((2 * q + q * d, count))
        for quantity in range(q):
            exponents[quantity, quantity] = exponents[q + quantity, quantity] = 1.0
            exponents[q + quantity, self.first - 1] = 2.0
            for number in range(d):
                row = 2 * q + number * q + quantity
                exponents[row, quantity], exponents[row, q + number] = 1.0, 2.0
        disturbances = self.plane.disturbances
        trust = np.log(self.plane.trust)
        mean = np.concatenate([np.log(levels), np.log(size), [trust], 0.0 * spreads])
        of_sizes = np.where(fixed, 0.0, [one.spread for one in disturbances])
        spread = np.concatenate([np.full(q, np.inf), of_sizes, [TRUST_SPREAD], spreads])
        if known:
            spread[[*range(q), *range(self.first - 1, count)]] = 0.0
        low = np.array([*[LEVELS[0]] * q, *[SIZES[0]] * d, TRUST[0], *[PARAMETERS[0]] * len(spreads)])
        high = np.array([*[LEVELS[1]] * q, *[SIZES[1]] * d, TRUST[1], *[PARAMETERS[1]] * len(spreads)])
        noise = np.concatenate([one.noise() for one in self._at])
        return Problem(seen, noise, exponents, self._parts, len(spreads), mean, spread, low, high)

    def _starts(self, seen: Spectra, levels: np.ndarray, known: bool) -> Sequence[np.ndarray]:
        """One for each number of sizes to begin with, the levels by what was seen."""
        first = self.problem.mean.copy()
        if not known:
            parts = self._parts(first[self.first :])
            expected = np.einsum("q,qbmm->m", levels, parts[: self.quantities]).real
            ratio = np.einsum("bmm->m", seen.density).real / expected
            first[: self.quantities] += np.median(np.log(ratio))
        starts = [first]
        for number, one in enumerate(self.plane.disturbances):
            for place, begin in enumerate(one.begins):
                while len(starts) <= place:
                    starts.append(first.copy())
                if self.problem.spread[self.quantities + number] > 0.0:
                    starts[place][self.quantities + number] = np.log(begin)
        for change in () if known else self.plane.begins:
            start = starts[-1].copy()
            start[self.first :] = [change.get(name, 0.0) for name in self.plane.fitted]
            starts.append(start)
        return starts
