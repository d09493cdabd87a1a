"""Estimators: one a file, found by its module name."""
