"""Shipped track files; SOURCES.md says how each was made."""
