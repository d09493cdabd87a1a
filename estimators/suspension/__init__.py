"""Condition of the secondary suspension: dampers and conicity."""
