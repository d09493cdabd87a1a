"""Equations of motion as compiled kernels: what all engines share."""
