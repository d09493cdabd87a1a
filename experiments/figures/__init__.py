"""Figures of the paper: one a file, found by its module name; computing, drawing and checking apart."""
