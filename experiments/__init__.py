"""Scores, figures, sweeps and the `railsim` command."""
