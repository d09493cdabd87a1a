"""Wheel-rail contact: geometry tables, Hertzian normal force, creepages, creep laws."""
