"""Whether a bogie runs steadily: its lateral acceleration about the dominant frequency, after EN 14363:2016."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pandas as pd
from scipy.signal import welch

from estimators.interface import Estimate, Estimator, Missing
from estimators.signals.frequency_response import filter_time
from estimators.speed.odometry import SpeedSource, integrate_speed, missing_speed
from estimators.speed.samples import on_grid
from railsim.data_sheet import data_sheet
from railsim.measurements import Measurements
from railsim.spec import quantity

CHANNEL = "bogie.acceleration_y [m/s2]"
UPWARDS = "bogie.acceleration_z [m/s2]"
UPRIGHT = 2.0  # times the lateral rms is taken as the vertical one where that is not measured; illustrative
ORDER = 12  # of the band's edges, where |gain|^2 is 1/2; the standard asks for 24 dB an octave or more
UNSURE = 2.0  # standard deviations within which nothing is said of the limit
TONNE = 1e3


class Windows(NamedTuple):
    """Stretches of a record: where each ends, m, its first sample and one past its last, shapes (windows,)."""

    end: np.ndarray
    first: np.ndarray
    last: np.ndarray


class RunningStability(Estimator, frozen=True):
    """Running stability: rms of the bogie's lateral acceleration over 100 m beside the limit (after EN 14363).

    The rms is that within 2 Hz of the dominant frequency. The simplified method of EN 14363 has the sensor on the frame
    above the axlebox and the limit (12 - m / 5) / 2 m/s2, m the bogie's mass in t, wheelsets in it. Of a sensor
    elsewhere on the frame the value is an indicator.
    """

    speed_source: SpeedSource = quantity("tachometer", unit="-", source="Ward et al. 2011, section 3.1")
    slowest: float = quantity(1.0, unit="m/s", source="illustrative: slower is marked as invalid", gt=0.0)
    length: float = quantity(100.0, unit="m, over which the rms is taken", source="EN 14363:2016, 7.5", gt=10.0)
    step: float = quantity(10.0, unit="m", source="EN 14363:2016, 7.5", gt=0.0)
    reach: float = quantity(2.0, unit="Hz on both sides of the dominant frequency", source="EN 14363:2016, 7.5", gt=0.2)

    requires: ClassVar[tuple[str, ...]] = (CHANNEL,)
    adds: ClassVar[Mapping[str, str]] = MappingProxyType(
        {UPWARDS: "a deviation that includes misalignment of the sensor"}
    )

    def parameters(self, measurements: Measurements) -> Iterable[str]:
        """What the limit needs."""
        return "bogie_mass", "wheelset_mass"

    def missing(self, measurements: Measurements) -> Missing:
        """What is needed and not there, a speed among it."""
        return super().missing(measurements) + missing_speed(measurements, self.speed_source)

    def estimate(self, measurements: Measurements) -> Estimate:
        """A row each 10 m.

        Raises
        ------
        InputError : the channel, the speed or a mass is missing, or the vehicle does not move.
        """
        self.need(measurements)
        odometry = integrate_speed(measurements, self.speed_source, self.slowest)
        sheet, rate = data_sheet(measurements.about, CHANNEL), measurements.rate(CHANNEL)
        values, good = on_grid(measurements, CHANNEL)
        dominant = dominant_frequency(values - np.mean(values), rate, self.reach)
        time = measurements.time(CHANNEL)[0] + np.arange(len(values)) / rate
        windows = self.windows(odometry.distance_at(time))
        noise = sheet.density(rate) * np.sqrt(2.0 * self.reach)
        rms = np.sqrt(np.maximum(self.mean_square(values, rate, windows, dominant) - noise**2, 0.0))
        count = np.maximum(windows.last - windows.first, 1)
        known = np.concatenate([[0.0], np.cumsum(good.astype(float))])
        valid = (known[windows.last] - known[windows.first] >= count) & (windows.last > windows.first)
        independent = 4.0 * self.reach * count / rate
        across = self._across(measurements, windows, dominant, rms)
        by_sensor = (sheet.error("scale_error_std") * rms) ** 2 + (sheet.error("misalignment_std") * across) ** 2
        std = np.sqrt(by_sensor + noise**2 / np.maximum(independent, 1.0))
        limit = stability_limit(measurements.vehicle)
        steady = np.where(rms + UNSURE * std < limit, 1.0, np.where(rms - UNSURE * std > limit, 0.0, np.nan))
        series = pd.DataFrame(
            {
                "s [m]": windows.end,
                "time [s]": time[np.minimum(windows.last, len(time) - 1)],
                "instability [m/s2]": np.where(valid, rms, np.nan),
                "instability_std [m/s2]": np.where(valid, std, np.nan),
                "steady [-]": np.where(valid, steady, np.nan),
                "valid [-]": valid.astype(float),
            }
        )
        place_of = {"body": str(sheet.stated.get("body", "bogie")), "position [m]": list(sheet.position)}
        about = {"settings": self.model_dump(mode="json"), "dominant frequency [Hz]": dominant, "limit [m/s2]": limit}
        return Estimate(self.name, series, about | place_of | odometry.stated() | {"warnings": self._warnings(series)})

    def windows(self, place: np.ndarray, ends: np.ndarray | None = None) -> "Windows":
        """Stretches of `length` of samples at these places, m, shape (n,), up to these ends, m; one each `step`."""
        ends = np.arange(place[0] + self.length, place[-1], self.step) if ends is None else ends
        return Windows(ends, np.searchsorted(place, ends - self.length), np.searchsorted(place, ends))

    def mean_square(self, values: np.ndarray, rate: float, windows: "Windows", dominant: float) -> np.ndarray:
        """Of the samples (n,) within the band about a frequency in Hz, in each window, shape (windows,)."""
        power = filter_time(values - np.mean(values), rate, self._band(dominant), False) ** 2
        total = np.concatenate([[0.0], np.cumsum(power)])
        return (total[windows.last] - total[windows.first]) / np.maximum(windows.last - windows.first, 1)

    def _across(self, measurements: Measurements, windows: "Windows", dominant: float, rms: np.ndarray) -> np.ndarray:
        """Rms of the vertical acceleration, of which a misaligned sensor takes a share, m/s2, shape (windows,)."""
        if UPWARDS not in measurements or measurements.rate(UPWARDS) != measurements.rate(CHANNEL):
            return UPRIGHT * rms
        values, _ = on_grid(measurements, UPWARDS)
        short = int(windows.last.max(initial=0)) - len(values)
        values = np.pad(values, (0, max(short, 0)), mode="edge")
        return np.sqrt(self.mean_square(values, measurements.rate(UPWARDS), windows, dominant))

    def _band(self, dominant: float) -> Callable[[np.ndarray], np.ndarray]:
        """Butterworth's response within the band, zero phase."""
        low, high = 2.0 * np.pi * max(dominant - self.reach, 0.1), 2.0 * np.pi * (dominant + self.reach)

        def gain(omega: np.ndarray) -> np.ndarray:
            up = (omega / low) ** (2 * ORDER)
            return np.sqrt(up / (1.0 + up) / (1.0 + (omega / high) ** (2 * ORDER)))

        return gain

    def _warnings(self, series: pd.DataFrame) -> list[str]:
        if not len(series):
            return [f"the record is shorter than {self.length:g} m: nothing is given"]
        return []


def dominant_frequency(values: np.ndarray, rate: float, lowest: float) -> float:
    """Frequency of the highest peak of the spectrum between 0.4 and 12 Hz, Hz; `lowest` or more."""
    size = min(len(values), max(8, round(8.0 * rate)))
    frequency, density = welch(values, rate, nperseg=size)
    inside = (frequency >= 0.4) & (frequency <= min(12.0, 0.4 * rate))
    if not inside.any() or not np.any(values):
        return lowest
    return float(max(frequency[inside][np.argmax(density[inside])], lowest))


def stability_limit(vehicle: Mapping[str, Any]) -> float:
    """(12 - m / 5) / 2 m/s2 with the mass m of the bogie and its wheelsets in t (EN 14363:2016, simplified method)."""
    mass = float(vehicle["bogie_mass"]) + 2.0 * float(vehicle["wheelset_mass"])
    return (12.0 - mass / TONNE / 5.0) / 2.0
