"""Track geometry and irregularities: class, files, synthesis and the tables that the compiled kernels read."""

from railsim.track.files import read_track, shipped_tracks, write_track
from railsim.track.track import CANT_BASE, Geometry, Track

__all__ = ["CANT_BASE", "Geometry", "Track", "read_track", "shipped_tracks", "write_track"]
