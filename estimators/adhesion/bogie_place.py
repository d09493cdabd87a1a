"""Which bogie of a vehicle the filter's half vehicle stands for, and what its bodies are called in the recording."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from estimators.vehicle.lateral_frequency import is_whole
from railsim.data_sheet import channels_on, data_sheet
from railsim.measurements import Measurements

OVER_PIVOT = 0.2
"""How far from a bogie's centre a lateral accelerometer on the body may stand, over the bogies' distance from the
body's centre: it shows the other end's movement by half that share (illustrative).
"""


class BogiePlace(NamedTuple):
    """A bogie with its two wheelsets, and the part of the body above it.

    Attributes
    ----------
    bodies : names in the recording, by the filter's names of the bodies.
    pivot : how far the bogie's centre is before the origin of the body's sensors, m. reach : how far from it a lateral
        accelerometer on the body may stand, m.
    """

    bodies: Mapping[str, str]
    pivot: float = 0.0
    reach: float = float("inf")

    def channels(self, measurements: Measurements, body: str, quantity: str) -> list[str]:
        """Channels of one of the filter's bodies whose quantity begins with `quantity`."""
        names = channels_on(measurements, self.bodies[body], quantity)
        if body != "body" or not quantity.startswith("acceleration"):
            return names
        return [one for one in names if abs(self.ahead(measurements, one)) <= self.reach]

    def ahead(self, measurements: Measurements, channel: str) -> float:
        """How far a sensor of the body stands before the bogie's centre, m."""
        return data_sheet(measurements.about, channel).position[0] - self.pivot

    def column(self, name: str) -> str:
        """Name of a column by the recording's name of its body."""
        body, _, quantity = name.partition(".")
        return f"{self.bodies[body]}.{quantity}"


LEADING: Mapping[str, str] = {name: name for name in ("wheelset1", "wheelset2", "bogie", "body")}
TRAILING: Mapping[str, str] = {"wheelset1": "wheelset3", "wheelset2": "wheelset4", "bogie": "bogie2", "body": "body"}
HALF = BogiePlace(LEADING)


def places(vehicle: Mapping[str, Any]) -> tuple[BogiePlace, ...]:
    """The bogies of a vehicle, the leading one first; of half a vehicle its only one."""
    if not is_whole(vehicle):
        return (HALF,)
    distance = float(vehicle["semi_bogie_spacing"])
    reach = OVER_PIVOT * distance
    return BogiePlace(LEADING, distance, reach), BogiePlace(TRAILING, -distance, reach)
