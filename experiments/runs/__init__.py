"""Simulated runs that figures and calibrations share."""
