"""Shared: linear models of the vehicle from its nominal parameters."""
