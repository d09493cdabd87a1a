"""Sensors at the wheelsets and away from the bogie's middle, split into what lifts and what rolls the vehicle."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from estimators.signals.bands import transform
from estimators.speed.odometry import Odometry
from estimators.track.observations import Attitude, Observation, combined, observation
from estimators.vehicle.state_space import Output
from railsim.constants import GRAVITY
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements

NOD_REACH = 2.0  # m; the speed's own noise is averaged over this length; no longer, for at a stop the sign changes
CENTRED = 0.05  # m; a vertical accelerometer farther to the side feels roll
SHORTEST = 3.0  # m; of the bands; noise that grows with the wavenumber is taken as it is there
ROLL_RATE = "bogie.rate_roll [rad/s]"
WHEELSETS = ((1, 1.0), (2, -1.0))
"""Numbers of the leading and trailing wheelset, and their side of the bogie's centre."""


def pair(measurements: Measurements, number: int, quantity: str) -> list[str]:
    """Channels "..._left.quantity" and "..._right.quantity" of one wheelset, those that there are."""
    return [name for name in channels_of(quantity, (number,)) if name in measurements]


def channels_of(quantity: str, numbers: Sequence[int] = (1, 2)) -> list[str]:
    """Names of transducers ("displacement [m]") or axlebox accelerometers of these wheelsets, left and right."""
    prefix = {"displacement [m]": "primary", "acceleration_z [m/s2]": "axlebox"}[quantity]
    return [f"{prefix}{number}_{side}.{quantity}" for number in numbers for side in ("left", "right")]


def without_roll(
    measurements: Measurements, odometry: Odometry, accelerometer: Observation, moved: Attitude | None
) -> list[Observation]:
    """A vertical accelerometer of the bogie less y times the roll's acceleration, by the roll gyro; nothing if it is
    beside the middle and there is no such gyro.
    """
    y = accelerometer.output.position[1]
    if abs(y) <= CENTRED:
        return [accelerometer]
    if moved is None:
        return []
    spun = odometry.speed * np.gradient(moved.roll_rate, odometry.spacing)
    gyro = data_sheet(measurements.about, ROLL_RATE).error("noise_density")
    noise = abs(y) * gyro * 2.0 * np.pi * float(np.median(odometry.speed)) / SHORTEST
    return [
        replace(
            accelerometer, values=accelerometer.values - y * spun, density=float(np.hypot(accelerometer.density, noise))
        )
    ]


def displacements(measurements: Measurements, odometry: Odometry, half_difference: bool) -> list[Observation]:
    """Primary displacement transducers, left and right of a wheelset together.

    Their mean also shows how the bogie pitches as the vehicle is braked or driven: a length per acceleration that
    depends on where the force comes from, and so is estimated.
    """
    pairs = []
    for number, x in WHEELSETS:
        names = pair(measurements, number, "displacement [m]")
        if len(names) == 2:
            ends = [_displacement(measurements, odometry, name, x, not half_difference) for name in names]
            pairs.append(combined(ends[0], ends[1], half_difference, _step(odometry)))
    return pairs


def axleboxes(measurements: Measurements, odometry: Odometry, half_difference: bool) -> list[Observation]:
    """Vertical accelerometers on both axleboxes of a wheelset together: its lift, or its roll (half the difference)."""
    pairs = []
    for number, x in WHEELSETS:
        names = pair(measurements, number, "acceleration_z [m/s2]")
        if len(names) == 2:
            ends = [_axlebox(measurements, odometry, name, x) for name in names]
            sheets = [data_sheet(measurements.about, name) for name in names]
            arm = (sheets[0].position[1] - sheets[1].position[1]) / 2.0
            skew = sheets[0].error("misalignment_std")
            one = combined(ends[0], ends[1], half_difference, _step(odometry), skew)
            pairs.append(replace(one, output=Output("lift", (x, arm, 0.0))) if half_difference else one)
    return pairs


