"""The validation report: one section a file, each with our number, a reference that we did not make, the difference."""
