"""Likelihood of a vehicle's unknowns by the Fourier coefficients of readings (Whittle 1953), with a known mean.

With Y the readings' coefficients, U those of the known track, e the error of the known track, f unknown forces,

    Y = H U + h e + G f + n,   S = sum h S_e h' + G S_f G' + S_n,   -log L = sum log det S + (Y - H U)' S^-1 (Y - H U).

Levels of the forces, of the readings' errors and of the track's error are unknown as well. Neighbouring coefficients
under a Hann window are correlated: their sum counts by 1 / (1 + 2 (4/9 + 1/36)). Maximum posterior by Fisher scoring,
damped as of Levenberg and Marquardt.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimators.filters.track_spectrum import TrackSpectrum
from estimators.signals.windows import HANN
from estimators.suspension.spectral_record import Stretch
from estimators.suspension.spectral_vehicle import (
    CONSIDERED,
    LATERAL,
    YAW,
    Nominal,
    Unknown,
)
from estimators.vehicle.lateral_frequency import Lateral, Response, bogies_of, coordinates_of, damped, moved, respond

LEVEL_STD, LEVEL_BOUND = 2.0, 6.0  # of the logarithms of levels: a factor of seven either way (choice)
IMPROBABLE = 1e-4  # chance of whitened residuals so large where the model holds (choice)
STEP = 1e-3  # of the unknowns, for slopes of the matrices
MOST_STEPS, ENOUGH = 100, 0.02  # iterations; gain of the cost below which they end
FORCES = ("forces on wheelsets", "forces on bogies", "forces on the body")
RAILS = ("lateral error of the track", "cross-level error of the track")
KINDS = (
    ("wheelset", "acceleration_y"), ("wheelset", "rate_yaw"), ("bogie", "acceleration_y"), ("bogie", "rate_yaw"),
    ("body", "acceleration_y"),
)  # fmt: skip
"""Kinds of readings, whose errors have spectra of their own."""
KNOTS = (0.3, 0.9, 2.6, 7.6)
"""Hz; between them the logarithm of an error's spectrum goes in straight lines over that of the frequency (choice)."""
LEVELS = (*FORCES, *RAILS, *(f"errors of {body}.{kind} at {knot:g} Hz" for body, kind in KINDS for knot in KNOTS))
SHAPES = len(FORCES) + len(RAILS)
TRACK = slice(len(FORCES), SHAPES)
BANDS = (0.0, 0.75, 1.5, 3.0, np.inf)
"""Hz; octaves of the self-check."""


class Levels(NamedTuple):
    """Densities, one-sided, that the levels multiply.

    Attributes
    ----------
    forces : on the coordinates, shape (n,). force_group : level of each, shape (n,).
    readings : of each channel, shape (m,). reading_kind : out of `KINDS`, shape (m,).
    track : spectra of lateral position and roll of what is not known of the track.
    """

    forces: np.ndarray
    force_group: np.ndarray
    readings: np.ndarray
    reading_kind: np.ndarray
    track: tuple[TrackSpectrum, TrackSpectrum]


class Cell(NamedTuple):
    """Squares of whitened residuals of a channel in a band of `BANDS`: their sum and number."""

    channel: int
    band: int
    total: float
    number: int


@dataclass(frozen=True)
class Mode:
    """A maximum of the posterior.

    Attributes
    ----------
    values : unknowns, then levels. cost : minus logarithm of the posterior density there. information : Fisher's, with
        the prior's. left : what a step of Newton's method would still gain of the cost.
    """

    values: np.ndarray
    cost: float
    information: np.ndarray
    left: float


class _Part(NamedTuple):
    """A stretch with its transfer functions and covariances at some values."""

    model: Lateral
    response: Response
    S: np.ndarray
    size: np.ndarray
    inverse: np.ndarray
    residual: np.ndarray
    logs: np.ndarray


