"""Rigid creepages of one wheel, as CONTACT states them."""

import numpy as np

from railsim.profiles.search import ProfileContact


def creepages(
    contact: ProfileContact, roll: float, yaw: float, speed: float, spin: float
) -> tuple[float, float, float]:
    """Longitudinal [-], lateral [-] and spin creepage [1/m] of the wheel over the rail on straight track.

    Slip velocity of the rigid wheel at the contact, resolved along the rail and in the contact plane across it, over
    the mean of the forward and the rolling speed (CONTACT's reference velocity). The kernels (railsim.contact.wheel)
    resolve along the wheel and divide by the forward speed: the two agree to second order in yaw and first order in
    creepage.

    Parameters
    ----------
    contact : from `Side`; its frame is that of the result: x forward, y towards the field side, z up.
    roll, yaw : of the wheelset in the side's frame [rad]. speed : forward speed, along the rail [m/s].
    spin : angular velocity about the axle, positive rolling forward [rad/s].
    """
    axle = spin * np.array([-np.sin(yaw) * np.cos(roll), np.cos(yaw) * np.cos(roll), np.sin(roll)])
    turning = np.cross(axle, np.array(contact.position))
    slip = np.array([speed, 0.0, 0.0]) + turning
    reference = 0.5 * (speed - turning[0])
    cos, sin = np.cos(contact.angle), np.sin(contact.angle)
    across = slip[1] * cos + slip[2] * sin
    return float(slip[0] / reference), float(across / reference), float((axle[2] * cos - axle[1] * sin) / reference)
