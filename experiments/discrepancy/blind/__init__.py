"""Blind benchmark: hidden cases, their oracle, and the scores of what the frozen rule said."""