class Likelihood:
    """Posterior of a vehicle's unknowns and levels.

    Parameters
    ----------
    vehicle : nominal. stretches : of the record. levels : densities at level 1.
    """

    def __init__(self, vehicle: Nominal, stretches: Sequence[Stretch], levels: Levels) -> None:
        self.vehicle, self.stretches, self.levels = vehicle, stretches, levels
        names = tuple(Unknown(name, 0.0, LEVEL_STD, -LEVEL_BOUND, LEVEL_BOUND) for name in LEVELS)
        self.unknowns = (*vehicle.unknowns, *names)
        self.count = len(vehicle.unknowns)
        self.mean, self.std, self.low, self.high = (
            np.array([getattr(one, part) for one in self.unknowns]) for part in ("mean", "std", "low", "high")
        )

    def on(self, stretches: Sequence[Stretch]) -> "Likelihood":
        """The same of other stretches."""
        return Likelihood(self.vehicle, stretches, self.levels)

    def parts(self, values: np.ndarray) -> list[_Part]:
        """Everything at some values."""
        return [self._part(values, one) for one in self.stretches]

    def cost(self, values: np.ndarray, parts: Sequence[_Part]) -> float:
        """Minus logarithm of the posterior density."""
        total = sum(float((one.logs + self._misfit(one).sum(axis=1)).sum()) for one in parts)
        return total / HANN + float(np.sum(((values - self.mean) / self.std) ** 2)) / 2.0

    @staticmethod
    def _misfit(part: _Part) -> np.ndarray:
        weighted = np.einsum("kij,kj->ki", part.inverse, part.residual)
        return (part.residual.conj() * weighted).real

    def scoring(
        self, values: np.ndarray, parts: Sequence[_Part], considered: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Slope of the cost and Fisher information; with `considered`, of these parameters too, after the unknowns."""
        slopes, size = [], 0
        for part, stretch in zip(parts, self.stretches, strict=True):
            slopes.append(self._slopes(values, part, stretch, considered))
            size = len(slopes[-1])
        gradient, information = np.zeros(size), np.zeros((size, size))
        for part, rows in zip(parts, slopes, strict=True):
            weighted = np.einsum("kij,kj->ki", part.inverse, part.residual)
            means = np.stack([mean for mean, _ in rows])
            spreads = np.stack([np.matmul(part.inverse, spread) for _, spread in rows])
            pulls = np.einsum("pkij,kj->pki", np.stack([spread for _, spread in rows]), weighted)
            gradient += np.real(np.einsum("pkii->p", spreads) - np.einsum("ki,pki->p", weighted.conj(), pulls))
            gradient -= 2.0 * np.real(np.einsum("ki,pki->p", weighted.conj(), means))
            leaned = np.einsum("kij,pkj->pki", part.inverse, means)
            flat, turned = spreads.reshape(size, -1), np.swapaxes(spreads, 2, 3).reshape(size, -1)
            information += np.real(flat @ turned.T)
            information += 2.0 * np.real(leaned.reshape(size, -1).conj() @ means.reshape(size, -1).T)
        gradient, information = gradient / HANN, information / HANN
        own = len(self.unknowns)
        gradient[:own] += (values - self.mean) / self.std**2
        information[np.arange(own), np.arange(own)] += 1.0 / self.std**2
        return gradient, information

    def fit(self, start: np.ndarray) -> Mode:
        """Nearest maximum of the posterior."""
        values = np.clip(start, self.low, self.high)
        parts = self.parts(values)
        cost, damping = self.cost(values, parts), 1e-2
        slope, information = self.scoring(values, parts)
        for _ in range(MOST_STEPS):
            step = self._step(values, slope, information, damping)
            tried = np.clip(values + step, self.low, self.high)
            there = self.parts(tried)
            lower = self.cost(tried, there)
            if lower < cost:
                gained, values, parts, cost = cost - lower, tried, there, lower
                damping = max(damping / 10.0, 1e-6)
                slope, information = self.scoring(values, parts)
                if gained < ENOUGH:
                    break
            else:
                damping *= 10.0
                if damping > 1e6:
                    break
        step = self._step(values, slope, information, 0.0)
        return Mode(values, cost, information, -0.5 * float(slope @ step))

    def _step(self, values: np.ndarray, slope: np.ndarray, information: np.ndarray, damping: float) -> np.ndarray:
        free = ~(((values <= self.low) & (slope > 0.0)) | ((values >= self.high) & (slope < 0.0)))
        step = np.zeros(len(values))
        matrix = information[np.ix_(free, free)]
        step[free] = -np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), slope[free])
        return step

    def covariance(self, mode: Mode, inflation: float = 1.0) -> np.ndarray:
        """Of the vehicle's unknowns: that of the posterior, and what the considered parameters add (Schmidt 1966).

        Parameters
        ----------
        inflation : of the posterior's part, where residuals are larger than the model has them.
        """
        _, whole = self.scoring(mode.values, self.parts(mode.values), considered=True)
        own, names = len(self.unknowns), considered(self.vehicle)
        inverse = np.linalg.inv(whole[:own, :own])
        follows = inverse @ whole[:own, own:] * np.array([CONSIDERED[name] for name in names])
        return (inflation * inverse + follows @ follows.T)[: self.count, : self.count]

    def misfit(self, mode: Mode) -> list[Cell]:
        """Whitened residuals by channel and band.

        A channel's residual is what the other channels leave of it: e = (S^-1 r) / sqrt(S^-1), whose square is
        exponentially distributed with mean 1 where the model holds.
        """
        total: dict[tuple[int, int], list[float]] = {}
        for part, stretch in zip(self.parts(mode.values), self.stretches, strict=True):
            weighted = np.einsum("kij,kj->ki", part.inverse, part.residual)
            alone = np.abs(weighted) ** 2 / np.einsum("kii->ki", part.inverse).real
            band_of = np.searchsorted(BANDS[1:-1], stretch.frequency)
            for column, channel in enumerate(stretch.used):
                for band in range(len(BANDS) - 1):
                    total.setdefault((channel, band), []).extend(alone[band_of == band, column])
        return [Cell(*key, float(np.sum(values)), len(values)) for key, values in total.items() if values]

    def whiteness(self, values: np.ndarray) -> tuple[float, float]:
        """Mean of Y' S^-1 Y over all coefficients and readings, 1 where the model holds, and its standard deviation."""
        total, number = 0.0, 0
        for part in self.parts(values):
            misfit = self._misfit(part)
            total, number = total + float(misfit.sum()), number + misfit.size
        return total / number, float(np.sqrt(HANN / number))

    def _part(self, values: np.ndarray, stretch: Stretch) -> _Part:
        model = self.vehicle.matrices(values, stretch.speed, stretch.used)
        s = 2j * np.pi * stretch.frequency
        response = respond(model, self.vehicle.dampers, self.vehicle.shares(values), s)
        S = self._spread(values, stretch, response)
        size = np.sqrt(np.einsum("kii->ki", S).real)
        scaled = S / (size[:, :, None] * size[:, None, :])
        logs = np.linalg.slogdet(scaled)[1] + 2.0 * np.log(size).sum(axis=1)
        residual = stretch.readings - np.einsum("kij,kj->ki", response.rails, stretch.rails)
        inverse = np.linalg.inv(scaled) / (size[:, :, None] * size[:, None, :])
        return _Part(model, response, S, size, inverse, residual, logs)

    def _errors(self, values: np.ndarray, stretch: Stretch) -> np.ndarray:
        """Densities of the readings' errors, shape (k, m)."""
        used = list(stretch.used)
        logs = values[self.count + SHAPES :].reshape(len(KINDS), len(KNOTS))
        return (
            self.levels.readings[used]
            * np.exp(2.0 * _hats(stretch.frequency) @ logs.T)[:, self.levels.reading_kind[used]]
        )

    def _factors(self, values: np.ndarray) -> np.ndarray:
        return np.exp(2.0 * values[self.count :])

    def _together(self, stretch: Stretch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Amplitudes of the rails' motions where a wave of lateral position or of roll runs under the wheelsets, shape
        (2, k, w), and the densities of both, shape (k,) each.
        """
        ahead = np.array(self.vehicle.ahead)
        late = np.exp(-2j * np.pi * stretch.frequency[:, None] * (ahead[0] - ahead) / stretch.speed)
        none = np.zeros_like(late)
        waves = np.stack([np.hstack([late, none]), np.hstack([none, late])])
        k = 2.0 * np.pi * stretch.frequency / stretch.speed
        densities = [one.density(k) * 2.0 * np.pi / stretch.speed for one in self.levels.track]
        return waves, densities[0], densities[1]

    def _spread(self, values: np.ndarray, stretch: Stretch, response: Response) -> np.ndarray:
        factor, levels = self._factors(values), self.levels
        forces = levels.forces * factor[levels.force_group]
        S = np.matmul(response.forces * forces, np.swapaxes(response.forces.conj(), 1, 2))
        diagonal = np.arange(len(stretch.used))
        S[:, diagonal, diagonal] += self._errors(values, stretch)
        waves, *densities = self._together(stretch)
        for wave, density, level in zip(waves, densities, factor[TRACK], strict=True):
            h = np.einsum("kmw,kw->km", response.rails, wave)
            S = S + (level * density)[:, None, None] * h[:, :, None] * h[:, None, :].conj()
        return S

    def _slopes(
        self, values: np.ndarray, part: _Part, stretch: Stretch, more: bool
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Slopes of the mean (k, m) and of the covariance (k, m, m) by each unknown and level, and considered ones."""
        rows = []
        for rails, forces in self._transfer_slopes(values, part, stretch, more):
            mean = np.einsum("kij,kj->ki", rails, stretch.rails)
            rows.append((mean, self._spread_slope(values, part, stretch, rails, forces)))
        still = np.zeros_like(part.residual)
        levels = [(still, spread) for spread in self._level_slopes(values, part, stretch)]
        return [*rows[: self.count], *levels, *rows[self.count :]]

    def _transfer_slopes(
        self, values: np.ndarray, part: _Part, stretch: Stretch, more: bool
    ) -> list[tuple[np.ndarray, ...]]:
        vehicle, now = self.vehicle, part.response
        shares, found = vehicle.shares(values), []
        patterns = {LATERAL: (0, part.model.lateral), YAW: (1, part.model.yaw)}
        for i, unknown in enumerate(vehicle.unknowns):
            if unknown.name in patterns:
                which, pattern = patterns[unknown.name]
                found.append(damped(now, pattern, vehicle.dampers[which].at(now.s)))
                continue
            ahead = values.copy()
            ahead[i] += STEP
            other = vehicle.matrices(ahead, stretch.speed, stretch.used)
            found.append(moved(now, other.slope(part.model, STEP), vehicle.dampers, shares))
        if more:
            named = {one.name: float(x) for one, x in zip(vehicle.unknowns, values, strict=False)}
            for name in considered(vehicle):
                if name == "yaw_damper_series_stiffness":
                    by = _mount_slope(vehicle, shares[1], now.s)
                    found.append(damped(now, part.model.yaw, by))
                    continue
                other = vehicle.changed(named | {name: STEP}, stretch.speed, stretch.used)
                found.append(moved(now, other.slope(part.model, STEP), vehicle.dampers, shares))
        return found

    def _spread_slope(
        self, values: np.ndarray, part: _Part, stretch: Stretch, rails: np.ndarray, forces: np.ndarray
    ) -> np.ndarray:
        factor, levels, now = self._factors(values), self.levels, part.response
        density = levels.forces * factor[levels.force_group]
        half = np.matmul(forces * density, np.swapaxes(now.forces.conj(), 1, 2))
        waves, *densities = self._together(stretch)
        for wave, track, level in zip(waves, densities, factor[TRACK], strict=True):
            h, slope = (np.einsum("kmw,kw->km", one, wave) for one in (now.rails, rails))
            half = half + (level * track)[:, None, None] * slope[:, :, None] * h[:, None, :].conj()
        return half + np.swapaxes(half.conj(), 1, 2)

    def _level_slopes(self, values: np.ndarray, part: _Part, stretch: Stretch) -> list[np.ndarray]:
        factor, levels, now = self._factors(values), self.levels, part.response
        found = []
        for group in range(len(FORCES)):
            density = 2.0 * levels.forces * factor[group] * (levels.force_group == group)
            found.append(np.matmul(now.forces * density, np.swapaxes(now.forces.conj(), 1, 2)))
        waves, *densities = self._together(stretch)
        for wave, density, level in zip(waves, densities, factor[TRACK], strict=True):
            h = np.einsum("kmw,kw->km", now.rails, wave)
            found.append((2.0 * level * density)[:, None, None] * h[:, :, None] * h[:, None, :].conj())
        errors, hats, diagonal = self._errors(values, stretch), _hats(stretch.frequency), np.arange(len(stretch.used))
        kinds = levels.reading_kind[list(stretch.used)]
        for kind in range(len(KINDS)):
            for knot in range(len(KNOTS)):
                slope = np.zeros_like(part.S)
                slope[:, diagonal, diagonal] = 2.0 * errors * hats[:, [knot]] * (kinds == kind)
                found.append(slope)
        return found


def _hats(frequency: np.ndarray) -> np.ndarray:
    """Weights of the knots at some frequencies, shape (k, knots)."""
    at, logs = np.log(frequency), np.log(KNOTS)
    return np.stack([np.interp(at, logs, one) for one in np.eye(len(KNOTS))], axis=1)


def considered(vehicle: Nominal) -> list[str]:
    """Names of the parameters that are considered, of those that the vehicle has."""
    return [name for name in CONSIDERED if vehicle.p.get(name, 0.0) > 0.0]


def _mount_slope(vehicle: Nominal, share: float, s: np.ndarray) -> np.ndarray:
    """Slope of the yaw dampers' complex damping by the logarithm of their mounts' stiffness."""
    damper = vehicle.dampers[1]
    return share * damper.at(s) ** 2 * s / damper.mount


def densities(
    vehicle: Nominal,
    forces: dict[str, float],
    readings: np.ndarray,
    track: tuple[TrackSpectrum, TrackSpectrum],
) -> Levels:
    """Levels of a vehicle.

    Parameters
    ----------
    forces : N/sqrt(Hz) or N m/sqrt(Hz) by "wheelset.y", "wheelset.yaw", "bogie.y" ... "body.yaw".
    readings : one-sided densities of the channels, shape (m,).
    """
    names = coordinates_of(bogies_of(vehicle.p, vehicle.whole), vehicle.whole)
    kinds = [name.partition(".")[0].rstrip("1234") + "." + name.partition(".")[2] for name in names]
    groups = {"wheelset": 0, "bogie": 1, "body": 2}
    return Levels(
        np.array([forces[kind] ** 2 for kind in kinds]),
        np.array([groups[kind.partition(".")[0]] for kind in kinds]),
        readings,
        np.array([KINDS.index((one.body.rstrip("1234"), one.kind)) for one in vehicle.channels]),
        track,
    )
