"""Measurements: what an estimator may see of a recording."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from railsim.description import check_description
from railsim.errors import InputError
from railsim.shown import html
from railsim.stamps import usual_step

if TYPE_CHECKING:
    from railsim.plots.style import Picture

TIME = "time [s]"
_NAME = re.compile(r"\S.* \[[^\[\]]+\]")
_RATE_TOLERANCE = 0.01

Table = Mapping[str, Any] | pd.DataFrame


class Measurements:
    """Measured channels by name, the vehicle's nominal parameters and, where it was measured, the track.

    Holds copies or read-only views of numbers, but neither truth nor the name of a folder in which it could be found.

    Parameters
    ----------
    about : contents of about.json: "origin", "vehicle" (nominal parameters, SI units, by field name), "sensors".
    tables : by sample rate in Hz, the columns by name: "time [s]" first, then "<sensor>.<quantity> [unit]"; NaN is a
        lost sample.
    track : measured track, first column "s [m]", or None.

    Raises
    ------
    InputError : a part of the description is missing or cannot be used; times do not increase, do not fit the rate;
        columns of unequal length; a channel that appears twice or holds infinity.
    """

    def __init__(self, about: dict[str, Any], tables: Mapping[float, Table], track: pd.DataFrame | None = None) -> None:
        check_description(about)
        if not tables:
            raise InputError("a recording needs at least one measured channel; add a sensor")
        if track is not None:
            _check_track(track)
        self._about = about
        self._track = track
        self._times: dict[float, np.ndarray] = {}
        self._channels: dict[str, tuple[float, np.ndarray]] = {}
        for rate in sorted(tables):
            self._add(float(rate), tables[rate])

    @property
    def channels(self) -> list[str]:
        """Names of all channels, those of the lowest rate first; the times are not among them."""
        return list(self._channels)

    @property
    def about(self) -> dict[str, Any]:
        """What is known about the recording, as in about.json."""
        return self._about

    @property
    def vehicle(self) -> dict[str, Any]:
        """The vehicle's nominal parameters by field name, SI units, and its "name"."""
        return self._about["vehicle"]

    @property
    def track(self) -> pd.DataFrame | None:
        """The track as it was measured, first column "s [m]"; None where it was not."""
        return self._track

    def sensor(self, name: str) -> dict[str, Any]:
        """Data sheet of the sensor that gives channel `name`: kind, body, position (m), rate (Hz), errors.

        Raises
        ------
        InputError : no such channel, or no sensor states it.
        """
        self._find(name)
        for sheet in self._about["sensors"]:
            if name in sheet.get("channels", ()):
                return sheet
        raise InputError(f"no sensor in about.json states channel '{name}'; add it to a sensor's \"channels\"")

    def __contains__(self, name: object) -> bool:
        """Whether there is a channel of that full name."""
        return name in self._channels

    def __iter__(self) -> Iterator[str]:
        """Iterate over the channels' names."""
        return iter(self._channels)

    def __len__(self) -> int:
        """Number of channels."""
        return len(self._channels)

    def __getitem__(self, name: str) -> np.ndarray:
        """Samples of channel `name`, shape (n,), not to be written to; raises InputError where there is none."""
        return self._find(name)[1]

    def time(self, name: str) -> np.ndarray:
        """Times of the samples of channel `name`, s, shape (n,)."""
        return self._times[self._find(name)[0]]

    def rate(self, name: str) -> float:
        """Sample rate of channel `name`, Hz."""
        return self._find(name)[0]

    def span(self) -> tuple[float, float]:
        """First and last time of all tables, s; zeros where there is no sample."""
        times = [time for time in self._times.values() if time.size]
        if not times:
            return 0.0, 0.0
        return float(min(time[0] for time in times)), float(max(time[-1] for time in times))

    def between(self, begin: float, end: float, fewest: int = 2) -> tuple["Measurements", dict[float, int]] | None:
        """The samples from `begin` on and before `end`, s, as views of these, and by rate how many rows come before.

        Tables of less than `fewest` rows there are left out; None where no table is left.
        """
        tables: dict[float, dict[str, np.ndarray]] = {}
        firsts: dict[float, int] = {}
        for name, (rate, values) in self._channels.items():
            first, last = np.searchsorted(self._times[rate], [begin, end])
            if last - first >= fewest:
                tables.setdefault(rate, {TIME: self._times[rate][first:last]})[name] = values[first:last]
                firsts[rate] = int(first)
        return (Measurements(self._about, tables, self._track), firsts) if tables else None

    def frame(self, rate: float) -> pd.DataFrame:
        """The channels of one sample rate [Hz] side by side, "time [s]" first; NaN is a lost sample.

        Raises
        ------
        InputError : no channel has that rate.
        """
        if rate not in self._times:
            known = ", ".join(f"{one:g}" for one in self._times)
            raise InputError(f"no channel has {rate:g} Hz; there are {known} Hz")
        columns = {name: values for name, (own, values) in self._channels.items() if own == rate}
        return pd.DataFrame({TIME: self._times[rate], **columns})

    def plot(self, *channels: str, begin: float | None = None, end: float | None = None) -> "Picture":
        """A picture of channels over time, in panels by sensor and quantity.

        Parameters
        ----------
        channels : full names, or patterns without a unit such as "bogie.*"; all channels where none is given.
        begin, end : first and last time, s; None is that of the record.

        Raises
        ------
        InputError : a name fits no channel.
        """
        from railsim.plots.channels import channels_picture, chosen, rows_between

        def line(name: str) -> tuple[np.ndarray, np.ndarray]:
            rows = rows_between(self.time(name), begin, end)
            return self.time(name)[rows], self[name][rows]

        names = chosen(self.channels, channels) if channels else self.channels
        return channels_picture(self._about["origin"], names, line, TIME)

    @property
    def rates(self) -> list[float]:
        """Sample rates of the channels, Hz, the lowest first."""
        return list(self._times)

    def __repr__(self) -> str:
        """Origin, number of channels, rates and span in one line."""
        begin, end = self.span()
        rates = ", ".join(f"{rate:g}" for rate in self._times)
        origin = self._about["origin"]
        return f"<Measurements of {origin!r}: {len(self)} channels at {rates} Hz, {begin:g} to {end:g} s>"

    def _repr_html_(self) -> str:
        """A table of the channels, for notebooks."""
        rows = [
            (name, f"{rate:g}", len(values), int(np.isnan(values).sum()))
            for name, (rate, values) in self._channels.items()
        ]
        return html(repr(self), ("channel", "rate [Hz]", "samples", "lost"), rows)

    def _find(self, name: str) -> tuple[float, np.ndarray]:
        if name not in self._channels:
            raise InputError(f"no measured channel '{name}'; there are: {', '.join(self._channels) or 'none'}")
        return self._channels[name]

    def _add(self, rate: float, table: Table) -> None:
        names = list(table)
        if not names or names[0] != TIME:
            raise InputError(f"the table at {rate:g} Hz must begin with the column '{TIME}'; put it first")
        time = _numbers(table[TIME], TIME)
        _check_time(time, rate)
        self._times[rate] = time
        for name in names[1:]:
            if not _NAME.fullmatch(name):
                raise InputError(f"column '{name}' at {rate:g} Hz: name it \"<sensor>.<quantity> [unit]\"")
            if name in self._channels:
                raise InputError(f"channel '{name}' appears twice; rename one of the two sensors")
            values = _numbers(table[name], name)
            if values.shape != time.shape:
                raise InputError(f"channel '{name}' has {values.size} samples for {time.size} times; make them equal")
            if np.isinf(values).any():
                raise InputError(f"channel '{name}' holds infinity; leave lost samples empty (NaN)")
            self._channels[name] = (rate, values)


