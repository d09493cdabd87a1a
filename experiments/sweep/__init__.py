"""Sweeps: a design over the keys of a scenario, run on many processes, one tidy table, one report."""
