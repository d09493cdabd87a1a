"""Readers of binary formats, one a file: `read(path, wanted) -> tables`. `guard` runs them in a process of its own."""
