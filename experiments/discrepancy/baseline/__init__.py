"""Baseline: what the workflow is given, the nominal model over it, and the noise between both."""
