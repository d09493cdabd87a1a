"""One wheelset with a suspended mass in plan view: the equations of Ward et al. 2011, Appendix 2."""

from railsim.wheelset.contact import RollingTable, cone, cone_conicity, conical, rolling_table
from railsim.wheelset.linear import LinearWheelset, critical_speed, full_linear, simplified_linear
from railsim.wheelset.parameters import WheelsetParameters
from railsim.wheelset.simulate import simulate_linear, simulate_wheelset

__all__ = [
    "LinearWheelset",
    "RollingTable",
    "WheelsetParameters",
    "cone",
    "cone_conicity",
    "conical",
    "critical_speed",
    "full_linear",
    "rolling_table",
    "simplified_linear",
    "simulate_linear",
    "simulate_wheelset",
]
