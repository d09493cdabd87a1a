"""Track geometry and irregularities: class, files, synthesis and the tables that the compiled kernels read."""

from railsim.track.track import CANT_BASE, Geometry, Track

__all__ = ["CANT_BASE", "Geometry", "Track"]
