"""Factors from SI units to those that people read."""

KMH = 3.6
"""km/h in 1 m/s."""
MM = 1e3
"""mm in 1 m, and mrad in 1 rad."""
