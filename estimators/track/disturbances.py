"""What moves a vehicle besides the track that its model knows, as random processes whose sizes are fitted.

The rest of the train and of the vehicle pushes body and bogie, creep and flange forces bend where the model is
straight, and wheelsets sink and lean where the gauge widens. Each is a Gaussian process over the distance: white noise,
or white noise through a filter (`TrackSpectrum`). An accelerometer feels the forces that push its body, so that only
forces on coordinates whose acceleration is not measured may be white.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimators.filters.information import wavenumbers
from estimators.filters.track_spectrum import TrackSpectrum
from estimators.signals.bands import Band, response
from estimators.vehicle.state_space import System, Transfer
from railsim.track.spectra import WC

SHORT = Band(0.0, 70.0)  # m; longer waves are not looked at in what disturbs usually
PUSHES = Band(3.0, 70.0)  # m; of accelerations, which grow without limit towards short waves
UNIT_LENGTH = 0.25  # m; white noise of size 1 has the acceleration's variance in steps of this length
FORCE = TrackSpectrum(1.0, 0, (1.0 / 1.5,))
"""Shape of an unknown force; its correlation length of 1.5 m is a choice: shorter than the shortest band."""
HEIGHT = TrackSpectrum(1.0, 0, (1.0 / 4.0, WC, WC))
"""Shape of a wheelset's own height or lean over the rails: that of irregularity, smooth enough to be differentiated
twice; its correlation length of 4 m is a choice.
"""


@dataclass(frozen=True)
class Disturbance:
    """One process, of the same size in all its members, which are independent.

    Attributes
    ----------
    name : in words.
    members : coordinates that it pushes; of a process of the rails, the inputs of the system that it adds to.
    shape : spectrum up to its level; white where None.
    of_rails : whether it adds to the inputs.
    size, spread : median of its size before anything was measured, over what the track does to the same coordinate, and
        standard deviation of the logarithm.
    begins : sizes from which a fit begins, when it begins several times.
    local : whether its size differs between kinds of places; else it is that of straight track, as what a curve does
        to a body at rest would be taken for it.
    """

    name: str
    members: tuple[int, ...]
    shape: TrackSpectrum | None = None
    of_rails: bool = False
    size: float = 0.1
    spread: float = 1.5
    begins: tuple[float, ...] = ()
    local: bool = False

    def density(self, wavenumber: np.ndarray) -> np.ndarray:
        """One-sided density for variance 1, or for acceleration of variance 1 in steps of `UNIT_LENGTH` if white."""
        if self.shape is None:
            return np.full(len(wavenumber), UNIT_LENGTH / np.pi)
        return self.shape.density(wavenumber) / self.shape.stationary()[0, 0]

    def spectrum(self, density: np.ndarray, transfer: Transfer, variance: np.ndarray) -> np.ndarray:
        """Of the readings, for variances of the members (members,), shape (k, m, m)."""
        of_forces = transfer.of_white_forces if self.shape is None else transfer.of_forces
        gain = (transfer.of_inputs if self.of_rails else of_forces)[:, :, list(self.members)]
        weighed = gain * (density[:, None] * variance)[:, None, :]
        return weighed @ np.swapaxes(gain.conj(), 1, 2)

    def usual(self, accelerations: np.ndarray, priors: Sequence[TrackSpectrum]) -> np.ndarray:
        """Variance of each member by each quantity of the track, which is size 1, shape (quantities, members).

        `accelerations` : see there.
        """
        k = wavenumbers()
        variances = np.zeros((len(priors), len(self.members)))
        band = PUSHES if self.shape is not None else SHORT
        for q, prior in enumerate(priors):
            for number, member in enumerate(self.members):
                if self.of_rails:
                    own = member % len(priors) == q
                    power = own * prior.density(k) * response(k, SHORT)
                else:
                    power = accelerations[:, member, q] * prior.density(k) * response(k, band)
                variances[q, number] = np.trapezoid(power * k, np.log(k))
        return variances

    @property
    def states(self) -> int:
        """How many states it adds."""
        return 0 if self.shape is None else len(self.members) * len(self.shape.corners)


def accelerations(system: System, speed: float, wheelbase: float) -> np.ndarray:
    """Squares of the coordinates' accelerations over the quantities of the track, shape (k, n / 2, quantities)."""
    k, n = wavenumbers(), len(system.A) // 2
    lead, trail = np.split(system.states(k * speed)[:, :n], 2, axis=2)
    moves = np.abs(lead + trail * np.exp(-1j * k * wheelbase)[:, None, None]) ** 2
    return moves * (k * speed)[:, None, None] ** 4


def extended(system: System, disturbances: Sequence[Disturbance], speed: float) -> System:
    """The system with the states of the shaped disturbances after its own, driven by white noise over time."""
    n, total = len(system.A), len(system.A) + sum(one.states for one in disturbances)
    A, C = np.zeros((total, total)), np.zeros((len(system.C), total))
    A[:n, :n], C[:, :n] = system.A, system.C
    feels = np.zeros((len(system.C), n // 2)) if system.feels is None else system.feels
    first = n
    for disturbance in disturbances:
        if disturbance.shape is None:
            continue
        own = speed * disturbance.shape.matrix
        for member in disturbance.members:
            block = slice(first, first + len(own))
            A[block, block] = own
            value = np.eye(len(own))[0]
            if disturbance.of_rails:
                rate, twice = value @ own, value @ own @ own
                A[:n, block] = np.outer(system.B[:, member], value) + np.outer(system.E[:, member], rate)
                C[:, block] = np.outer(system.D[:, member], value) + np.outer(system.G[:, member], rate)
                C[:, block] += 0.0 if system.J is None else np.outer(system.J[:, member], twice)
            else:
                A[n // 2 + member, first] = 1.0
                C[:, first] = feels[:, member]
            first += len(own)
    still = np.zeros((total - n, system.B.shape[1]))
    return System(A, np.vstack([system.B, still]), np.vstack([system.E, still]), C, system.D, system.G, system.J)


def drive(
    states: int, disturbances: Sequence[Disturbance], variances: Sequence[np.ndarray], speed: float
) -> np.ndarray:
    """Variance per second that enters each state of the extended system, from the members' variances.

    `states` : of the system without them.
    """
    entering, shaped = np.zeros(states), []
    for disturbance, variance in zip(disturbances, variances, strict=True):
        if disturbance.shape is None:
            entering[[states // 2 + member for member in disturbance.members]] += variance * UNIT_LENGTH / speed
            continue
        own = np.diag(disturbance.shape.intensity) / disturbance.shape.stationary()[0, 0] * speed
        shaped += [one * own for one in variance]
    return np.concatenate([entering, *shaped])


def start(disturbances: Sequence[Disturbance], variances: Sequence[np.ndarray]) -> np.ndarray:
    """Standard deviations of the added states at the start: those of the stationary processes."""
    spreads = []
    for disturbance, variance in zip(disturbances, variances, strict=True):
        if disturbance.shape is not None:
            stationary = np.diag(disturbance.shape.stationary())
            spreads += [np.sqrt(one * stationary / stationary[0]) for one in variance]
    return np.concatenate(spreads) if spreads else np.zeros(0)