def singles(
    measurements: Measurements,
    odometry: Odometry,
    mean: Callable[[Output], tuple[np.ndarray, float]],
) -> list[Observation]:
    """Transducers and axlebox accelerometers without one on the other side, as halves of a difference.

    Parameters
    ----------
    mean : from the output of a pair's mean to its course by the vertical estimate, shape (n,), and the density of that
        course's error; what is left of a single one belongs to the roll.
    """
    halves = []
    for number, x in WHEELSETS:
        for quantity in ("displacement [m]", "acceleration_z [m/s2]"):
            names = pair(measurements, number, quantity)
            if len(names) != 1:
                continue
            side = 1.0 if "_left." in names[0] else -1.0
            if quantity.startswith("displacement"):
                reading, output = (
                    _displacement(measurements, odometry, names[0], x, False),
                    Output("displacement", (x, 0.0, 0.0)),
                )
            else:
                reading, output = _axlebox(measurements, odometry, names[0], x), Output("lift", (x, side, 0.0))
                output = replace(output, position=(x, abs(data_sheet(measurements.about, names[0]).position[1]), 0.0))
            course, density = mean(reading.output)
            values = side * (reading.values - course)
            halves.append(
                replace(reading, values=values, output=output, density=float(np.hypot(reading.density, density)))
            )
    return halves


def _step(odometry: Odometry) -> float:
    """Typical duration of a step of the grid, s."""
    return odometry.spacing / float(np.median(odometry.speed))


def _displacement(measurements: Measurements, odometry: Odometry, name: str, x: float, nods: bool) -> Observation:
    turning = (forward(odometry), np.zeros(len(odometry.s))) if nods else None
    output = Output("displacement", (x, 0.0, 0.0))
    return observation(measurements, odometry, name, output, turning=turning, mounting=nod(measurements.vehicle))


def _axlebox(measurements: Measurements, odometry: Odometry, name: str, x: float) -> Observation:
    return with_rails(measurements, odometry, name, Output("axlebox", (x, 0.0, 0.0)), GRAVITY)


def with_rails(
    measurements: Measurements, odometry: Odometry, name: str, output: Output, typical: float = 0.0
) -> Observation:
    """Acceleration of what follows the rails, averaged with triangular weights over two steps.

    Between the places of the grid the track is taken to be straight, so that all of its curvature is at the places.
    What follows the rails then has the second difference of the track for its mean acceleration, half a step late.
    """
    reading = observation(measurements, odometry, name, output, typical=typical, late=odometry.spacing / 2.0)
    known = np.isfinite(reading.values)
    bridged = (
        np.interp(odometry.s, odometry.s[known], reading.values[known]) if known.any() else np.zeros(len(odometry.s))
    )
    smooth = transform(
        bridged,
        odometry.spacing,
        lambda k: np.sinc(k * odometry.spacing / (2.0 * np.pi)) ** 2,
        4.0 * odometry.spacing,
        detrend=False,
    )
    return replace(reading, values=np.where(known, smooth, np.nan))


def forward(odometry: Odometry) -> np.ndarray:
    """Acceleration along the track from the speed, m/s2, shape (n,): d(V^2 / 2)/ds, mean over `NOD_REACH`; V^2 is a
    straight line over distance up to a stop, where V itself is not.
    """
    rate = np.gradient(0.5 * odometry.speed**2, odometry.spacing)
    return uniform_filter1d(rate, max(1, round(NOD_REACH / odometry.spacing)))


def nod(vehicle: Mapping[str, float]) -> float:
    """Movement over a wheelset as all of the vehicle's inertia pitches the bogie, m per m/s2: the most there can be."""
    mass = vehicle["body_mass"] + vehicle["bogie_mass"] + 2.0 * vehicle["wheelset_mass"]
    lever = vehicle["secondary_height"] - vehicle["wheel_radius"]
    return mass * abs(lever) / (4.0 * vehicle["primary_vertical_stiffness"] * vehicle["semi_wheelbase"])
