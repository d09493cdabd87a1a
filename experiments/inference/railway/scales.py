"""Scales of the latent forces and readings that healthy vehicles have, relative to what acts at their place."""

SCALES: dict[str, float] = {}
"""By the name of the level; others have the one before anything is learned."""
