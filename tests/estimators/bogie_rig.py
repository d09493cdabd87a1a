"""A throw-away vehicle for tests of speed estimators: modes of a half-vehicle on a random profile.

It shares nothing with the estimators: the wheelsets have mass and stand on contact springs, the body and both wheelsets
are degrees of freedom, and the parameters can be put off the nominal ones that the estimator is told.
"""

import numpy as np
from scipy import interpolate, signal

from railsim.measurements import Measurements

NOMINAL: dict[str, float] = {
    "body_mass": 16_000.0,
    "bogie_mass": 2_615.0,
    "bogie_pitch_inertia": 1_476.0,
    "primary_vertical_stiffness": 1.22e6,
    "primary_vertical_damping": 4e3,
    "secondary_vertical_stiffness": 430e3,
    "secondary_vertical_damping": 20e3,
    "semi_wheelbase": 1.3,
    "wheel_radius": 0.46,
}
WHEELSET_MASS, CONTACT_STIFFNESS, CONTACT_DAMPING = 1_813.0, 2.4e9, 2e5
MEMS = {"acceleration": 60e-6 * 9.81, "rate": np.radians(0.005)}  # per square root of Hz; industrial MEMS sensors
INNER = 4000.0


def profile(length: float, rng: np.random.Generator, level: float = 4.032e-7) -> interpolate.CubicSpline:
    """Vertical profile with the shape of ERRI B176 'low', wavelengths 0.4 to 150 m."""
    step = 0.05
    n = int(np.ceil(length / step)) + 2
    wave = 2 * np.pi * np.fft.rfftfreq(n, step)
    psd = level * 0.8246**2 / ((wave**2 + 0.0206**2) * (wave**2 + 0.8246**2))
    psd[(wave < 2 * np.pi / 150) | (wave > 2 * np.pi / 0.4)] = 0
    gauss = rng.normal(size=wave.size) + 1j * rng.normal(size=wave.size)
    heights = np.fft.irfft(gauss * np.sqrt(psd * np.pi / step * n) / np.sqrt(2), n)
    return interpolate.CubicSpline(np.arange(n) * step, heights)


def ride(
    speed: np.ndarray,
    rng: np.random.Generator,
    rate: float = 1000.0,
    truth: dict[str, float] | None = None,
    noise: dict[str, float] | None = None,
) -> tuple[Measurements, np.ndarray]:
    """Run over a new profile at `speed` (m/s, at 4000 Hz); return measurements and true speed at `rate`."""
    p = NOMINAL | {"primary_vertical_damping": 4.2e3, "secondary_vertical_damping": 19e3} | (truth or {})
    distance = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 / INNER)]) + 2 * p["semi_wheelbase"] + 0.1
    track = profile(distance[-1] + 1, rng)
    under = np.stack([track(distance), track(distance - 2 * p["semi_wheelbase"])])
    acceleration, rotation = _response(p, under)
    every = round(INNER / rate)
    z, q = acceleration[::every] + 9.81, rotation[::every]
    for values, key in ((z, "acceleration"), (q, "rate")):
        if noise:
            values += rng.normal(size=values.size) * noise[key] * np.sqrt(rate / 2)
    return measurements(np.arange(z.size) / rate, z, q, rate), speed[::every]


def measurements(time: np.ndarray, acceleration: np.ndarray, pitch_rate: np.ndarray, rate: float) -> Measurements:
    """A recording of the two channels with the nominal parameters."""
    table = {"time [s]": time, "bogie.acceleration_z [m/s2]": acceleration, "bogie.rate_pitch [rad/s]": pitch_rate}
    about = {"origin": "bogie_rig", "vehicle": dict(NOMINAL), "sensors": []}
    return Measurements(about, {rate: table})


def _response(p: dict[str, float], under: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bogie's vertical acceleration and pitch rate over the profile under both wheelsets; exact for linear pieces."""
    mass, damping, stiffness = _matrices(p)
    lower = np.linalg.solve(mass, np.hstack([-stiffness, -damping]))
    system = np.vstack([np.hstack([np.zeros((5, 5)), np.eye(5)]), lower])
    gain = np.zeros((5, 2))
    gain[3, 0] = gain[4, 1] = CONTACT_STIFFNESS
    slope = np.zeros((5, 2))
    slope[3, 0] = slope[4, 1] = CONTACT_DAMPING
    force = np.linalg.solve(mass, gain @ under + slope @ np.gradient(under, 1 / INNER, axis=1))
    values, vectors = np.linalg.eig(system)
    drive = np.linalg.inv(vectors)[:, 5:] @ (force - force[:, :1])
    e = np.exp(values / INNER)
    first = (e - 1) / values
    ramp = (first - 1 / INNER) / values * INNER
    states = np.stack(
        [signal.lfilter([r, f - r], [1, -x], d) for r, f, x, d in zip(ramp, first, e, drive, strict=True)]
    )
    rates = np.real(vectors[5:] @ states)
    accelerations = np.real(lower @ (vectors @ states)) + force - force[:, :1]
    return accelerations[1], rates[2]


def _matrices(p: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, damping, stiffness of (body z, bogie z, bogie pitch, wheelset 1 z, wheelset 2 z)."""
    arm = p["semi_wheelbase"]
    secondary = np.array([1.0, -1.0, 0, 0, 0])
    first = np.array([0, 1.0, -arm, -1.0, 0])
    second = np.array([0, 1.0, arm, 0, -1.0])
    contact = np.diag([0, 0, 0, 1.0, 1.0])

    def assemble(below: float, above: float, rail: float) -> np.ndarray:
        primary = np.outer(first, first) + np.outer(second, second)
        return 2 * below * primary + 2 * above * np.outer(secondary, secondary) + rail * contact

    mass = np.diag([p["body_mass"], p["bogie_mass"], p["bogie_pitch_inertia"], WHEELSET_MASS, WHEELSET_MASS])
    damping = assemble(p["primary_vertical_damping"], p["secondary_vertical_damping"], CONTACT_DAMPING)
    stiffness = assemble(p["primary_vertical_stiffness"], p["secondary_vertical_stiffness"], CONTACT_STIFFNESS)
    return mass, damping, stiffness
