"""Wheel-rail geometry: conicity, rolling radii, contact angles."""
