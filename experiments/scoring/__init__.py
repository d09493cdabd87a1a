"""Scores: an estimate against the truth."""
