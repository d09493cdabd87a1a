"""Names of the truth channels in the order in which both engines write a row."""

from railsim.model import Model

SIDES = ("left", "right")
RUN = ("s [m]", "speed [m/s]", "acceleration [m/s2]", "position.east [m]", "position.north [m]", "position.up [m]")
BODY = (
    "y [m]", "z [m]", "roll [rad]", "pitch [rad]", "yaw [rad]",
    "y_rate [m/s]", "z_rate [m/s]", "roll_rate [rad/s]", "pitch_rate [rad/s]", "yaw_rate [rad/s]",
    "specific_force_x [m/s2]", "specific_force_y [m/s2]", "specific_force_z [m/s2]",
    "angular_velocity_x [rad/s]", "angular_velocity_y [rad/s]", "angular_velocity_z [rad/s]",
    "angular_acceleration_x [rad/s2]", "angular_acceleration_y [rad/s2]", "angular_acceleration_z [rad/s2]",
    "x [m]", "x_rate [m/s]",
)  # fmt: skip
"""Of a body; x: along the track, from its place in the vehicle at rest; 0 where it cannot move so."""

SPIN = ("spin_angle [rad]", "spin [rad/s]")
TRACK = (
    "curvature [1/m]",
    "cant [m]",
    "left_vertical [m]",
    "right_vertical [m]",
    "left_lateral [m]",
    "right_lateral [m]",
)
WHEEL = (
    "normal_force [N]", "creep_force_x [N]", "creep_force_y [N]", "creepage_x [-]", "creepage_y [-]",
    "spin_creepage [1/m]", "contact_angle [rad]", "rolling_radius [m]", "lateral_shift [m]", "friction [-]",
)  # fmt: skip
SECOND = (
    "second_normal_force [N]", "second_creep_force_x [N]", "second_creep_force_y [N]", "second_creepage_x [-]",
    "second_creepage_y [-]", "second_spin_creepage [1/m]", "second_contact_angle [rad]", "second_rolling_radius [m]",
    "second_contact_y [m]", "second_friction [-]",
)  # fmt: skip
"""Of the second contact of a wheel, where it may have one; `second_contact_y`: its lateral place in the track frame."""

CORUNNING = (
    "left_rail_z [m]", "left_rail_y [m]", "right_rail_z [m]", "right_rail_y [m]",
    "sleeper_z [m]", "sleeper_y [m]", "sleeper_roll [rad]", "support_stiffness [N/m]", "void_gap [m]",
)  # fmt: skip
"""Of a track that runs with a wheelset: displacements from the track without load, stiffness below each rail."""


def channel_names(model: Model) -> list[str]:
    """Columns of a truth record: time, run, bodies, then spin, track and wheels of each wheelset, then
    displacements, then the track below.
    """
    names = ["time [s]", *RUN]
    for body in model.bodies:
        names += [f"{body.name}.{quantity}" for quantity in BODY]
    for number, wheelset in enumerate(model.wheelsets, 1):
        names += [f"{wheelset.body}.{quantity}" for quantity in SPIN]
        names += [f"track{number}.{quantity}" for quantity in TRACK]
        for side in SIDES:
            kept = WHEEL + SECOND if model.contact.contacts > 1 else WHEEL
            names += [f"wheel{number}_{side}.{quantity}" for quantity in kept]
    for number, wheelset in enumerate(model.wheelsets, 1):
        if wheelset.frame is not None:
            names += [f"primary{number}_{side}.displacement [m]" for side in SIDES]
    if model.corunning is not None:
        names += [f"track{n}.{quantity}" for n in range(1, len(model.wheelsets) + 1) for quantity in CORUNNING]
    return names
