"""Lengths of time that readers of measured data share."""

HOUR, DAY = 3600.0, 86_400.0  # s
SECOND_NS = 1_000_000_000  # ns
DAY_NS = 86_400 * SECOND_NS  # ns
