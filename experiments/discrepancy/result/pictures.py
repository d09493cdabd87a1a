"""Pictures of the report: where it disagrees, along the track, spectra before and after, candidates, latent force."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, LogLocator, MaxNLocator, NullFormatter

from experiments.discrepancy.fit.fitting import Problem
from experiments.discrepancy.screen.latent import LatentForce
from experiments.discrepancy.screen.locate import BANDS
from experiments.discrepancy.select.decide import Judged
from railsim.plots.style import BLUE, GREEN, PURPLE, RED, legend
from railsim.track.track import Track

BEFORE, NUISANCE, AFTER, MEASURED = RED, BLUE, GREEN, "#333333"
MOST_SPECTRA = 4


def short(channel: str) -> str:
    """A channel's name without its unit."""
    return channel.split(" [")[0]


def heat_maps(problem: Problem, states: Sequence[tuple[str, np.ndarray]]) -> Figure:
    """Residual over stated noise by channel and band, one map a state (coefficients (k, f, c))."""
    channels = problem.evidence.channels
    figure = Figure(figsize=(2.2 + 2.3 * len(states), 1.4 + 0.26 * len(channels)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, len(states), sharey=True))
    pairs = [(a, b) for a, b in zip(BANDS, BANDS[1:], strict=False) if a <= problem.frames.frequencies[-1]]
    image = None
    for panel, (title, predicted) in zip(panels, states, strict=True):
        table = _by_band(problem, predicted, pairs)
        image = panel.imshow(table, aspect="auto", cmap="magma_r", norm=LogNorm(1.0, 30.0))
        for row, column in np.ndindex(*table.shape):
            value = table[row, column]
            colour = "white" if value > 3.5 else "#333333"
            panel.text(column, row, f"{value:.1f}", ha="center", va="center", fontsize=7, color=colour)
        panel.set_title(title, fontsize=10)
        panel.set_xticks(range(len(pairs)), [f"{a:g}–{b:g}" for a, b in pairs], fontsize=8, rotation=45)
        panel.set_xlabel("frequency band [Hz]")
    panels[0].set_yticks(range(len(channels)), [short(name) for name in channels], fontsize=8)
    if image is not None:
        figure.colorbar(
            image,
            ax=list(panels),
            label="residual over stated noise, rms [-]",
            shrink=0.9,
            ticks=[1, 3, 10, 30],
            format="%g",
        )
    return figure


def _by_band(problem: Problem, predicted: np.ndarray, pairs: Sequence[tuple[float, float]]) -> np.ndarray:
    if problem.white is None:
        raise ValueError("state the noise first")
    marginal = problem.white.marginal(problem.measured - predicted)
    frequency = problem.frames.frequencies
    rows = [np.sqrt(np.nanmean(marginal[:, (frequency >= a) & (frequency < b)], axis=(0, 1))) for a, b in pairs]
    return np.array(rows).T


