"""Faults put into recordings on purpose, and how well the inspection finds them."""
