"""Conicity by an extended Kalman filter that takes the track under the wheelset as unknown."""

import numpy as np

from estimators.wheel_rail.contact_run import ContactEstimator
from railsim.spec import quantity


class ConicityEkfTrack(ContactEstimator, frozen=True):
    """Conicity of a single wheelset on unknown track, by a Kalman filter (Ward et al. 2011, section 4.3.2).

    Its states are wheelset, suspended mass, lateral position of the track and one conicity. The track has the shape of
    the ERRI B176 spectra. This shape shows the conicity: yaw rate shows lambda (y - d), acceleration shows y, and only
    with the right lambda is what remains such a track.
    """

    model_error: float = quantity(0.2, unit="- of the conicity", source="tuned on the runs of fig11", ge=0.0)

    def drive(self) -> np.ndarray:
        """Track and gauge are unknown."""
        return super().drive()
