"""Shared: channels of a recording, their health, wavelength bands, correlation."""
