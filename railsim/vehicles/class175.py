"""A Class 175-like diesel multiple unit coach: illustrative wherever no source is named."""

from railsim.spec import quantity
from railsim.vehicles.half_vehicle import HalfVehicle
from railsim.vehicles.running_gear import ILLUSTRATIVE, RunningGear

PLAN_VIEW = "published plan-view studies of a Class 175-like half vehicle; not confirmed, so illustrative"
WARD = "Ward et al. (2011), section 5.2"


class Class175Gear(RunningGear, frozen=True):
    """Wheelbase of the paper's speed study and secondary yaw dampers, whose condition section 4.1 of the paper
    monitors.
    """

    bogie_mass: float = quantity(3477.0, unit="kg", source=PLAN_VIEW, gt=0.0)
    bogie_roll_inertia: float = quantity(2100.0, unit="kg m2", source=ILLUSTRATIVE, gt=0.0)
    bogie_pitch_inertia: float = quantity(2400.0, unit="kg m2", source=ILLUSTRATIVE, gt=0.0)
    bogie_yaw_inertia: float = quantity(3200.0, unit="kg m2", source=ILLUSTRATIVE, gt=0.0)
    wheelset_mass: float = quantity(1376.0, unit="kg", source=PLAN_VIEW, gt=0.0)
    wheelset_yaw_inertia: float = quantity(766.0, unit="kg m2", source=PLAN_VIEW, gt=0.0)
    wheelset_spin_inertia: float = quantity(90.0, unit="kg m2", source=ILLUSTRATIVE, gt=0.0)
    wheel_radius: float = quantity(0.42, unit="m", source=ILLUSTRATIVE, gt=0.1)
    semi_wheelbase: float = quantity(1.3, unit="m", source=WARD, gt=0.0)
    semi_bogie_spacing: float = quantity(8.0, unit="m", source=ILLUSTRATIVE, gt=0.0)
    primary_longitudinal_stiffness: float = quantity(15e6, unit="N/m", source=ILLUSTRATIVE, gt=0.0)
    primary_lateral_stiffness: float = quantity(5e6, unit="N/m", source=ILLUSTRATIVE, gt=0.0)
    primary_vertical_stiffness: float = quantity(1.1e6, unit="N/m", source=ILLUSTRATIVE, gt=0.0)
    primary_vertical_damping: float = quantity(6e3, unit="N s/m", source=ILLUSTRATIVE, ge=0.0)
    secondary_lateral_damping: float = quantity(20e3, unit="N s/m", source=ILLUSTRATIVE, ge=0.0)
    yaw_damper_damping: float = quantity(150e3, unit="N s/m", source=f"{ILLUSTRATIVE}; per damper", ge=0.0)


class Class175(Class175Gear, HalfVehicle, frozen=True):
    """Half of a Class 175-like coach: one bogie, two wheelsets and half of the body."""

    body_mass: float = quantity(17230.0, unit="kg", source=f"{PLAN_VIEW}; half of 34 460 kg", gt=0.0)
    body_roll_inertia: float = quantity(30000.0, unit="kg m2", source=ILLUSTRATIVE, gt=0.0)
