"""Latent force: the force at each place that would explain the residual, and its curve against the state there.

A stationary smoother: at every frequency the force of least variance that the linear answers pass on to all channels,
its own density taken from the residual.
"""

from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.baseline.frames import REDUNDANCY, Frames
from experiments.discrepancy.baseline.memory import MemoryTruth
from experiments.discrepancy.fit.fitting import Fit, Problem
from experiments.discrepancy.screen.linear import Place, answers, places, readings

EDGES = (0.0, 0.01, 0.03, 0.07, 0.14, 0.22, 0.3, 0.4, 0.5, 0.6, 0.7, 0.78, 0.86, 0.93, 0.97, 0.99, 1.0)
"""Quantiles of the state between which a curve has a point: narrow where a law that stiffens says most."""
SMOOTHED = 3  # frequency bins to each side over which the force's density is taken


@dataclass(frozen=True)
class LatentForce:
    """The force at one place.

    Attributes
    ----------
    explained : share of the residual's excess on held-out frames that it takes. gain : nats, training frames, less half
    a logarithm per number fitted. time [s], force : smoothed. state : name and unit of what it follows best.
    curve : (points, 3) state, mean force, standard error. follows : share of the force's variance that the curve has.
    """

    place: Place
    explained: float
    gain: float
    time: np.ndarray
    force: np.ndarray
    state: str
    curve: np.ndarray
    follows: float


def latent_forces(problem: Problem, fit: Fit, best: int = 3, motion: Fit | None = None) -> list[LatentForce]:
    """The places that explain most, best first, each with its curve over each of its states; a channel's own reading is
    one. The states are those of the fit, or of another whose `motion` is nearer to the true one.
    """
    if problem.white is None:
        raise ValueError("state the noise first")
    seen_in = motion or fit
    setup, truth = problem.forward.run(seen_in.z, seen_in.effects)
    speed = float(np.median(problem.evidence.speed[1]))
    found = places(setup.model)
    evidence = problem.evidence
    frequencies = problem.frames.frequencies
    gains = answers(setup.model, speed, found, setup.sensors, evidence.channels, frequencies)
    shown, own = readings(evidence.channels, frequencies)
    found, gains = [*found, *shown], np.concatenate([gains, own])
    residual = np.where(problem.white.good[:, None, :], problem.measured - fit.stacked, 0.0)
    white = np.matmul(problem.white.inverse, residual[..., None])[..., 0]
    ranked = []
    for number, place in enumerate(found):
        seen = np.matmul(problem.white.inverse, gains[number][None, :, :, None])[..., 0]  # (k, f, c)
        ranked.append((place, *_smoothed(problem, white, seen)))
    ranked.sort(key=lambda one: -one[1])
    return [curve for one in ranked[:best] for curve in _described(problem, truth, *one)]


def _smoothed(problem: Problem, white: np.ndarray, seen: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Gain, share explained, and the force's coefficients (k, f)."""
    information = (np.abs(seen) ** 2).sum(axis=-1) + 1e-30
    best = (seen.conj() * white).sum(axis=-1) / information
    train = problem.train
    excess = (np.abs(best[train]) ** 2 - 1.0 / information[train]).mean(axis=0)
    kernel = np.ones(2 * SMOOTHED + 1) / (2 * SMOOTHED + 1)
    density = np.clip(np.convolve(excess, kernel, mode="same"), 0.0, None)
    share = density * information / (1.0 + density * information)
    force = share * best
    taken = share * np.abs(best) ** 2 * information  # log-likelihood ratio of the smoother, with the next term
    gain = float((taken[train] - np.log1p(density * information[train])).sum()) / REDUNDANCY
    test = problem.test
    before = (np.abs(white[test]) ** 2).sum()
    after = (np.abs(white[test] - force[test][..., None] * seen[test]) ** 2).sum()
    count = max(float(before) - white[test].size, 1e-9)
    return gain, float(before - after) / count, force


def _described(
    problem: Problem, truth: MemoryTruth, place: Place, gain: float, explained: float, coefficients: np.ndarray
) -> list[LatentForce]:
    """One for each state, the one that the force follows best first."""
    rate = 4.0 * float(problem.frames.frequencies[-1])
    time, force = _in_time(problem.frames, coefficients, rate)
    fits = []
    for state, values in _states(truth, place).items():
        at = np.interp(time, truth.time, values)
        fits.append((*_curve(at, force), state))
    if not fits:
        return [LatentForce(place, explained, gain, time, force, "", np.zeros((0, 3)), 0.0)]
    fits.sort(key=lambda one: -one[1])
    return [LatentForce(place, explained, gain, time, force, state, curve, follows) for curve, follows, state in fits]


def _in_time(frames: Frames, coefficients: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Overlap-add of the frames' inverse transforms at `rate` [Hz]."""
    count = round(frames.length * rate)
    window = np.sin(np.pi * (np.arange(count) + 0.5) / count)
    spectrum = np.zeros((len(coefficients), count // 2 + 1), complex)
    spectrum[:, : coefficients.shape[1]] = coefficients * np.sqrt(rate * float(window @ window) / 2.0)
    pieces = np.fft.irfft(spectrum, count, axis=1) * window
    hop = count // 2
    total = np.zeros(hop * (len(pieces) + 1))
    for number, piece in enumerate(pieces):
        total[number * hop : number * hop + count] += piece
    inner = slice(hop, -hop)
    return (frames.starts[0] + np.arange(len(total)) / rate)[inner], total[inner]


def _states(truth: MemoryTruth, place: Place) -> dict[str, np.ndarray]:
    """Relative displacement and velocity at the place, as the model has them."""
    turning = place.direction in ("roll", "pitch", "yaw")
    found = {}
    for ending, unit in (("", "rad" if turning else "m"), ("_rate", "rad/s" if turning else "m/s")):
        name = f"{{}}.{place.direction}{ending} [{unit}]"
        if name.format(place.upper) not in truth:
            continue
        values = truth[name.format(place.upper)]
        if place.lower and name.format(place.lower) in truth:
            values = values - truth[name.format(place.lower)]
        what = "velocity" if ending else "displacement"
        found[f"relative {what} [{unit}]" if place.lower else f"{what} [{unit}]"] = values
    return found


def _curve(state: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, float]:
    """Mean force in bins, and the share of its variance that the bins' means have."""
    edges = np.quantile(state, EDGES)
    which = np.clip(np.searchsorted(edges, state, side="right") - 1, 0, len(EDGES) - 2)
    rows = []
    fitted = np.zeros_like(force)
    for number in range(len(EDGES) - 1):
        inside = which == number
        if inside.sum() < 4:
            continue
        mean = float(force[inside].mean())
        fitted[inside] = mean
        rows.append((float(state[inside].mean()), mean, float(force[inside].std() / np.sqrt(inside.sum() / 8.0))))
    variance = float(force.var())
    return np.array(rows), 1.0 - float((force - fitted).var()) / variance if variance > 0.0 else 0.0
