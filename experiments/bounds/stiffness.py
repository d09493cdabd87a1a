"""What there is to know of the track's stiffness in a stretch of line: Cramer-Rao bounds, two ways to see it.

One pass: the wheelset on the track of the simulator (rail, pads, sleepers and ballast lumped into two layers) over
roughness of a known spectrum, whose level and slope in the stretch are not known. In time T the spectrum S of the
axleboxes' mean acceleration has Fisher's information T * integral of (d ln S / dp)(d ln S / dq) df on the parameters.

Two loads at one place: the mean deflection W / K differs by (W1 - W2) / K, and the irregularity falls out of the
difference of two paths, each the acceleration twice integrated, of which only the sensor's noise is left.
"""

import numpy as np

from railsim.track.flexible import CoRunning
from railsim.track.spectra import Band, Spectrum

HERTZ = np.linspace(10.0, 150.0, 2801)


def lumped_receptance(omega: np.ndarray, stiffness: float, track: CoRunning) -> np.ndarray:
    """Deflection of a rail over the force on it, both rails loaded alike, m/N, complex; its static stiffness is given.

    omega : rad/s, shape (n,). stiffness : N/m.
    """
    ballast = 1.0 / (1.0 / stiffness - 1.0 / track.pad_stiffness_z)
    pad = track.pad_stiffness_z + 1j * omega * track.pad_damping_z
    below = ballast + 1j * omega * track.ballast_damping_z - 0.5 * track.sleeper_mass_z * omega**2
    return 1.0 / (1.0 / (1.0 / pad + 1.0 / below) - track.rail_mass_z * omega**2)


def one_pass(
    stiffness: float,
    speed: float,
    length: float,
    track: CoRunning,
    wheel: tuple[float, float],
    roughness: tuple[Spectrum, Band, float],
    noise: float,
) -> float:
    """Least standard deviation of the logarithm of the stiffness in a stretch of that length.

    Parameters
    ----------
    stiffness : N/m. speed : m/s. length : m. wheel : half the wheelset's mass, kg, and stiffness of the contact, N/m.
    roughness : spectrum of the rails' mean, its band, and factor on its amplitudes.
    noise : density of the mean of both axleboxes, m/s2/sqrt(Hz).
    """
    omega = 2.0 * np.pi * HERTZ
    mass, contact = wheel
    spectrum, band, factor = roughness
    wave = omega / speed

    def log_density(log_stiffness: float) -> np.ndarray:
        give = 1.0 / contact + lumped_receptance(omega, float(np.exp(log_stiffness)), track)
        gain = omega**4 / np.abs(1.0 - omega**2 * mass * give) ** 2
        density = factor**2 * spectrum.density(wave) * band.weight(wave) * 2.0 * np.pi / speed
        return np.stack([gain * density, np.full(len(omega), noise**2)])

    signal, floor = log_density(np.log(stiffness))
    share, step = signal / (signal + floor), 1e-5
    by_stiffness = (np.log(log_density(np.log(stiffness) + step)[0] + 1e-300) - np.log(signal + 1e-300)) / step
    rows = share * np.stack([by_stiffness, np.ones(len(omega)), np.log(omega / omega.mean())])
    fisher = length / speed * np.trapezoid(rows[:, None] * rows, HERTZ, axis=-1)
    return float(np.sqrt(np.linalg.inv(fisher)[0, 0]))


def two_loads(stiffness: float, speed: float, length: float, loads: tuple[float, float], noise: float) -> float:
    """Least standard deviation of the relative change of compliance in a zone, from two passes.

    A change a of the compliance 1 / K gives the difference of both accelerations a (W1 - W2) / K v^2 g'' with the
    zone's shape g, in white noise of the one-sided density 2 noise^2.

    The zone is a raised cosine of that length, m, whose place and shape are known; loads : of a wheel in both passes,
    N; noise : density of the mean of both axleboxes, m/s2/sqrt(Hz).
    """
    bend = (2.0 * np.pi / length) ** 2 / 2.0  # of the raised cosine, largest, 1/m2
    information = speed**3 * bend**2 * length / 2.0 / noise**2 * ((loads[0] - loads[1]) / stiffness) ** 2
    return float(information**-0.5)
