"""Shipped studies: one sweep a YAML file."""
