"""Adhesion between wheel and rail, and creep forces."""
