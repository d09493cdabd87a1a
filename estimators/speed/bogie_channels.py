"""What the speed estimators read from a recording: channels on one uniform grid, the accelerometer's place."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.speed.wheelset_filters import ACCELERATION, FORWARD, PITCH_RATE
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements

LONGEST_GAP = 10.0  # s; a longer gap counts as this long: everything has been forgotten by then


@dataclass(frozen=True)
class Grid:
    """Samples on a uniform grid, NaN where the record has a gap.

    Attributes
    ----------
    acceleration, pitch_rate : samples, shape (n,), m/s2 and rad/s.
    forward : longitudinal acceleration, shape (n,), m/s2; all NaN where it is not measured together with the others.
    rows : index of each recorded sample in the grid, shape (number of recorded samples,).
    time : the recorded samples' time stamps in s.
    rate : samples per second.
    """

    acceleration: np.ndarray
    pitch_rate: np.ndarray
    forward: np.ndarray
    rows: np.ndarray
    time: np.ndarray
    rate: float

    @property
    def has_forward(self) -> bool:
        """Whether the longitudinal acceleration was measured together with the others."""
        return bool(np.isfinite(self.forward).any())


def read(measurements: Measurements) -> Grid:
    """The channels on one grid.

    Raises
    ------
    InputError : the two channels that are needed differ in rate or length or hold fewer than two samples.
    """
    time, other = measurements.time(ACCELERATION), measurements.time(PITCH_RATE)
    if len(time) != len(other) or not np.allclose(time, other, atol=1e-6, rtol=0):
        raise InputError(
            f"'{ACCELERATION}' and '{PITCH_RATE}' are not sampled together; give both sensors the same rate"
        )
    if len(time) < 2:
        raise InputError(f"'{ACCELERATION}' has {len(time)} samples; record at least a few seconds")
    steps = np.diff(time)
    rate = _real_rate(steps, measurements.rate(ACCELERATION))
    rows = np.concatenate([[0], np.cumsum(1 + missing(steps, rate))])
    filled = np.full((3, rows[-1] + 1), np.nan)
    filled[0, rows] = measurements[ACCELERATION]
    filled[1, rows] = measurements[PITCH_RATE]
    if together(measurements.about, measurements.rate(ACCELERATION)) and FORWARD in measurements:
        filled[2, rows] = measurements[FORWARD]
    return Grid(filled[0], filled[1], filled[2], rows, np.asarray(time), rate)


def missing(steps: np.ndarray, rate: float) -> np.ndarray:
    """Number of samples lost between neighbours that are `steps` seconds apart."""
    lost = np.rint(np.asarray(steps) * rate).astype(np.int64) - 1
    return np.clip(lost, 0, round(LONGEST_GAP * rate))


def together(about: Mapping[str, Any], rate: float) -> bool:
    """Whether a sensor is stated that gives the longitudinal acceleration at that sample rate."""
    stated = data_sheet(about, FORWARD).stated
    return bool(stated) and abs(float(stated.get("rate", rate)) / rate - 1) < 1e-6


def accelerometer_offset(about: Mapping[str, Any]) -> float:
    """Longitudinal place of the accelerometer before the bogie's centre of gravity in m; 0 where it is not stated."""
    return data_sheet(about, ACCELERATION).position[0]


def _real_rate(steps: np.ndarray, stated: float) -> float:
    """The rate of the time stamps; the stated one where both agree to rounding."""
    real = 1 / float(np.median(steps))
    return float(stated) if abs(real / stated - 1) < 1e-6 else real


class Stepper:
    """An online run: hands samples to a compiled kernel and fills gaps in time as `read` does.

    Parameters
    ----------
    columns : names of the kernel's columns.
    rate : sample rate in Hz.
    advance : kernel; new samples of acceleration, pitch rate and longitudinal acceleration (NaN: not measured), each
        of shape (n,), to rows of shape (n, columns).
    """

    def __init__(
        self,
        columns: tuple[str, ...],
        rate: float,
        advance: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray],
    ) -> None:
        self.advance = advance
        self.columns = columns
        self._rate = rate
        self._time: float | None = None

    def step(self, sample: Mapping[str, float]) -> dict[str, float]:
        """One sample in, one row of the series out; see `estimators.interface.Online`.

        Raises
        ------
        InputError : time does not increase.
        """
        time = sample["time [s]"]
        if self._time is not None:
            if not time > self._time:
                raise InputError(f"time {time:g} s follows {self._time:g} s; give samples in the order of time")
            lost = np.full(int(missing(np.array(time - self._time), self._rate)), np.nan)
            self.advance(lost, lost, lost)
        self._time = time
        values = sample[ACCELERATION], sample[PITCH_RATE], sample.get(FORWARD, np.nan)
        row = self.advance(*(np.array([value], dtype=float) for value in values))[0]
        return {"time [s]": time, **{name: float(value) for name, value in zip(self.columns, row, strict=True)}}
