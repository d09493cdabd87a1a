"""Cramér-Rao bounds: what can be known at all."""
