"""Short waves of each rail from the accelerometers on both axleboxes of the leading wheelset."""

from collections.abc import Iterable
from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.signals.bands import BANDS
from estimators.track.chain_error import Chain, Reading, sideways_chain, vertical_chain
from estimators.track.geometry import CANT_BASE, TrackEstimator, geometry, number, rails
from estimators.track.slow_motions import balancing_cant, stated, without_mean
from estimators.vehicle.state_space import Output
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

LEFT, RIGHT = "axlebox1_left.acceleration_z [m/s2]", "axlebox1_right.acceleration_z [m/s2]"


class AxleboxProfile(TrackEstimator, frozen=True):
    """Vertical profile of each rail up to 25 m, from accelerometers on both axleboxes of an axle.

    Acceleration over the square of speed is integrated twice in space. The wheelset is rigid between its axleboxes, so
    their mean is the mean of the rails and their difference its roll. A range of 100 g leaves noise that buries long
    waves (Ward et al. 2011, section 3.1); `cut` is therefore short, and bands beyond it are not given.
    """

    requires: ClassVar[tuple[str, ...]] = (LEFT, RIGHT)
    nearby: ClassVar[bool] = True

    cut: float = quantity(25.0, unit="m", source="long edge of D1, EN 13848-1", gt=1.0, le=300.0)

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """How far the axleboxes are from the bogie's centre."""
        return ("semi_wheelbase",)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Profile of both rails over the whole record.

        Raises
        ------
        InputError : a channel is missing, no speed, no movement, or a vehicle parameter is not given.
        """
        odometry = self.odometry(measurements)
        arm = number(measurements, "semi_wheelbase")
        speed = odometry.speed_behind(arm)
        apart = data_sheet(measurements.about, LEFT).position[1] - data_sheet(measurements.about, RIGHT).position[1]
        apart = apart or 2.0 * number(measurements, "primary_half_spacing")
        bands = {name: band for name, band in BANDS.items() if band.shortest < self.cut}

        def path(name: str, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            acceleration, measured = odometry.channel(measurements, name, arm, samples)
            return acceleration / speed**2, measured

        def columns(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
            return geometry(name, values, present, odometry, self.cut, 2, bands)

        left, present = path(LEFT, without_mean(measurements[LEFT]))
        right, measured = path(RIGHT, without_mean(measurements[RIGHT]))
        present = present & measured
        share = CANT_BASE / apart
        vertical, level = columns("vertical", (left + right) / 2.0), columns("cross_level", (right - left) * share)
        heights, levels = self._chains(measurements, arm, apart)
        if heights and levels:
            halves = {name: lambda rows, name=name: path(name, rows)[0] / 2.0 for name in (LEFT, RIGHT)}
            vertical |= stated("vertical", vertical, heights, halves, measurements, odometry, present, 2, bands)
            whole = {name: lambda rows, name=name: path(name, rows)[0] * share for name in (LEFT, RIGHT)}
            level |= stated("cross_level", level, levels, whole, measurements, odometry, present, 2, bands)
        cant = geometry("cross_level", balancing_cant(measurements, odometry), present, odometry, self.cut, 0, bands)
        return self.result(odometry, vertical | level | rails(vertical, level, cant), present)

    def _chains(self, measurements: Measurements, arm: float, apart: float) -> tuple[Chain | None, Chain | None]:
        """Of the mean of both rails, and of cross level."""

        def height(speed: float, k: np.ndarray) -> list[np.ndarray]:
            return [-np.exp(-1j * k * arm) / (speed * k) ** 2]

        def level(speed: float, k: np.ndarray) -> list[np.ndarray]:
            return [2.0 * CANT_BASE / apart * np.exp(-1j * k * arm) / (speed * k) ** 2]

        middle, side = Output("axlebox", (1.0, 0.0, 0.0)), Output("lift", (1.0, apart / 2.0, 0.0))
        return (
            vertical_chain(measurements, [Reading((LEFT, RIGHT), middle)], height),
            sideways_chain(measurements, [Reading((LEFT, RIGHT), side)], level, "cross_level"),
        )