def check_increasing(values: np.ndarray, what: str) -> None:
    """Raise `InputError` at the first value that is not finite and larger than the one before."""
    wrong = ~np.isfinite(values)
    wrong[1:] |= ~(np.diff(values) > 0)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(f"{what} does not increase at row {row + 1} (value {values[row]:g}); sort or mend the rows")


def _check_time(time: np.ndarray, rate: float) -> None:
    check_increasing(time, f"'{TIME}' at {rate:g} Hz")
    if not 0 < rate < np.inf:
        raise InputError(f"sample rate {rate:g} Hz is not positive; state the real one")
    if time.size > 1:
        real = 1.0 / float(np.median(np.diff(time)))
        if abs(real / rate - 1) > _RATE_TOLERANCE:
            found = usual_step(time)  # stamps may be rounded, which moves their median
            if not found.fits(1.0 / rate, _RATE_TOLERANCE):
                raise InputError(
                    f"times stated as {rate:.10g} Hz follow each other at {1 / found.size:.10g} Hz; correct the rate"
                )


def _check_track(track: pd.DataFrame) -> None:
    if not len(track.columns) or track.columns[0] != "s [m]":
        raise InputError("the measured track must begin with the column 's [m]'; put it first")
    for name in _texts(track.columns):
        _numbers(track[name], name)
    check_increasing(_numbers(track["s [m]"], "s [m]"), "'s [m]' of the measured track")


def _numbers(values: Any, name: str) -> np.ndarray:
    """A read-only float64 view (or copy) of `values`."""
    try:
        array = np.asarray(values, dtype=np.float64).view()
    except (TypeError, ValueError):
        raise InputError(f"column '{name}' holds something that is not a number; mend or leave it out") from None
    array.setflags(write=False)
    return array


def _texts(names: Iterable[object]) -> list[str]:
    return [str(name) for name in names]
