"""What a half vehicle gets wrong beside the whole one of the same suspension, by channel and frequency."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure as Picture
from matplotlib.image import AxesImage
from scipy.signal.windows import hann

from experiments.figures.interface import Figure
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, Target, at_least, at_most, between
from experiments.reporting.size import Size
from experiments.reporting.style import as_table
from railsim.dynamics.channels import channel_names
from railsim.scenario import Scenario
from railsim.simulation import build_run, load_engine
from railsim.vehicles.class175_whole import Class175Whole
from railsim.vehicles.interface import Vehicle
from railsim.vehicles.whole_vehicle import WholeVehicle

TRACKS = ("straight_erri_low", "straight_erri_high")
SPEEDS = (15.0, 30.0, 45.0)  # m/s
START = 70.0  # m: the rear wheelset stands where the irregularities have their full size
SHORTEST = 1.0  # m, wave of these tracks
LENGTH, FAST_LENGTH, SMOKE_LENGTH = 1900.0, 600.0, 400.0  # m of a run
RATE = 1024.0  # Hz
SETTLED = 3.0  # s after which the start is forgotten, as in the comparison with recordings
EDGES = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 60.0)  # Hz
BANDS = tuple(zip(EDGES[:-1], EDGES[1:], strict=True))
EVERYTHING = (0.0, EDGES[-1])
LEAST, MOST = 0.01, 2.0  # error that the colours tell apart
CHANNELS = {
    "wheelset1.y": "wheelset y",
    "wheelset1.z": "wheelset z",
    "bogie.y": "bogie y",
    "bogie.z": "bogie z",
    "bogie.roll": "bogie roll",
    "bogie.pitch": "bogie pitch",
    "bogie.yaw": "bogie yaw",
    "body.y": "body y",
    "body.z": "body z",
    "body.roll": "body roll",
    "primary1_left.displacement": "primary",
}
"""Names in the picture: leading wheelset, leading bogie, the body's point over it, leading primary suspension."""
FIRST = ("bogie.y", "body.y", "primary1_left.displacement")
"""Channels with which another body begins in the picture."""
UPRIGHT, SIDEWAYS, ROLL = at_most(0.09), between(0.21, 0.43), between(0.41, 0.70)
BODY, PRIMARY = between(0.41, 0.94), between(0.58, 0.70)
FOUND_BEFORE: Mapping[str, Target] = {
    "wheelset1.z": UPRIGHT,
    "bogie.z": UPRIGHT,
    "bogie.y": SIDEWAYS,
    "bogie.yaw": SIDEWAYS,
    "bogie.roll": ROLL,
    "body.y": BODY,
    "body.z": BODY,
    "body.roll": BODY,
    "primary1_left.displacement": PRIMARY,
}
"""Error of the half vehicle beside recordings of a whole one by an independent simulator, at 80 and 120 km/h."""
ALIKE = ("wheelset1.z", "bogie.z")
GAIN, GAIN_UP_TO = (0.96, 1.03), 8.0
"""Gain of half over whole found there from 0.5 to 12 Hz; here up to the edge of a band below that [Hz]."""
ERROR, FACTOR, SIZE = "error [-]", "gain [-]", "whole, rms [m/s2, rad/s or m]"
LOW, HIGH, SPEED = "from [Hz]", "to [Hz]", "speed [m/s]"


def vehicle() -> WholeVehicle:
    """A vehicle whose suspension its half has too: yaw dampers linear, they and the traction rods at the height of the
    secondary springs. What differs is the missing half, and that the half vehicle is held along the track.
    """
    return Class175Whole(
        yaw_damper_series_stiffness=None,
        yaw_damper_blow_off_velocity=None,
        yaw_damper_height=None,
        traction_rod_height=None,
    )


