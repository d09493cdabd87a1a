"""A flat among the orders of a wheel's radius."""

from typing import NamedTuple

import numpy as np

SHORTEST, LONGEST, STEP = 0.02, 0.15, 0.001
"""m; lengths that are looked for."""
EVIDENCE = 40.0
"""Least fall of chi squared by a flat: one more unknown length and angle, 300 places, one false in a million wheels."""
BETTER = 0.5
"""Least share of the chi squared of all orders that a flat must explain: a wave around the wheel is none."""
ANGLES = 1024
KEPT = 0.8
"""Of the speed up to which a wheel could follow a flat; illustrative."""


class Flat(NamedTuple):
    """Length and its deviation, m; angle of its middle from the record's begin, rad; fall of chi squared."""

    length: float
    length_std: float
    angle: float
    evidence: float


def follows_up_to(load: float, mass: float, radius: float) -> float:
    """Speed up to which a wheel follows a rounded flat of any length, m/s.

    The steepest bend of d/2 (1 + cos(2 pi x / l)), d = l^2 / (16 r), asks for the acceleration (pi v)^2 / (8 r); the
    load N gives the wheel N / m: v = sqrt(8 r N / m) / pi (compare Newton and Clark 1979). A fifth is kept for what the
    wheel swings on its contact.
    """
    return KEPT * float(np.sqrt(8.0 * radius * load / mass) / np.pi)


def flat_orders(length: float, radius: float, orders: int) -> np.ndarray:
    """Amplitudes of the orders of d/2 (1 + cos(2 pi x / l)) dug at angle 0, d = l^2 / (16 r), shape (orders,)."""
    number = np.arange(1, orders + 1)
    depth, width = length**2 / (16.0 * radius), length / (2.0 * np.pi * radius)
    u = number * width
    return -depth * width * np.sinc(u) / np.where(np.abs(u**2 - 1.0) > 1e-9, 1.0 - u**2, 1e-9)


def find_flat(amplitude: np.ndarray, std: np.ndarray, radius: float) -> Flat | None:
    """The flat that explains complex amplitudes of orders best; None where none clearly does.

    std : of real and imaginary parts; orders that are NaN are left out.
    """
    known = np.isfinite(amplitude) & (std > 0.0)
    if known.sum() < 10:
        return None
    weight = np.where(known, 1.0 / np.where(known, std, 1.0) ** 2, 0.0)
    seen = np.where(known, amplitude, 0.0)
    whole = float(np.sum(weight * np.abs(seen) ** 2))
    lengths = np.arange(SHORTEST, LONGEST + STEP / 2.0, STEP)
    chi, angles = np.empty(len(lengths)), np.empty(len(lengths))
    for i, length in enumerate(lengths):
        shape = flat_orders(length, radius, len(amplitude))
        spectrum = np.zeros(ANGLES, dtype=complex)
        spectrum[1 : len(amplitude) + 1] = weight * shape * seen
        match = np.real(np.fft.ifft(spectrum)) * ANGLES
        best = int(np.argmax(match))
        chi[i] = whole - 2.0 * match[best] + float(np.sum(weight * shape**2))
        angles[i] = 2.0 * np.pi * best / ANGLES
    best = int(np.argmin(chi))
    evidence = whole - float(chi[best])
    if evidence < EVIDENCE or evidence < BETTER * whole:
        return None
    spread = max(float(chi[best]) / max(2 * int(known.sum()) - 2, 1), 1.0)
    within = lengths[chi <= chi[best] + spread]
    shape = weight * flat_orders(float(lengths[best]), radius, len(amplitude)) ** 2
    share = np.where(known, std, 0.0) / np.maximum(np.abs(seen), 1e-30)
    common = np.sqrt(np.sum(shape * share**2) / np.sum(shape)) / 3.0  # all orders wrong alike; they grow as length^3
    parts = [float(np.ptp(within)) / 2.0, STEP / 2.0, float(common * lengths[best])]
    return Flat(float(lengths[best]), float(np.sqrt(np.sum(np.square(parts)))), float(angles[best]), evidence)
