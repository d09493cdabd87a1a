"""Air springs: a bag and a reservoir that a pipe joins, levelled to the height at which they were built."""

from typing import NamedTuple

from railsim.errors import InputError
from railsim.spec import Spec, quantity

ATMOSPHERE = 101325.0  # Pa
NISHIMURA = "Oda and Nishimura (1970), Bulletin of JSME 13(55), 43"
ILLUSTRATIVE = "illustrative"


class Vertical(NamedTuple):
    """Vertical behaviour of an air spring about its height: a spring of `stiffness` [N/m] that always acts, and beside
    it a spring of `series_stiffness` [N/m] in series with a damper of `damping` [N s/m].
    """

    stiffness: float
    series_stiffness: float
    damping: float


class AirSpring(Spec, frozen=True):
    """One bag with its reservoir and pipe, vertically by the model of Nishimura.

    The levelling valve keeps the bag at its height, whatever it carries: the pressure follows the load. The valve is
    slow, so that in a run the mass of air stays as it was at the start.
    """

    area: float = quantity(0.25, unit="m2, effective", source=ILLUSTRATIVE, gt=0.0)
    area_rate: float = quantity(0.2, unit="m2/m, growth of the area when pressed", source=ILLUSTRATIVE)
    bag_volume: float = quantity(0.03, unit="m3", source=ILLUSTRATIVE, gt=0.0)
    reservoir_volume: float = quantity(0.06, unit="m3", source=ILLUSTRATIVE, gt=0.0)
    exponent: float = quantity(1.4, unit="-, polytropic", source="1.4 adiabatic, 1 isothermal", ge=1.0, le=1.4)
    pipe_damping: float = quantity(
        60e3, unit="N s/m at the bag, at `pipe_pressure`", source=f"{ILLUSTRATIVE}; model: {NISHIMURA}", gt=0.0
    )
    pipe_pressure: float = quantity(415e3, unit="Pa, absolute", source=ILLUSTRATIVE, gt=0.0)

    def pressure(self, load: float) -> float:
        """Absolute pressure [Pa] under a load [N]."""
        return ATMOSPHERE + load / self.area

    def vertical(self, load: float) -> Vertical:
        """Stiffness and damping under a load [N].

        Nishimura's bag k1 = n p A^2 / V1, in series with the reservoir k2 = n p A^2 / V2 beside the pipe c, and beside
        both k3 = (p - p0) dA/dz. A spring beside a spring and damper in series is the same: k1 k2 / (k1 + k2) + k3;
        k1^2 / (k1 + k2); c (k1 / (k1 + k2))^2. The pipe resists in proportion to the density of the air, as an orifice
        does at equal flow (Berg 1999, Vehicle System Dynamics Suppl. 33), linearised.

        Raises
        ------
        InputError : the bag carries nothing, or is not stable.
        """
        if load <= 0.0:
            raise InputError(f"air_spring: a bag carries {load:.4g} N; move the payload nearer to the middle")
        pressure = self.pressure(load)
        bag, reservoir = (
            self.exponent * pressure * self.area**2 / volume for volume in (self.bag_volume, self.reservoir_volume)
        )
        share = bag / (bag + reservoir)
        stiffness = share * reservoir + (pressure - ATMOSPHERE) * self.area_rate
        if stiffness <= 0.0:
            raise InputError(
                f"air_spring: area_rate {self.area_rate:g} m makes it fall together under {load:.4g} N; "
                f"give more than {self.area_rate - stiffness * self.area / load:.3g}"
            )
        return Vertical(stiffness, share * bag, self.pipe_damping * pressure / self.pipe_pressure * share**2)
