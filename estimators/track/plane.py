"""One plane of the fused estimate: the vehicle's linear model, what is read of it, and what is unknown about both."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from estimators.filters.information import (
    Information,
    changed,
    deviations,
    information,
    responses,
    spectra,
    wavenumbers,
)
from estimators.filters.track_spectrum import Noise, TrackSpectrum
from estimators.signals.bands import Band
from estimators.track import disturbances
from estimators.track.disturbances import Disturbance
from estimators.track.observations import Observation
from estimators.vehicle.state_space import System

FLOOR = 0.007  # of what a sensor typically shows: the least that the linear model is taken to leave as noise
STRUCTURE = 0.015  # of what a sensor shows: standard deviation of what the model leaves out; tuned on straight_erri_low


class TrackRegime(NamedTuple):
    """A kind of place, where the vehicle or what disturbs it is another.

    Attributes
    ----------
    changes : parameters that differ there.
    unknown : standard deviations of logarithms of parameters beside those of the plane.
    sized_as : number of the kind whose disturbances are fitted for both together.
    """

    changes: Mapping[str, float] = MappingProxyType({})
    unknown: Mapping[str, float] = MappingProxyType({})
    sized_as: int = 0


@dataclass(frozen=True)
class Plane:
    """A plane of the vehicle with what is read of it.

    Attributes
    ----------
    system : from parameters and speed (m/s) to the linear model with the readings as outputs.
    vehicle : parameters; the nominal ones until a fit has found others.
    unknown : standard deviations of the logarithms of parameters that are not fitted.
    fitted : the same of those that are, of a vehicle as its data sheet says.
    observations : in the order of the outputs.
    priors : shapes of the spectra of the track's quantities; their levels are fitted.
    disturbances : what moves the vehicle besides the track; their sizes are fitted.
    start : standard deviation of each state for heights (m) and slopes (rad) of the quantities, at a speed.
    regimes, kind : what kinds of places there are, and the number of each place's, shape (n,).
    structure : of what a sensor shows: standard deviation of what the model leaves out, coherent with the track.
    spread : changes of the logarithms of the fitted parameters by one standard deviation each, independent of each
        other: what the fit leaves open. Those of `fitted` where None.
    trust : factor on the standard deviations of what the model leaves out, of the sensors' scales and of the distance.
    varying : those of the fitted parameters that are slopes of a curve; found far from nominal, they are also taken to
        differ from place to place by as much.
    begins : changes of the fitted parameters' logarithms from which a fit begins too, beside none.
    usual_of : vehicle whose motion gives the disturbances their unit; `vehicle` where None.
    whole : readings of a vehicle of which `system` is a part, over the track, by parameters, speed (m/s) and wave
        numbers (rad/m, (k,)), shape (k, readings, quantities). What the part leaves out counts as unknown.
    """

    system: Callable[[dict[str, float], float], System]
    vehicle: dict[str, float]
    unknown: dict[str, float]
    fitted: dict[str, float]
    observations: list[Observation]
    priors: tuple[TrackSpectrum, ...]
    disturbances: tuple[Disturbance, ...]
    start: Callable[[np.ndarray, np.ndarray, float], np.ndarray]
    regimes: tuple[TrackRegime, ...] = (TrackRegime(),)
    kind: np.ndarray | None = None
    structure: float = STRUCTURE
    spread: tuple[Mapping[str, float], ...] | None = None
    trust: float = 1.0
    varying: tuple[str, ...] = ()
    begins: tuple[Mapping[str, float], ...] = ()
    usual_of: dict[str, float] | None = None
    whole: Callable[[dict[str, float], float, np.ndarray], np.ndarray] | None = None

    @cached_property
    def _responses(self) -> dict[tuple[float, float], tuple[System, np.ndarray, np.ndarray]]:
        """What `information` has computed already, by speed and error of distance."""
        return {}

    @cached_property
    def _usual(self) -> dict[float, tuple[np.ndarray, ...]]:
        """What `usual` has computed already, by speed."""
        return {}

    @cached_property
    def _at(self) -> dict[int, "Plane"]:
        return {}

    def at(self, number: int) -> "Plane":
        """The same as it is at one kind of place."""
        if number not in self._at:
            regime = self.regimes[number]
            vehicle, unknown = self.vehicle | dict(regime.changes), self.unknown | dict(regime.unknown)
            self._at[number] = (
                replace(self, vehicle=vehicle, unknown=unknown) if regime.changes or regime.unknown else self
            )
        return self._at[number]

    @property
    def wheelbase(self) -> float:
        """Distance of the wheelsets, m."""
        return 2.0 * self.vehicle["semi_wheelbase"]

    @property
    def changes(self) -> list[Mapping[str, float]]:
        """Changes of the logarithms of parameters by one standard deviation of each independent unknown."""
        spread = [{name: std} for name, std in self.fitted.items()] if self.spread is None else self.spread
        return [*spread, *({name: std} for name, std in (self.unknown | self._variation).items())]

    @property
    def _variation(self) -> dict[str, float]:
        """Standard deviations of logarithms of slopes that go evenly from nominal to twice as far as was found."""
        if self.usual_of is None:
            return {}
        off = {name: np.log(self.vehicle[name] / self.usual_of[name]) for name in self.varying}
        return {name: float(abs(one)) / np.sqrt(3.0) for name, one in off.items() if one}

    def only(self, names: Sequence[str]) -> "Plane":
        """The same with the readings of some channels."""
        chosen = [number for number, one in enumerate(self.observations) if one.name in names]
        observations = [self.observations[number] for number in chosen]
        whole = self.whole
        return replace(
            self,
            system=lambda p, speed: self.system(p, speed).only(chosen),
            observations=observations,
            whole=None if whole is None else lambda p, speed, k: whole(p, speed, k)[:, chosen],
        )

    def noise(self) -> Noise:
        """Of the readings by their data sheets."""
        columns = [(one.density, one.bias, one.drift, one.drift_time, one.tilt) for one in self.observations]
        return Noise(*(np.array(column) for column in zip(*columns, strict=True)))

    def usual(self, speed: float) -> tuple[np.ndarray, ...]:
        """Variance of each disturbance of size 1 by each quantity of the plane's priors, (quantities, members) each."""
        if speed not in self._usual:
            system = self.system(self.usual_of or self.vehicle, speed)
            moves = disturbances.accelerations(system, speed, self.wheelbase)
            self._usual[speed] = tuple(one.usual(moves, self.priors) for one in self.disturbances)
        return self._usual[speed]

    def variances(self, speed: float, priors: Sequence[TrackSpectrum], sizes: np.ndarray) -> list[np.ndarray]:
        """Of the members of each disturbance; `priors` : those of the plane at any level."""
        levels = np.array([prior.amplitude / unit.amplitude for prior, unit in zip(priors, self.priors, strict=True)])
        return [size**2 * levels @ one for size, one in zip(sizes, self.usual(speed), strict=True)]

    def bounds(
        self, speed: float, priors: Sequence[TrackSpectrum], bands: Sequence[dict[str, Band]]
    ) -> list[dict[str, float]]:
        """Cramer-Rao bound of each band at a speed, m rms: sensor noise alone, the model taken to be right."""
        system = self.system(self.vehicle, speed)
        known = information([system], priors, self.noise(), speed, self.wheelbase, np.zeros(len(self.observations)))
        return [
            {name: known.rms(bound, band) for name, band in one.items()}
            for bound, one in zip(known.bound.T, bands, strict=True)
        ]

    def information(
        self,
        speed: float,
        spacing: float,
        distance_error: float,
        priors: Sequence[TrackSpectrum],
        sizes: np.ndarray,
    ) -> Information:
        """Spectra at a speed, with disturbances of those sizes and the readings' floor."""
        key = (speed, distance_error)
        if key not in self._responses:
            systems = deviations(lambda p: self.system(p, speed), self.vehicle, self.changes)
            scales = self.trust * np.array([np.hypot(one.scale, self.structure) for one in self.observations])
            made = responses(systems, speed, self.wheelbase, scales, self.trust * distance_error)
            if self.whole is not None:
                beyond = self.whole(self.vehicle, speed, wavenumbers()) - made[0]
                made = made[0], np.concatenate([made[1], beyond[None]])
            self._responses[key] = systems[0], *made
        system, H, wrong = self._responses[key]
        plain = spectra(H, wrong, priors, self.noise(), speed)
        noise, k = plain.noise.copy(), wavenumbers()
        transfer = system.transfer(k * speed)
        for one, variance in zip(self.disturbances, self.variances(speed, priors, sizes), strict=True):
            noise += one.spectrum(one.density(k), transfer, variance)
        floor = FLOOR * np.array([plain.rms(one) for one in plain.readings.T])
        return replace(plain, noise=noise + np.diag(floor**2 * spacing / np.pi))

    def found(self, logarithms: np.ndarray, covariance: np.ndarray, trust: float) -> "Plane":
        """The same with fitted parameters and what is left open about them, in the order of `fitted`."""
        names = list(self.fitted)
        values, vectors = np.linalg.eigh(covariance)
        columns = vectors * np.sqrt(np.maximum(values, 0.0))
        spread = tuple(dict(zip(names, (float(one) for one in column), strict=True)) for column in columns.T)
        change = dict(zip(names, (float(one) for one in logarithms), strict=True))
        vehicle, usual_of = changed(self.vehicle, change), self.usual_of or self.vehicle
        return replace(self, vehicle=vehicle, spread=spread, trust=trust, usual_of=usual_of)

    def extended(self, speed: float) -> System:
        """The system with the states of the disturbances."""
        return disturbances.extended(self.system(self.vehicle, speed), self.disturbances, speed)
