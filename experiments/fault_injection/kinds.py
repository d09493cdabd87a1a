"""All kinds of fault that are put into recordings."""

from collections.abc import Callable

from experiments.fault_injection import faults, logger_faults
from experiments.fault_injection.faults import Fault, Spoiler

FAULTS: dict[str, Callable[[Spoiler], Fault]] = {
    **faults.FAULTS,
    "clock rate": logger_faults.clock_rate,
    "gyro bias": logger_faults.gyro_bias,
    "repeated": logger_faults.repeated,
    "reordered": logger_faults.reordered,
    "byte order": logger_faults.byte_order,
    "unit": logger_faults.unit,
    "turned": logger_faults.turned,
}
"""By the name of the kind: what puts it in. `railsim inspect` names a gyro's bias an offset, all others so."""
