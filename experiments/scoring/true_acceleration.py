"""True acceleration at the place of an estimate's sensor."""

import numpy as np

from estimators.interface import Estimate
from railsim.errors import InputError
from railsim.sensors.accelerometer import Accelerometer
from railsim.truth import Truth


def true_acceleration(estimate: Estimate, truth: Truth, axis: str) -> np.ndarray:
    """Specific force at the sensor's place along an axis of its body, m/s2.

    Raises
    ------
    InputError : the estimate does not say where its sensor stands.
    """
    body, position = estimate.about.get("body"), estimate.about.get("position [m]")
    if not isinstance(body, str) or not isinstance(position, list) or len(position) != 3:
        raise InputError(f"{estimate.name}: about gives no body and position of its sensor; nothing to compare with")
    settings = {"name": "true", "body": body, "position": position, "rate": truth.rate}
    return Accelerometer.build(settings).component(truth, "xyz".index(axis))
