"""Passenger vehicle 1 of the Manchester benchmarks."""

from railsim.vehicles.half_vehicle import HalfVehicle


class Manchester(HalfVehicle, frozen=True):
    """Half of passenger vehicle 1 of the Manchester benchmarks (Iwnicki 1998).

    The defaults of `HalfVehicle` are its numbers, with their sources.
    """
