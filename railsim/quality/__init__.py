"""Verification of a recording before use (Ward et al. 2011, section 6): one check a file, found by its module name."""
