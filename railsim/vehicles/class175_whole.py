"""A whole Class 175-like coach: illustrative wherever no source is named."""

from railsim.spec import quantity
from railsim.vehicles.class175 import PLAN_VIEW, Class175Gear
from railsim.vehicles.running_gear import ILLUSTRATIVE
from railsim.vehicles.whole_vehicle import WholeVehicle


class Class175Whole(Class175Gear, WholeVehicle, frozen=True):
    """Whole Class 175-like coach on two bogies; its yaw dampers have elastic mounts and blow off."""

    body_mass: float = quantity(34460.0, unit="kg", source=PLAN_VIEW, gt=0.0)
    body_roll_inertia: float = quantity(60000.0, unit="kg m2", source=ILLUSTRATIVE, gt=0.0)
    body_pitch_inertia: float = quantity(1.6e6, unit="kg m2", source=ILLUSTRATIVE, gt=0.0)
    body_yaw_inertia: float = quantity(1.6e6, unit="kg m2", source=ILLUSTRATIVE, gt=0.0)
    yaw_damper_height: float | None = quantity(0.6, unit="m above the rails", source=ILLUSTRATIVE, gt=0.0)
    traction_rod_height: float | None = quantity(0.6, unit="m above the rails", source=ILLUSTRATIVE, gt=0.0)
    yaw_damper_series_stiffness: float | None = quantity(6e6, unit="N/m", source=ILLUSTRATIVE, gt=0.0)
    yaw_damper_blow_off_velocity: float | None = quantity(0.08, unit="m/s", source=ILLUSTRATIVE, gt=0.0)
    yaw_damper_blow_off_share: float = quantity(0.05, unit="- of the damping, beyond", source=ILLUSTRATIVE, ge=0.0)
