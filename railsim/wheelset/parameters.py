"""Parameters of the single wheelset with suspended mass (Ward et al. 2011, Appendix 1)."""

from typing import NamedTuple

from railsim.spec import Spec, quantity

_PLAN_VIEW = "illustrative: near the values of published plan-view studies of a Class 175-like vehicle"
_ILLUSTRATIVE = "illustrative"


class Coefficients(NamedTuple):
    """The same numbers under the article's symbols, as the compiled equations take them."""

    m: float
    I: float  # noqa: E741
    I_wy: float
    r0: float
    l: float  # noqa: E741
    W: float
    f11: float
    f22: float
    f23: float
    f33: float
    k_y: float
    f_y: float
    k_psi: float
    f_psi: float
    m_m: float


class WheelsetParameters(Spec, frozen=True):
    """Wheelset, creep coefficients of one wheel, and suspension to a mass that moves laterally.

    Appendix 1 of the article calls I_wy the roll inertia; in equation (12) it multiplies the spin V / r0, so it is the
    moment of inertia about the axle. It also calls f33 a longitudinal coefficient; it is the one of spin. Both are here
    what the equations make of them. W is all that the two wheels carry, because it makes the gravitational stiffness.
    """

    mass: float = quantity(1250.0, unit="kg", source=_PLAN_VIEW, gt=0)
    yaw_inertia: float = quantity(700.0, unit="kg m2", source=_PLAN_VIEW, gt=0)
    spin_inertia: float = quantity(112.0, unit="kg m2", source="Iwnicki 1998, Manchester benchmark vehicle 1", ge=0)
    wheel_radius: float = quantity(0.45, unit="m", source=_ILLUSTRATIVE, gt=0)
    half_width: float = quantity(0.75, unit="m", source="half of CANT_BASE: distance of the rail centres", gt=0)
    load: float = quantity(1.138e5, unit="N", source="weight of wheelset and suspended mass at 9.81 m/s2", ge=0)
    longitudinal_creep: float = quantity(1e7, unit="N", source=_PLAN_VIEW, gt=0)
    lateral_creep: float = quantity(1e7, unit="N", source=_PLAN_VIEW, gt=0)
    lateral_spin_creep: float = quantity(1.2e4, unit="N m", source=_ILLUSTRATIVE, ge=0)
    spin_creep: float = quantity(20.0, unit="N m2", source=_ILLUSTRATIVE, ge=0)
    lateral_stiffness: float = quantity(2.5e5, unit="N/m", source=_ILLUSTRATIVE, ge=0)
    lateral_damping: float = quantity(2e4, unit="N s/m", source=_ILLUSTRATIVE, ge=0)
    yaw_stiffness: float = quantity(2.5e6, unit="N m/rad", source=_ILLUSTRATIVE, ge=0)
    yaw_damping: float = quantity(0.0, unit="N m s/rad", source=_ILLUSTRATIVE, ge=0)
    suspended_mass: float = quantity(
        10_350.0, unit="kg", source="illustrative: quarter of a 34 460 kg body with two 3 477 kg bogies", gt=0
    )

    def coefficients(self) -> Coefficients:
        """The numbers by the article's symbols."""
        return Coefficients(
            m=self.mass,
            I=self.yaw_inertia,
            I_wy=self.spin_inertia,
            r0=self.wheel_radius,
            l=self.half_width,
            W=self.load,
            f11=self.longitudinal_creep,
            f22=self.lateral_creep,
            f23=self.lateral_spin_creep,
            f33=self.spin_creep,
            k_y=self.lateral_stiffness,
            f_y=self.lateral_damping,
            k_psi=self.yaw_stiffness,
            f_psi=self.yaw_damping,
            m_m=self.suspended_mass,
        )
