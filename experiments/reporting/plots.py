"""Pictures of one run: speed, the vehicle on the track, wheel forces."""

import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.reporting.units import KMH
from railsim.constants import GRAVITY
from railsim.measurements import Measurements
from railsim.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, frame, legend, thin
from railsim.truth import SPEED, Truth

ESTIMATOR_COLOURS = (PURPLE, BLUE, SKY, RED)
SENSOR_STYLES = ((GREEN, "-"), (ORANGE, (0.0, (4.0, 3.0))))
"""Colour and line of tachometers; the second one has gaps through which the first is seen."""
CLOSE = 60.0  # m; length of the stretch that is shown from close by


@dataclass(frozen=True)
class Results:
    """What `railsim run` draws.

    Attributes
    ----------
    speed_errors : by estimator the times [s] and errors [m/s] of its speed, NaN where not valid.
    """

    name: str
    description: str
    truth: Truth
    measured: Measurements
    speed_errors: Mapping[str, tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Line:
    """A channel of the truth, times a factor, plus an offset."""

    channel: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Row:
    """A panel over distance: its label and the lines in it by name."""

    label: str
    lines: Mapping[str, Line]
    height: float = 1.0


def speed(results: Results) -> Figure:
    """Speeds over time, and their errors on two scales."""
    figure, panels = _panels(results, (3.0, 2.0, 2.0), columns=1)
    top, middle, bottom = panels[:, 0]
    truth = results.truth
    _sensors(results, top, middle)
    _line(top, truth.time, KMH * truth[SPEED], color=BLACK, lw=2.6, label="true", zorder=4)
    spreads = []
    for (name, (time, error)), colour in zip(results.speed_errors.items(), cycle(ESTIMATOR_COLOURS), strict=False):
        true = np.interp(time, truth.time, truth[SPEED])
        _line(top, time, KMH * (true + error), color=colour, lw=1.2, label=name, zorder=5)
        for axes in (middle, bottom):
            _line(axes, time, KMH * error, color=colour, lw=1.0, zorder=5)
        if np.isfinite(error).any():
            spreads.append(KMH * float(np.nanquantile(np.abs(error), 0.999)))
    for axes in (middle, bottom):
        axes.axhline(0.0, color=BLACK, lw=0.8, zorder=3)
    if spreads:
        _limit(middle, 1.15 * max(spreads))
        _limit(bottom, 1.15 * min(spreads))
    top.set_ylabel("speed [km/h]")
    beside = top.secondary_yaxis("right", functions=(lambda speed: speed / KMH, lambda speed: KMH * speed))
    beside.set_ylabel("speed [m/s]")
    middle.set_ylabel("error [km/h]")
    bottom.set_ylabel("error, closer [km/h]")
    bottom.set_xlabel("time [s]")
    legend(top)
    return figure


def overview(results: Results) -> Figure:
    """Track, wheelsets and bogie over distance."""
    curve = Row(
        "curvature\nand cant",
        {
            "curvature [1/km]": Line("track1.curvature [1/m]", 1e3),
            "cant [cm]": Line("track1.cant [m]", 1e2),
        },
    )
    rates = {"roll": "x", "pitch": "y", "yaw": "z"}
    rows = [
        Row(
            "rail height\n[mm]",
            {
                "left rail": Line("track1.left_vertical [m]", 1e3),
                "right rail": Line("track1.right_vertical [m]", 1e3),
            },
        ),
        Row(
            "lateral\n[mm]",
            {
                "leading wheelset": Line("wheelset1.y [m]", 1e3),
                "trailing wheelset": Line("wheelset2.y [m]", 1e3),
            },
        ),
        Row("bogie lateral\n[m/s²]", {"": Line("bogie.specific_force_y [m/s2]")}),
        Row("bogie vertical\nless g [m/s²]", {"": Line("bogie.specific_force_z [m/s2]", 1.0, -GRAVITY)}),
        Row(
            "bogie rates\n[°/s]",
            {name: Line(f"bogie.angular_velocity_{axis} [rad/s]", np.degrees(1.0)) for name, axis in rates.items()},
        ),
    ]
    curved = bool(np.abs(results.truth["track1.curvature [1/m]"]).max() > 1e-9)
    return _over_distance(results, [curve] * curved + rows, (BLUE, ORANGE, BLACK))


FLANGE = "second_normal_force [N]"
"""Of a wheel that may touch its rail in two places."""


def forces(results: Results) -> Figure:
    """Forces between wheels and rails over distance."""
    wheels = {
        f"{end} {side}": f"wheel{number}_{side}"
        for number, end in ((1, "leading"), (2, "trailing"))
        for side in ("left", "right")
    }
    quantities = {
        "normal\n[kN]": "normal_force [N]",
        "lateral creep\n[kN]": "creep_force_y [N]",
        "longitudinal\ncreep [kN]": "creep_force_x [N]",
    }
    if f"wheel1_left.{FLANGE}" in results.truth:
        quantities["normal on\nflange [kN]"] = FLANGE
    rows = [
        Row(label, {name: Line(f"{wheel}.{quantity}", 1e-3) for name, wheel in wheels.items()}, height=1.6)
        for label, quantity in quantities.items()
    ]
    return _over_distance(results, rows, (BLUE, SKY, RED, ORANGE), legends=1)


PLOTS: dict[str, Callable[[Results], Figure]] = {"speed": speed, "overview": overview, "forces": forces}
"""Every plot of a run by the name of its file."""


def sensor_label(measured: Measurements, channel: str) -> str:
    """Kind and name of the sensor that gives a channel; once where both are the same."""
    sheet = measured.sensor(channel)
    return sheet["kind"] if sheet["kind"] == sheet["name"] else f"{sheet['kind']} {sheet['name']}"


def _over_distance(results: Results, rows: list[Row], colours: tuple[str, ...], legends: int | None = None) -> Figure:
    """Left the whole run, right a stretch of it from close by; what the vehicle does not have is left out."""
    truth = results.truth
    rows = [row for row in rows if any(line.channel in truth for line in row.lines.values())]
    distance = truth["s [m]"]
    middle = 0.5 * (distance[0] + distance[-1])
    close = np.abs(distance - middle) <= 0.5 * min(CLOSE, float(np.ptp(distance)))
    figure, panels = _panels(results, tuple(row.height for row in rows), columns=2)
    for number, row in enumerate(rows):
        whole, stretch = panels[number]
        for (name, line), colour in zip(row.lines.items(), colours, strict=False):
            if line.channel in truth:
                y = line.factor * truth[line.channel] + line.offset
                _line(whole, distance, y, color=colour, lw=0.8, label=name)
                _line(stretch, distance[close], y[close], color=colour, lw=1.2)
        whole.set_ylabel(row.label)
        legend(whole, len(row.lines) > 1 and number < (legends or len(rows)))
    panels[-1, 0].set_xlabel("distance [m]")
    panels[-1, 1].set_xlabel("distance [m], closer")
    return figure


def _panels(results: Results, heights: tuple[float, ...], columns: int) -> tuple[Figure, np.ndarray]:
    """The frame of a run's picture."""
    title = "\n".join(textwrap.wrap(f"{results.name}: {results.description}".rstrip(": "), 110))
    return frame(heights, title, columns)


def _line(axes: Axes, x: np.ndarray, y: np.ndarray, **style: object) -> None:
    axes.plot(*thin(x, y), **style)  # pyright: ignore[reportArgumentType]


def _limit(axes: Axes, size: float) -> None:
    size = max(size, 1e-3)
    axes.set_ylim(-size, size)


def _sensors(results: Results, top: Axes, middle: Axes) -> None:
    """Tachometers and GNSS, behind the estimates."""
    truth, measured = results.truth, results.measured
    names = [name for name in measured.channels if name.endswith(f".{SPEED}")]
    styles = iter(SENSOR_STYLES)
    for name in names:
        colour, line = (GREY, "-") if measured.sensor(name)["kind"] == "gnss" else next(styles, (GREY, "-."))
        time, values = measured.time(name), measured[name]
        _line(top, time, KMH * values, color=colour, ls=line, lw=1.8, label=sensor_label(measured, name), zorder=2)
        error = values - np.interp(time, truth.time, truth[SPEED])
        _line(middle, time, KMH * error, color=colour, ls=line, lw=1.2, zorder=2)
