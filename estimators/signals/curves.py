"""From which curvature on a track is taken to be curved."""

CURVED = 2e-4  # 1/m; a radius of 5 km
