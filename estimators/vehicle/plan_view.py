"""Plan view of the half vehicle: lateral position and yaw of two wheelsets and the bogie, lateral position of the body.

Nothing rolls but the wheelsets, and these as the rails do (Wickens 2003; Ward et al. 2011, (16) and (17)).
"""

from estimators.vehicle.linear_model import Element
from estimators.vehicle.parameters import Parameters
from estimators.vehicle.suspension import Heights, half_vehicle_bogies, lateral_springs, yaw_springs

COORDINATES = (
    "wheelset1.y", "wheelset1.yaw", "wheelset2.y", "wheelset2.yaw", "bogie.y", "bogie.yaw", "body.y",
)  # fmt: skip
RAILS = ("wheelset1.rail_y", "wheelset2.rail_y", "wheelset1.rail_roll", "wheelset2.rail_roll")
NEEDED = (
    "semi_wheelbase",
    "half_gauge",
    "wheel_radius",
    "wheelset_mass",
    "wheelset_yaw_inertia",
    "bogie_mass",
    "bogie_yaw_inertia",
    "body_mass",
    "primary_half_spacing",
    "primary_longitudinal_stiffness",
    "primary_lateral_stiffness",
    "primary_longitudinal_damping",
    "primary_lateral_damping",
    "secondary_half_spacing",
    "secondary_longitudinal_stiffness",
    "secondary_lateral_stiffness",
    "secondary_lateral_damping",
    "design_conicity",
    "design_contact_angle_rate",
    "design_contact_curvature",
    "design_wheel_load",
)


def suspension(p: Parameters, above: Heights) -> list[Element]:
    """Springs and dampers that act in plan view."""
    bogies = half_vehicle_bogies(p)
    return lateral_springs(p, bogies, above) + yaw_springs(p, bogies)
