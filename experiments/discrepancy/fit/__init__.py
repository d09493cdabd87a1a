"""Fit: effects and nuisances with their priors, the bank of signatures, maxima of the posterior and their evidence."""