def along_track(problem: Problem, track: Track, s: np.ndarray, states: Sequence[tuple[str, np.ndarray]]) -> Figure:
    """Whitened residual of every section over distance; held-out sections are shaded."""
    figure = Figure(figsize=(8.8, 4.2), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    step = float(np.median(np.diff(s))) if len(s) > 1 else 1.0
    good = np.isfinite(problem.measured).all(axis=1).sum(axis=1).astype(float)
    heard = np.where(good > 0.0, good, np.nan) * 2.0 * problem.frames.shape[1]
    for place in s[problem.test]:
        top.axvspan(place - step / 2, place + step / 2, color="#eeeeee", zorder=0, linewidth=0)
    for (title, residual), colour in zip(states, (BEFORE, NUISANCE, AFTER), strict=False):
        top.plot(
            s, np.sqrt((residual**2).sum(axis=(1, 2)) / heard), color=colour, label=title, marker="o", markersize=2.5
        )
    top.axhline(1.0, color="#888888", linewidth=0.8, linestyle="--")
    top.set_yscale("log")
    top.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    top.yaxis.set_major_formatter("{x:g}")
    top.yaxis.set_minor_formatter(NullFormatter())
    low, high = top.get_ylim()
    top.set_ylim(min(low, 0.8), 1.6 * high)
    top.set_ylabel("residual over noise, rms [-]")
    top.legend(fontsize=8, ncols=3, loc="upper right")
    top.set_title("along the track (grey: held out of every fit; 1 = stated noise only)", fontsize=10)
    shown = (track.s >= s[0] - step) & (track.s <= s[-1] + step)
    total = track.totals()
    vertical = 0.5 * (total["left_vertical"] + total["right_vertical"])
    lateral = 0.5 * (total["left_lateral"] + total["right_lateral"])
    bottom.plot(track.s[shown], 1e3 * vertical[shown], color=BLUE, linewidth=0.6, label="vertical")
    bottom.plot(track.s[shown], 1e3 * lateral[shown], color=PURPLE, linewidth=0.6, label="lateral")
    legend(bottom)
    bottom.set(xlabel="distance [m]", ylabel="track [mm]")
    return figure


def spectra(problem: Problem, states: Sequence[tuple[str, np.ndarray]]) -> Figure:
    """Amplitude densities of the channels that change most: residuals of each state beside the measured signal."""
    if problem.white is None:
        raise ValueError("state the noise first")
    marginal = [problem.white.marginal(problem.measured - one) for _, one in states]
    change = np.nanmean(marginal[0], axis=(0, 1)) - np.nanmean(marginal[-1], axis=(0, 1))
    chosen = np.argsort(-change)[:MOST_SPECTRA]
    figure = Figure(figsize=(8.8, 5.6), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True).ravel()
    frequency = problem.frames.frequencies[1:]
    for panel, place in zip(panels, chosen, strict=False):
        name = problem.evidence.channels[place]
        panel.plot(frequency, _density(problem.measured[..., place]), color=MEASURED, linewidth=0.9, label="measured")
        for (title, one), colour in zip(states, (BEFORE, NUISANCE, AFTER), strict=False):
            panel.plot(
                frequency, _density((problem.measured - one)[..., place]), color=colour, linewidth=1.1, label=title
            )
        noise = _density(problem.white.deviation[problem.white.good[:, place], :, place])
        panel.fill_between(frequency, noise, noise.min() / 10.0, color="#dddddd", label="stated noise", linewidth=0)
        panel.set(xscale="log", yscale="log")
        panel.set_ylim(noise.min() / 3.0)
        panel.set_title(name.replace("]", "/√Hz]"), fontsize=9)
    for panel in panels[len(chosen) :]:
        panel.set_visible(False)
    for panel in panels[2:]:
        panel.set_xlabel("frequency [Hz]")
    panels[0].figure.legend(*panels[0].get_legend_handles_labels(), fontsize=9, ncols=5, loc="outside lower center")
    return figure


def _density(coefficients: np.ndarray) -> np.ndarray:
    return np.sqrt(np.nanmean(np.abs(coefficients) ** 2, axis=0))[1:]


def candidates(judged: Sequence[Judged], enough: float) -> Figure:
    """Evidence of every fitted effect."""
    best: dict[str, Judged] = {}
    for one in judged:  # the most probable first: a second fit of the same effects is not shown
        best.setdefault(one.hypothesis.label, one)
    shown = list(best.values())[:10][::-1]
    figure = Figure(figsize=(7.5, 1.2 + 0.32 * len(shown)), layout="constrained")
    panel = figure.subplots()
    colours = [AFTER if one.evidence >= enough and one.in_question else "#bbbbbb" for one in shown]
    panel.barh(range(len(shown)), [one.evidence for one in shown], color=colours)
    panel.set_yticks(range(len(shown)), [one.hypothesis.label for one in shown], fontsize=8)
    panel.set_xscale("symlog", linthresh=10.0)
    panel.axvline(enough, color="#888888", linewidth=0.8, linestyle="--")
    panel.set_xlabel("evidence against nuisances alone [nats]\n(dashed: needed; grey: not accepted)")
    return figure


def latent(forces: Sequence[LatentForce]) -> Figure:
    """Force against state at the places that explain most: all curves of the first, of the others the one that is
    followed best.
    """
    drawn = [one for one in forces if len(one.curve)]
    places = [one.place for one in drawn]
    shown = [one for n, one in enumerate(drawn) if one.place == places[0] or one.place not in places[:n]]
    columns = min(2, max(len(shown), 1))
    rows = -(-len(shown) // columns) or 1
    figure = Figure(figsize=(0.8 + 4.0 * columns, 3.2 * rows), layout="constrained")
    panels: list[Axes] = list(np.ravel(figure.subplots(rows, columns, squeeze=False)))
    for panel in panels[len(shown) :]:
        panel.remove()
    for panel, one in zip(panels, shown, strict=False):
        panel.errorbar(one.curve[:, 0], one.curve[:, 1], one.curve[:, 2], color=AFTER, marker="o", markersize=3)
        panel.axhline(0.0, color="#bbbbbb", linewidth=0.6)
        state, _, unit = one.state.rstrip("]").partition(" [")
        panel.set(xlabel=state, ylabel="missing force")
        panel.set_title(
            f"{one.place.label}\n{one.gain:.0f} nats; this state explains {100.0 * one.follows:.0f} % of its power",
            fontsize=10,
        )
        panel.xaxis.set_major_locator(MaxNLocator(3))
        panel.tick_params(labelsize=9)
        panel.xaxis.set_major_formatter(EngFormatter(unit))
        panel.yaxis.set_major_formatter(EngFormatter(one.place.unit))
    return figure
