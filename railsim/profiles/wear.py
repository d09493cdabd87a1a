"""Worn wheels from new ones: a hollow tread and a thinner flange, grown with one severity."""

from dataclasses import replace

import numpy as np

from railsim.profiles.profile import Profile

HOLLOW_DEPTH, HOLLOW_CENTRE, HOLLOW_WIDTH = 2e-3, -2e-3, 28e-3
"""Depth of the hollow at severity 1, its middle from the taping line and its half width [m] (illustrative)."""

FLANGE_LOSS, FLANGE_CENTRE, FLANGE_WIDTH = 3e-3, -37e-3, 11e-3
"""Flange thickness lost at severity 1, the middle of the worn flank and its half width [m] (illustrative)."""


def worn(wheel: Profile, severity: float) -> Profile:
    """`wheel` with wear of `severity` 0 (as given) to 1 (hollow of 2 mm, flange 3 mm thinner), linear in it.

    The tread is lowered by (1 - t^2)^4 around its middle, the flank moved towards the flange's back in the same
    manner: both leave three continuous derivatives. The result has z = 0 at the taping line again, since r0 is
    measured there.

    Raises
    ------
    ValueError : not a wheel, or a severity outside 0 ... 1.
    """
    if wheel.kind != "wheel" or not 0.0 <= severity <= 1.0:
        raise ValueError("wear needs a wheel and a severity between 0 and 1")
    hollow = severity * HOLLOW_DEPTH * _bump((wheel.y - HOLLOW_CENTRE) / HOLLOW_WIDTH)
    loss = severity * FLANGE_LOSS * _bump((wheel.y - FLANGE_CENTRE) / FLANGE_WIDTH)
    y, z = wheel.y - loss, wheel.z + hollow
    return replace(wheel, y=y, z=z - np.interp(0.0, y, z), name=f"{wheel.name}_worn_{round(100 * severity):03d}")


def _bump(t: np.ndarray) -> np.ndarray:
    return np.clip(1.0 - t**2, 0.0, None) ** 4
