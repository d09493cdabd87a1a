"""What differs between the two bogies of a whole vehicle: no two springs or dampers of a sheet are alike."""

from typing import Any

from railsim.spec import Spec, quantity

OF_SHEET = "1 = as the leading bogie's, which the vehicle's own field states"


def _stiffness() -> Any:
    return quantity(1.0, unit="-, factor", source=OF_SHEET, gt=0.0)


def _damping() -> Any:
    return quantity(1.0, unit="-, factor", source=OF_SHEET, ge=0.0)


class RearBogie(Spec, frozen=True):
    """Factors on the suspension of the rear bogie, each by the vehicle's field of that name."""

    primary_longitudinal_stiffness: float = _stiffness()
    primary_lateral_stiffness: float = _stiffness()
    primary_vertical_stiffness: float = _stiffness()
    primary_vertical_damping: float = _damping()
    secondary_lateral_stiffness: float = _stiffness()
    secondary_vertical_stiffness: float = _stiffness()
    secondary_lateral_damping: float = _damping()
    secondary_vertical_damping: float = _damping()
    yaw_damper_damping: float = _damping()

    def changes(self, vehicle: Spec) -> dict[str, float]:
        """Fields of the vehicle that are others at the rear bogie, with their values there."""
        factors = {name: float(getattr(self, name)) for name in type(self).model_fields}
        return {name: factor * getattr(vehicle, name) for name, factor in factors.items() if factor != 1.0}
