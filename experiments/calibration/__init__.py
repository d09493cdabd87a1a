"""Calibrations that an estimator ships with: how they were made."""
