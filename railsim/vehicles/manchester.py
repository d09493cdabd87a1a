"""Passenger vehicle 1 of the Manchester benchmarks."""

from railsim.vehicles.half_vehicle import HalfVehicle


class Manchester(HalfVehicle, frozen=True):
    """Half of passenger vehicle 1 (Iwnicki 1998); the defaults of `HalfVehicle` are its numbers, with their sources."""
