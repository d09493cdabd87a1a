"""Vehicles and parameter sets: one a file."""
