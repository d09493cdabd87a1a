"""Physical constants that simulator, estimators and experiments share."""

GRAVITY = 9.81
"""Acceleration of free fall, m/s2; the unit "g" of a data file is another number (`railsim.field.units`)."""
