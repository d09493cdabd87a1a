"""Passenger vehicle 1 of the Manchester benchmarks, whole."""

from railsim.vehicles.whole_vehicle import WholeVehicle


class ManchesterWhole(WholeVehicle, frozen=True):
    """Passenger vehicle 1 of the Manchester benchmarks (Iwnicki 1998), whole.

    The defaults of `WholeVehicle` are its numbers, with their sources.
    """
