"""Engines: the same model in, the same channels out."""
