"""Contact functions of a wheel and rail profile over the lateral shift, as the kernels' tables want them."""

import numpy as np

from railsim.contact.functions import ContactFunctions
from railsim.profiles.layout import Layout
from railsim.profiles.profile import Profile
from railsim.profiles.search import Side

LEAST_CURVATURE = 0.2
"""Smallest sum of lateral curvatures in a table [1/m]: a conformal pair is no Hertzian contact."""

SUBSTEPS = 2
"""Steps of the search within a cell of the table."""


def contact_functions(
    wheel: Profile,
    rail: Profile,
    layout: Layout,
    load: float = 10e3,
    blend: float = 2.5e-4,
    reach: float = 0.015,
    points: int = 601,
) -> ContactFunctions:
    """Contact functions of one side at zero roll and yaw; build both sides of a wheelset with their own profiles.

    Parameters
    ----------
    wheel, rail : profiles in the frame of the side (for the right side, too, y counts towards the field); measured
    ones smoothed, the rail inclined as it lies.
    load : wheel load for the quasi-elastic averaging [N], see `railsim.profiles.search`.
    blend : half width over which all functions are averaged along u, weights (1 - t^2)^3 [m]. Where the contact jumps
    from the tread to the flange, both points share the load over some micrometres of u only, less than a table's
    cell; the lift, averaged by the same weights as its slope, stays the potential of the averaged angle.
    reach, points : grid of u from -reach to reach [m].

    Raises
    ------
    ValueError : wheel and rail do not overlap within `reach`, or the rail lacks its gauge face.
    """
    side = Side(wheel, rail, layout, load)
    shift = np.linspace(-reach, reach, points)
    step, margin, weights = averaging_weights(blend, reach, points)
    fine = step * np.arange(-margin - (points - 1) // 2 * SUBSTEPS, margin + (points - 1) // 2 * SUBSTEPS + 1)
    outline = side.outline()
    contacts = [side.contact(outline, float(u)) for u in fine]
    columns = np.array([(c.height, c.radius, c.half_distance, c.curvature) for c in contacts])
    averaged = np.column_stack([np.convolve(column, weights, mode="valid") for column in columns.T])[::SUBSTEPS]
    lift, radius, half_distance, curvature = averaged.T
    return ContactFunctions(
        shift=shift,
        lift=lift - lift[points // 2],
        radius=radius,
        half_distance=half_distance,
        curvature=np.maximum(curvature, LEAST_CURVATURE),
    )


def averaging_weights(blend: float, reach: float, points: int) -> tuple[float, int, np.ndarray]:
    """Step of a grid finer than the table's [m], steps that `blend` [m] is long, weights of the averaging over it."""
    shift = np.linspace(-reach, reach, points)
    step = (shift[1] - shift[0]) / SUBSTEPS
    margin = int(np.ceil(blend / step))
    weights = np.clip(1.0 - (step * np.arange(-margin, margin + 1) / max(blend, step)) ** 2, 0.0, None) ** 3
    return step, margin, weights / weights.sum()