class HalfOrWhole(Figure):
    """Rms of half less whole over rms of whole: accelerations y and z, rates of angles, the primary's displacement."""

    def compute(self, size: Size) -> pd.DataFrame:
        length = size.of(LENGTH, FAST_LENGTH, SMOKE_LENGTH)
        rows = []
        for track in TRACKS[: size.of(2, 2, 1)]:
            for speed in SPEEDS:
                place = {"track": track, SPEED: speed, "distance [m]": length}
                rows += [place | row for row in compared(vehicle(), track, speed, length / speed)]
        return pd.DataFrame(rows)

    def draw(self, table: pd.DataFrame) -> Picture:
        tracks, speeds = _distinct(table, "track"), _distinct(table, SPEED)
        picture = Picture(figsize=(1.0 + 6.0 * len(tracks), 1.2 + 4.2 * len(speeds)), layout="constrained")
        panels = picture.subplots(len(speeds), len(tracks), sharex=True, sharey=True, squeeze=False)
        image = None
        for line, speed in zip(panels, speeds, strict=True):
            for axes, track in zip(line, tracks, strict=True):
                image = _draw(axes, _of_run(table, track, speed), speed / SHORTEST)
                axes.set_title(f"{track}, {speed:g} m/s", fontsize=13, pad=12)
        for axes in panels[-1]:
            axes.set_xlabel("frequency band [Hz]", fontsize=13)
        if image is not None:
            bar = picture.colorbar(image, ax=panels, location="bottom", shrink=0.6, aspect=40, pad=0.02, extend="both")
            ticks = (0.01, 0.03, 0.1, 0.3, 1.0, 2.0)
            bar.set_ticks(ticks, labels=[f"{100.0 * tick:g}" for tick in ticks])
            bar.ax.tick_params(labelsize=12)
            bar.minorticks_off()
            bar.set_label("error of the half vehicle [% of the whole one's rms in the band]", fontsize=13)
        picture.suptitle(
            "What half a vehicle gets wrong: Class 175-like, yaw dampers linear\n"
            f"triangle: frequency of the track's shortest wave, {SHORTEST:g} m; beyond it is what the contacts distort",
            fontsize=14,
        )
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        enough = bool((table["distance [m]"] >= LENGTH).all()) and set(table["track"]) == set(TRACKS)
        claims = []
        for channel, target in FOUND_BEFORE.items():
            errors = _rows(table, channel, EVERYTHING)[ERROR].to_numpy(float)
            text = f"{CHANNELS[channel]}: error up to {EVERYTHING[1]:g} Hz over the rms, median of tracks and speeds"
            found = intervals.of_median(errors)
            claims.append(Claim.sampled(text, float(np.median(errors)), target, found, enough))
        for channel in ALIKE:
            bands = [band for band in BANDS if band[1] <= GAIN_UP_TO]
            gains = np.concatenate([_rows(table, channel, band)[FACTOR].to_numpy(float) for band in bands])
            text = f"{CHANNELS[channel]}: gain of half over whole, {EDGES[0]:g} to {GAIN_UP_TO:g} Hz"
            least, most = float(gains.min()), float(gains.max())
            claims += [
                Claim.definite(f"{text}, least of all bands and runs", least, at_least(GAIN[0]), enough=enough),
                Claim.definite(f"{text}, largest", most, at_most(GAIN[1]), enough=enough),
            ]
        return claims

    def notes(self) -> list[str]:
        return [
            "The ranges were found beside recordings of another whole vehicle by an independent simulator, at 80 and "
            "120 km/h on another track, with arms, dampers that blow off and a creep law that the half vehicle did not "
            "have. What is here of them is due to the missing half and to bodies that are held along the track."
        ]


def compared(whole: WholeVehicle, track: str, speed: float, duration: float) -> list[dict[str, str | float]]:
    """A row for each channel and band, of runs of `duration` [s] by the whole vehicle and by its half."""
    runs = [_motion(one, track, speed, duration) for one in (whole, whole.half())]
    rows = []
    for channel in CHANNELS:
        frequency, amplitudes = spectra([run[channel] for run in runs])
        for low, high in (*BANDS, EVERYTHING):
            inside = (frequency > low) & (frequency <= high)
            of_whole, of_half = amplitudes[:, inside]
            power = float(np.vdot(of_whole, of_whole).real)
            error = float(np.linalg.norm(of_half - of_whole)) / np.sqrt(power)
            gain = float(abs(np.vdot(of_whole, of_half))) / power
            rows.append(
                {"channel": channel, LOW: low, HIGH: high, ERROR: error, FACTOR: gain, SIZE: float(np.sqrt(power))}
            )
    return rows


