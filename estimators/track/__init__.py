"""Track geometry and defects: alignment, cross level, joints, switches."""
