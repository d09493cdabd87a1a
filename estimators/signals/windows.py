"""Windows of spectra."""

HANN = 1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0)
"""How many neighbouring Fourier coefficients count as one under a Hann window: they are alike by 2/3 and 1/6 of their
size, one and two apart, and the variance of a mean of powers goes by the squares of that (Welch 1967).
"""