def _motion(one: Vehicle, track: str, speed: float, duration: float) -> dict[str, np.ndarray]:
    """Signals by channel: accelerations [m/s2] of y and z, rates [rad/s] of angles, and displacement [m]."""
    way = {"track": track, "speed": {"speed": speed}, "start": START, "duration": duration}
    scenario = Scenario.build(way | {"vehicle": one, "output_rate": RATE})
    run = build_run(scenario)
    names = channel_names(run.model)
    rows = np.concatenate(list(load_engine("compiled")(run)))
    ahead = one.semi_bogie_spacing if isinstance(one, WholeVehicle) else 0.0

    def given(name: str) -> np.ndarray:
        """Zero where a body cannot move so."""
        return rows[:, names.index(name)] if name in names else np.zeros(len(rows))

    rates = {
        channel: given(f"{channel}_rate [{'m/s' if channel[-1] in 'yz' else 'rad/s'}]")
        for channel in CHANNELS
        if not channel.startswith("primary")
    }
    rates["body.y"] = rates["body.y"] + ahead * given("body.yaw_rate [rad/s]")
    rates["body.z"] = rates["body.z"] - ahead * given("body.pitch_rate [rad/s]")
    signals = {name: np.gradient(rate, 1.0 / RATE) if name[-1] in "yz" else rate for name, rate in rates.items()}
    signals["primary1_left.displacement"] = given("primary1_left.displacement [m]")
    return {name: signal[round(SETTLED * RATE) :] for name, signal in signals.items()}


def spectra(signals: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz], and of each signal amplitudes whose squared sizes add up to its mean square, shape (n, m)."""
    values = np.stack(signals)
    window = hann(values.shape[1], sym=False)
    values = (values - values.mean(axis=1, keepdims=True)) * window
    scale = np.sqrt(2.0 / (values.shape[1] * float(window @ window)))
    return np.fft.rfftfreq(values.shape[1], 1.0 / RATE), scale * np.fft.rfft(values)


def _rows(table: pd.DataFrame, channel: str, band: tuple[float, float]) -> pd.DataFrame:
    return table.loc[(table["channel"] == channel) & (table[LOW] == band[0]) & (table[HIGH] == band[1])]


def _of_run(table: pd.DataFrame, track: str, speed: float) -> np.ndarray:
    """Errors, shape (channels, bands and everything)."""
    run = table.loc[(table["track"] == track) & (table[SPEED] == speed)]
    return np.array(
        [[float(_rows(run, channel, band)[ERROR].iloc[0]) for band in (*BANDS, EVERYTHING)] for channel in CHANNELS]
    )


def _distinct(table: pd.DataFrame, column: str) -> list[Any]:
    return list(dict.fromkeys(table[column]))


def _draw(axes: Axes, errors: np.ndarray, shortest: float) -> AxesImage:
    """Colours of errors, with the numbers in per cent, and the frequency [Hz] of the track's shortest wave."""
    image = axes.imshow(errors, norm=LogNorm(LEAST, MOST), cmap="cividis_r", aspect="auto")
    for (row, column), error in np.ndenumerate(errors):
        colour = "white" if error > 0.2 else "black"
        text = f"{100.0 * error:.2g}" if error < 0.995 else f"{100.0 * error:.0f}"
        axes.text(column, row, text, ha="center", va="center", fontsize=11.5, color=colour)
    bands = [f"{low:g}–{high:g}" for low, high in BANDS]
    axes.set_xticks(range(len(bands) + 1), [*bands, f"0–{EVERYTHING[1]:g}"], fontsize=11.5, rotation=45)
    axes.set_yticks(range(len(CHANNELS)), list(CHANNELS.values()), fontsize=12)
    axes.axvline(len(bands) - 0.5, color="white", lw=4)
    place = np.interp(np.log(shortest), np.log(EDGES), np.arange(len(EDGES)) - 0.5)
    axes.plot(float(place), -0.5, "v", ms=9, color="black", clip_on=False)
    for row, channel in enumerate(CHANNELS):
        if channel in FIRST:
            axes.axhline(row - 0.5, color="white", lw=2.5)
    as_table(axes)
    return image
