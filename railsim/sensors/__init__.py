"""Sensors: one kind a file, found by its module name; each stands on a body at a position and has a data sheet."""
