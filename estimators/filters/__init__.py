"""Shared: Kalman filters and smoothers, track spectra, information bounds."""
