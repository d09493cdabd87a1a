"""Conicity by an extended Kalman filter that takes the track as straight: the first attempt of the article."""

import numpy as np

from estimators.wheel_rail.contact_run import ContactEstimator


class ConicityEkf(ContactEstimator, frozen=True):
    """Conicity of a single wheelset by a Kalman filter that knows no track (Ward et al. 2011, section 4.3.2).

    Its states are those of wheelset and suspended mass, and the conicity. It does not converge to the conicity, as the
    article says: with d taken as zero the whole movement counts as shift on the rails, and what looks like conicity is
    the square of the movement's wave number, l r0 k^2.
    """

    def drive(self) -> np.ndarray:
        """Nothing moves the rails."""
        return np.zeros(2)
