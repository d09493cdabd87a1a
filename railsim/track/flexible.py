"""A track that gives: rails on pads, sleepers and ballast, lumped into two layers that run with each wheelset.

Each layer is a part of the rail, a beam on a continuous foundation: where the foundation has the stiffness k' a metre,
a force on the rail meets the stiffness K = 2 sqrt(2) (E I)^(1/4) k'^(3/4) = k' L with the effective length L = 2 / beta
and beta = (k' / (4 E I))^(1/4) (Hetenyi 1946; Knothe and Grassie 1993). With the masses, springs and dampers of that
length, static stiffness and resonance sqrt(k' / m') are the beam's.
"""

from typing import NamedTuple

import numpy as np

from railsim.errors import InputError
from railsim.spec import Spec, quantity

RAIL_SECTION = "EN 13674-1, 60E1"
TYPICAL = "illustrative, in the range that Knothe and Grassie (1993) give"
OSCILLATION, DECAY = 2.4, 1.8  # largest products of a classical Runge-Kutta step with frequency and decay rate
BALLAST_SHARE = 0.995  # most of the pads' stiffness that a rail may have


class Void(NamedTuple):
    """Sleepers that hang over a gap, raised cosine over `length` about `place` [m], `gap` [m] in its middle."""

    place: float
    length: float
    gap: float


class CoRunning(NamedTuple):
    """The lumped track under one wheelset: plain numbers for the kernels [kg, N/m, N s/m, m]."""

    rail_mass_z: float  # of each rail, in vertical movement
    rail_mass_y: float
    sleeper_mass_z: float  # of the sleepers as a whole
    sleeper_mass_y: float
    sleeper_inertia: float  # about the track's direction [kg m2]
    pad_stiffness_z: float  # under each rail
    pad_damping_z: float
    pad_stiffness_y: float
    pad_damping_y: float
    ballast_damping_z: float  # under each half of the sleepers
    ballast_stiffness_y: float  # beside the sleepers as a whole
    ballast_damping_y: float
    seat: float  # of a rail beside the track's middle [m]
    bed: float  # of the ballast's force under each half of the sleepers [m]
    height: float  # of the rail's head above the sleepers' middle [m]
    compliance: float  # deflection of each rail per static force on it, where the track states none [m/N]
    variation: float  # of the stiffness, from sleeper to sleeper [-]
    spacing: float  # of the sleepers [m]
    first: float  # place of a sleeper [m]


class FlexibleTrack(Spec, frozen=True):
    """Rails, pads, sleepers and ballast of the whole track; both rails alike."""

    rail_mass: float = quantity(60.2, unit="kg/m", source=RAIL_SECTION, ge=10.0, le=120.0)
    rail_bending_vertical: float = quantity(
        6.4e6, unit="N m2", source=f"{RAIL_SECTION}: 3038 cm4; 210 GPa", ge=5e5, le=2e7
    )
    rail_bending_lateral: float = quantity(
        1.07e6, unit="N m2", source=f"{RAIL_SECTION}: 512 cm4; 210 GPa", ge=1e5, le=1e7
    )
    rail_height: float = quantity(
        0.27, unit="m, of its head above the sleeper's middle", source=f"{RAIL_SECTION}: 172 mm", ge=0.0, le=1.0
    )
    pad_stiffness_vertical: float = quantity(120e6, unit="N/m", source=TYPICAL, ge=1e7, le=5e9)
    pad_damping_vertical: float = quantity(30e3, unit="N s/m", source=TYPICAL, ge=0.0, le=5e5)
    pad_stiffness_lateral: float = quantity(40e6, unit="N/m", source="illustrative", ge=5e6, le=2e9)
    pad_damping_lateral: float = quantity(20e3, unit="N s/m", source="illustrative", ge=0.0, le=5e5)
    sleeper_mass: float = quantity(300.0, unit="kg", source="concrete monoblock, illustrative", ge=20.0, le=2000.0)
    sleeper_length: float = quantity(2.6, unit="m", source="concrete monoblock, 2.5 to 2.6 m", ge=1.6, le=6.0)
    sleeper_spacing: float = quantity(0.6, unit="m", source="main lines", ge=0.3, le=1.5)
    ballast_stiffness_vertical: float = quantity(70e6, unit="N/m under half a sleeper", source=TYPICAL, ge=1e6, le=5e9)
    ballast_damping_vertical: float = quantity(50e3, unit="N s/m under half a sleeper", source=TYPICAL, ge=0.0, le=5e5)
    ballast_stiffness_lateral: float = quantity(
        20e6, unit="N/m beside half a sleeper", source="illustrative", ge=1e6, le=2e9
    )
    ballast_damping_lateral: float = quantity(
        40e3, unit="N s/m beside half a sleeper", source="illustrative", ge=0.0, le=5e5
    )
    stiffness_variation: float = quantity(
        0.005,
        unit="-, of the rail's stiffness about its mean",
        source="beam of these parameters on discrete supports: above a sleeper against midspan",
        ge=0.0,
        le=0.5,
    )
    first_sleeper: float = quantity(0.0, unit="m, place of a sleeper", source="chosen by the scenario", ge=-1e5, le=1e5)

    def corunning(self) -> CoRunning:
        """The lumped track."""
        vertical, lateral = self.effective_lengths
        z, y = vertical / self.sleeper_spacing, lateral / self.sleeper_spacing
        spread = self.sleeper_length / np.sqrt(12.0)
        return CoRunning(
            rail_mass_z=self.rail_mass * vertical,
            rail_mass_y=self.rail_mass * lateral,
            sleeper_mass_z=self.sleeper_mass * z,
            sleeper_mass_y=self.sleeper_mass * y,
            sleeper_inertia=self.sleeper_mass * z * spread**2,
            pad_stiffness_z=self.pad_stiffness_vertical * z,
            pad_damping_z=self.pad_damping_vertical * z,
            pad_stiffness_y=self.pad_stiffness_lateral * y,
            pad_damping_y=self.pad_damping_lateral * y,
            ballast_damping_z=self.ballast_damping_vertical * z,
            ballast_stiffness_y=2.0 * self.ballast_stiffness_lateral * y,
            ballast_damping_y=2.0 * self.ballast_damping_lateral * y,
            seat=0.75,
            bed=spread,
            height=self.rail_height,
            compliance=1.0 / self.stiffness,
            variation=self.stiffness_variation,
            spacing=self.sleeper_spacing,
            first=self.first_sleeper,
        )

    @property
    def foundations(self) -> tuple[float, float]:
        """Stiffness below the rail in vertical and lateral direction [N/m2]: pads and ballast in series."""
        pads = self.pad_stiffness_vertical, self.pad_stiffness_lateral
        beds = self.ballast_stiffness_vertical, self.ballast_stiffness_lateral
        vertical, lateral = (pad * bed / (pad + bed) for pad, bed in zip(pads, beds, strict=True))
        return vertical / self.sleeper_spacing, lateral / self.sleeper_spacing

    @property
    def effective_lengths(self) -> tuple[float, float]:
        """2 / beta in vertical and lateral direction [m]."""
        beams = self.rail_bending_vertical, self.rail_bending_lateral
        vertical, lateral = (
            2.0 * (4.0 * beam / below) ** 0.25 for beam, below in zip(beams, self.foundations, strict=True)
        )
        return vertical, lateral

    @property
    def stiffness(self) -> float:
        """Of a rail under a static vertical force [N/m]."""
        return self.foundations[0] * self.effective_lengths[0]


