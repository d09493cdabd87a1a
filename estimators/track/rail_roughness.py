"""Roughness and corrugation of both rails from the accelerometers on both axleboxes of an axle."""

from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.signals.noise import noise_floor
from estimators.speed.axleboxes import SETTLES, SIDES, Axle, AxleEstimator, Line
from estimators.speed.odometry import integrate_speed
from estimators.track.roughness_bands import CORRUGATION, THIRD_OCTAVES, level, limit, spectra, third_octave
from estimators.track.roughness_inverse import Banded, Inverse
from estimators.vehicle.wheel_on_track import contact_length, drawn_wheels, nominal_wheel
from railsim.measurements import Measurements
from railsim.spec import quantity

LONGEST = 1.0
"""m; of the waves that count."""
FINEST = 0.0025
"""m; of the grid of distance."""


class RailRoughness(AxleEstimator, frozen=True):
    """Roughness of both rails, from accelerometers on both axleboxes of an axle.

    Accelerations are integrated twice and taken back through the wheel on its contact and its rail. The result is rms
    roughness by place in the bands of EN 13231 (10 to 30, 30 to 100, 100 to 300, 300 to 1000 mm), and the spectrum of
    the record in one-third octaves beside the limit of ISO 3095. The track's give is hardly ever known: it is drawn
    evenly between rigid and twice `track_compliance`, and what that changes is the deviation.
    """

    slowest: float = quantity(3.0, unit="m/s", source="illustrative: slower is marked as invalid", gt=0.5)
    length: float = quantity(20.0, unit="m, of the windows", source="illustrative", ge=5.0, le=200.0)
    contact_filter: bool = quantity(True, unit="whether it is undone", source="Remington (1976)")
    widest: float = quantity(0.5, unit="deviation over value that is still given", source="illustrative", gt=0.0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """A row each `length` of line.

        Raises
        ------
        InputError : a channel, the speed or a parameter is missing, or the vehicle does not move.
        """
        self.need(measurements)
        odometry = integrate_speed(measurements, self.speed_source, self.slowest)
        axle = Axle.of(measurements, self.axle)
        moving = odometry.speed_at_knots[odometry.trusted]
        usual = float(np.median(moving)) if moving.size else self.slowest
        slow = max(float(np.quantile(moving, 0.02)) if moving.size else self.slowest, self.slowest)
        cells = max(1, int(self.length / max(FINEST, slow / axle.reach / 4.0)))
        line = Line.of(axle, odometry, self.length / cells, SETTLES)
        lowest = self.slowest / LONGEST / 4.0
        paths = spectra(line.at(axle, axle.paths(lowest)), line.spacing, self.length)
        good = np.array([line.good[i - cells : i + cells].all() for i in paths.middle], dtype=bool)
        inverse = self._inverse(measurements, axle, lowest)
        speed = np.where(good, line.speed[paths.middle], np.inf)  # beyond the reach where nothing is known
        wide = inverse.banded(paths, speed, list(CORRUGATION.values()), self.length)
        thirds = inverse.banded(paths, speed, [third_octave(one) for one in THIRD_OCTAVES], self.length)
        table = {"s [m]": line.s[paths.middle], "time [s]": line.time[paths.middle], **self._columns(wide)}
        about: dict[str, Any] = {
            "settings": self.model_dump(mode="json"),
            "reach": {"highest frequency [Hz]": axle.reach, "shortest wavelength [m]": usual / axle.reach},
            "contact half length [m]": inverse.half_length,
            "spectrum": self._spectrum(thirds),
            **odometry.stated(),
        }
        series = pd.DataFrame(table | {"valid [-]": good.astype(float)})
        return Estimate(self.name, series, about | {"warnings": self._warnings(series, wide)})

    def _inverse(self, measurements: Measurements, axle: Axle, lowest: float) -> Inverse:
        vehicle = measurements.vehicle
        nominal = nominal_wheel(vehicle, self.track_compliance)
        half_length = contact_length(float(vehicle["design_wheel_load"]), float(vehicle["wheel_radius"]))
        floor = min(noise_floor(row, axle.rate) for row in axle.acceleration)
        return Inverse(
            axle,
            drawn_wheels(nominal, self.track_spread),
            half_length if self.contact_filter else 0.0,
            lowest,
            max(floor - axle.noise**2, 0.0),
        )

    def _columns(self, wide: Banded) -> dict[str, np.ndarray]:
        """Rms of each rail in each band that is known anywhere."""
        known, columns = wide.known(self.widest), {}
        for row, side in enumerate(SIDES):
            for column, name in enumerate(CORRUGATION):
                there = known[row, :, column]
                if not np.isfinite(wide.std[row, :, column]).any():
                    continue
                columns[f"{side}_roughness_{name}mm [m]"] = np.where(there, wide.rms[row, :, column], np.nan)
                columns[f"{side}_roughness_{name}mm_std [m]"] = np.where(there, wide.std[row, :, column], np.nan)
        return columns

    def _spectrum(self, thirds: Banded) -> list[dict[str, Any]]:
        """Of the record: every band that is reached somewhere, the level None where it is not known."""
        bands = []
        for column, centre in enumerate(THIRD_OCTAVES):
            there = np.isfinite(thirds.std[0, :, column])
            if not there.any():
                continue
            mean = thirds.mean(there)
            known = mean.known(self.widest)
            iso = limit(float(centre))
            entry: dict[str, Any] = {
                "wavelength [m]": round(float(centre), 6),
                "length [m]": float(there.sum() * self.length),
                "ISO 3095 limit [dB]": None if np.isnan(iso) else iso,
            }
            for row, side in enumerate(SIDES):
                rms, std = mean.rms[row, column], mean.std[row, column]
                said = bool(known[row, column])
                entry[f"{side} level [dB]"] = float(level(rms)) if said else None
                entry[f"{side} level_std [dB]"] = float(20.0 / np.log(10.0) * std / rms) if said else None
                entry[f"{side} noise [dB]"] = float(level(np.sqrt(mean.noise[row, column])))
            bands.append(entry)
        return bands

    def _warnings(self, series: pd.DataFrame, wide: Banded) -> list[str]:
        if not len(series):
            return [f"the record is shorter than {2 * self.length:g} m: nothing is given"]
        known, reached = wide.known(self.widest), np.isfinite(wide.std)
        found = []
        for column, name in enumerate(CORRUGATION):
            label = name.replace("_", " to ")
            if not reached[..., column].any():
                found.append(f"{label} mm: beyond what speed and samples reach")
            elif not known[..., column].any():
                found.append(f"{label} mm: not clear of noise, or the compliance of the track is too uncertain there")
        return found
