"""Secondary springs of a bogie: of steel, packed for the empty body, or of air, levelled under what they carry."""

from typing import NamedTuple

import numpy as np

from railsim.force_laws import ForceLaw, Maxwell, Scheduled
from railsim.model import NonlinearElement
from railsim.vehicles.air_spring import Vertical
from railsim.vehicles.running_gear import RunningGear

SIDES = (("left", 1.0), ("right", -1.0))


class SecondarySprings(NamedTuple):
    """Both springs of a bogie.

    Attributes
    ----------
    stiffness : (6, 6) in the middle between them, with the roll bar's [N/m, N/rad, N m/rad].
    force : upwards on the body [N].
    uneven : what the left one bears beyond half of the load [N].
    air : vertical behaviour of the left and the right one, empty where they are of steel.
    """

    stiffness: np.ndarray
    force: float
    uneven: float
    air: tuple[Vertical, ...]

    def elements(
        self, vehicle: RunningGear, ending: str, bogie: str, x: float, height: float
    ) -> list[NonlinearElement]:
        """What air springs have beside their stiffness: pipes, and pressures that differ from side to side."""
        elements = []
        for (side, sign), air in zip(SIDES, self.air, strict=False):
            place = (x, sign * vehicle.secondary_half_spacing, height)
            laws: dict[str, ForceLaw] = {"air_pipe": Maxwell(air.series_stiffness, air.damping)}
            if self.uneven:
                laws["levelling"] = Scheduled(force=-sign * self.uneven)
            elements += [
                NonlinearElement(f"{name}{ending}_{side}", "body", bogie, place, "z", law) for name, law in laws.items()
            ]
        return elements


def secondary_springs(vehicle: RunningGear, load: float, empty_load: float, pressed: float) -> SecondarySprings:
    """Springs of a bogie that bears `load` [N] of the body with its payload, and `empty_load` [N] without, pressed so
    far from their design height [m].

    Raises
    ------
    InputError : an air spring has nothing to carry.
    """
    half, lateral = vehicle.secondary_half_spacing, vehicle.secondary_lateral_stiffness
    vertical, force, uneven = (vehicle.secondary_vertical_stiffness,) * 2, empty_load, 0.0
    air: tuple[Vertical, ...] = ()
    if vehicle.air_spring is not None:
        force, uneven = load, 0.5 * load * vehicle.loaded_body.left / half
        air = tuple(vehicle.air_spring.vertical(0.5 * load + sign * uneven) for _, sign in SIDES)
        vertical = air[0].stiffness, air[1].stiffness
    left, right = (np.diag((vehicle.secondary_longitudinal_stiffness, lateral, k)) for k in vertical)
    stiffness = both_points(left, right, half)
    stiffness[3, 3] += vehicle.roll_bar_stiffness
    return SecondarySprings(stiffness, force + (vertical[0] + vertical[1]) * pressed, uneven, air)


def sides(values: tuple[float, float, float], half_spacing: float) -> np.ndarray:
    """(6, 6) of two equal springs (or dampers) along x, y, z, `half_spacing` [m] to the left and right of the
    element's centre.
    """
    matrix = np.diag(values)
    return both_points(matrix, matrix, half_spacing)


def both_points(left: np.ndarray, right: np.ndarray, half_spacing: float) -> np.ndarray:
    """(6, 6) of two elements with a stiffness or damping (3, 3), as `sides`."""
    total = np.zeros((6, 6))
    for matrix, y in ((left, half_spacing), (right, -half_spacing)):
        jacobian = np.hstack((np.eye(3), [[0.0, 0.0, -y], [0.0, 0.0, 0.0], [y, 0.0, 0.0]]))
        total += jacobian.T @ matrix @ jacobian
    return total