def check_support(track: CoRunning, stiffness: np.ndarray | None) -> None:
    """Refuse a track that is stated to be stiffer than its pads: ballast of negative stiffness.

    Raises
    ------
    InputError : names stiffness and limit.
    """
    stated = 1.0 / track.compliance if stiffness is None else float(stiffness.max())
    stiffest = stated * (1.0 + track.variation)
    most = BALLAST_SHARE * track.pad_stiffness_z
    if stiffest > most:
        raise InputError(
            f"flexible_track: a rail's stiffness of {stiffest:.3g} N/m needs ballast of negative stiffness: the pads "
            f"alone give {track.pad_stiffness_z:.3g} N/m; state less than {most:.3g} N/m, or stiffer pads"
        )


def longest_step(track: CoRunning, oscillation: float = OSCILLATION, decay: float = DECAY) -> float:
    """Longest step [s] whose products with frequencies and decay rates of the track on its own, with rails that nothing
    presses, stay below these.
    """
    bed = 1.0 / (track.compliance - 1.0 / track.pad_stiffness_z)
    pads = track.pad_stiffness_z, track.pad_damping_z
    rates = [
        *_rates(track.rail_mass_z, 0.5 * track.sleeper_mass_z, pads, (bed, track.ballast_damping_z)),
        *_rates(
            track.rail_mass_z,
            track.sleeper_inertia / track.seat**2,
            pads,
            tuple((track.bed / track.seat) ** 2 * value for value in (bed, track.ballast_damping_z)),
        ),
        *_rates(
            track.rail_mass_y,
            0.5 * track.sleeper_mass_y,
            (track.pad_stiffness_y, track.pad_damping_y),
            (0.5 * track.ballast_stiffness_y, 0.5 * track.ballast_damping_y),
        ),
    ]
    return float(min(min(oscillation / abs(rate), decay / max(-rate.real, 1e-9)) for rate in rates))


def _rates(rail: float, sleeper: float, pad: tuple[float, ...], bed: tuple[float, ...]) -> np.ndarray:
    """Eigenvalues of a rail on its pads, a sleeper and its bed [1/s]; springs and dampers as (k, c)."""
    k, c = ([[upper, -upper], [-upper, upper + lower]] for upper, lower in zip(pad, bed, strict=True))
    masses = np.array([[rail], [sleeper]])
    matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.array(k) / masses, -np.array(c) / masses]])
    return np.linalg.eigvals(matrix)
