"""Scratch memory of the kernels: where every intermediate result stands, and arrays of the right size."""

import itertools

import numpy as np

from railsim.dynamics.channels import WHEEL
from railsim.dynamics.corunning import SETTLING
from railsim.dynamics.wheels import WHEELS


def _places(*sizes: int) -> list[slice]:
    """Slices of so many numbers, one after the other."""
    ends = list(itertools.accumulate(sizes))
    return [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]


# Of the right-hand side in the moving frame, the same for every model: motion of the frame; a pose; coordinates of a
# wheelset on its own piece of track; what wheels that are not round add; an element to second order; the poses of the
# two wheelsets that are evaluated at once, and their wheels; coordinates of a wheelset on a track
# that moves, and what takes the contacts with these implicit.
FRAME, POSE, LOCAL, EXTRA, ELEMENT, POSES, LANES, ON_TRACK, CONTACTS = _places(9, 12, 8, 5, 96, 24, WHEELS, 8, SETTLING)
JOINT = 30  # of each pair of bodies in two track frames, behind the rest
JOINTS = slice(CONTACTS.stop, None)

# Of the forces in absolute coordinates, for each body: track frame (rotation matrix, origin, curvature, distance),
# motion relative to it (position, angles, their rates, the frame's speed), the body's rotation matrix. The rows also
# hold, one a row, the track frames to which the model's coordinates refer.
BODY_FRAME, BODY_MOTION, BODY_ROTATION, ORIGIN_FRAME = _places(16, 13, 9, 16)
DISTANCE, SPEED = BODY_FRAME.stop - 1, BODY_MOTION.stop - 1

# In the row behind the bodies': a pose; coordinates of a wheelset; a body's motion relative to the reference's frame; a
# force and a moment; what wheels that are not round add; yaw and yaw rate of the body that keeps the chord's direction;
# nine vectors of an element between two points; a wheelset on a right rail that moves; then the free coordinates in the
# vehicle frame and their rates.
REFERENCE_POSE, WHEELSET, RELATIVE, WRENCH, WHEELSET_EXTRA, CHORD, POINTS, ON_RIGHT = _places(12, 8, 13, 6, 5, 2, 27, 8)
COORDINATES = ON_RIGHT.stop

NO_WHEELS = np.empty((0, len(WHEEL)))  # where the contacts are not asked for


def workspace(joints: int) -> np.ndarray:
    """For the right-hand side in the moving frame of a plant with so many joints; zeros, so that lanes without a wheel
    hold no NaN.
    """
    return np.zeros(CONTACTS.stop + JOINT * joints)


def absolute_workspace(bodies: int, coordinates: int) -> np.ndarray:
    """(bodies + 1, numbers) for the forces in absolute coordinates of a model with so many free coordinates."""
    return np.zeros((bodies + 1, max(ORIGIN_FRAME.stop, COORDINATES + 2 * coordinates)))
