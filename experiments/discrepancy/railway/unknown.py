"""What something unknown in a fit is like: its course in time, and whether it is a tone, comes in pulses, or follows
the motion at its place.

Of a law without a name the course is its force in the run. Else it is the mean of the latent force (or reading) given
the residuals: with answers h, expected power P and covariance S of all errors, P h^H S^-1 r at each frequency (Wiener
1949). A fit lays part of what follows the motion to tolerances at that place, as friction to a damper; by how much they
are off the data sheet is missing too.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.discrepancy.core.course import Curve, curve, pulses, tone
from experiments.discrepancy.core.levels import Sums
from experiments.discrepancy.core.model import Fit, Level
from experiments.discrepancy.railway.laws import DISPLACEMENT, VELOCITY, Law
from experiments.discrepancy.railway.record import COURSE, DROPPED, WINDOW
from experiments.discrepancy.railway.system import Railway

MOST = 0.5  # of it: what explains less than half does not tell what it is like

BROADBAND = "broadband"


@dataclass(frozen=True, eq=False)
class Unknown:
    """A latent force or reading, or the force of a law.

    Attributes
    ----------
    place, unit : where it acts, and of its values. words : what it is like. share : of it that this explains. time,
    values : (n,) its course [s] within the band that is compared. frequencies, power : (F,) [Hz] its mean power over
    what acts there. curves : over displacement and velocity of the place, where it lies between two bodies.
    """

    place: str
    unit: str
    words: str
    share: float
    time: np.ndarray
    values: np.ndarray
    frequencies: np.ndarray
    power: np.ndarray
    curves: dict[str, Curve]


def unknown_of(fit: Fit) -> Unknown | None:
    """Of a fit with its residuals; None where its hypothesis has nothing unknown."""
    system = fit.system
    if fit.hypothesis.place is None or not isinstance(system, Railway):
        return None
    level = next(one for one in system.levels if one.place == fit.hypothesis.place)
    course, passed, usual = _course(fit, system, level)
    if not fit.hypothesis.unknown:
        course, passed = _of_law(fit, system), np.ones_like(passed)
    joint, states = system.joint(fit.x, fit.hypothesis.effects, level), {}
    if joint is not None:
        opening, beyond = joint
        course = course + passed * beyond
        states = {DISPLACEMENT: opening, VELOCITY: 2j * np.pi * system.record.frequencies[:, None] * opening}
    values, even = (system.record.course(one) for one in (course, course / usual[:, None]))
    time = DROPPED + 0.5 * WINDOW + np.arange(len(values)) / COURSE
    count = 2.0 * float(np.ptp(system.record.frequencies)) * len(values) / COURSE
    curves = {name: curve(values, system.record.course(passed * state), count) for name, state in states.items()}
    words, share = _words(even, curves)
    power = np.mean(np.abs(course) ** 2, axis=1) / usual**2
    return Unknown(
        level.place or "", system.unit_of(level), words, share, time, values, system.record.frequencies, power, curves
    )


def told(one: Unknown) -> dict[str, Any]:
    """For programs."""
    return {
        "place": one.place, "like": one.words, "share": round(one.share, 3), "unit": one.unit,
        "rms": float(f"{np.sqrt(np.mean(one.values**2)):.3g}"),
        "curves": {
            name: {"share": round(of.share, 3), name: _figures(of.state), "mean": _figures(of.mean)}
            for name, of in one.curves.items()
        },
    }  # fmt: skip


def _figures(values: np.ndarray) -> list[float]:
    return [float(f"{value:.4g}") for value in values]


def _words(even: np.ndarray, curves: dict[str, Curve]) -> tuple[str, float]:
    """What explains most of it, and how much. `even`: its course, all frequencies as loud beside what acts there."""
    (frequency, pure), (period, again) = tone(even, COURSE), pulses(even, COURSE)
    found = {f"a tone at {frequency:.1f} Hz": pure, f"pulses every {period:.2f} s": again}
    found |= {f"it follows the {name} there": one.share for name, one in curves.items()}
    words = max(found, key=found.__getitem__)
    return (words, found[words]) if found[words] >= MOST else (BROADBAND, found[words])


def _course(fit: Fit, system: Railway, level: Level) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(F, frames) its mean; (F, frames) the share of a force there that passes into that mean; (F,) root of the power
    of what acts there.
    """
    number = [one.name for one in system.levels].index(level.name)
    shape = system.record.seen.shape[:2]
    course, passed, powers = np.zeros(shape, complex), np.zeros(shape), np.zeros(shape)
    for section, group in enumerate(fit.groups):
        answer = system.answer(level, section)
        size = np.einsum("fc,fc->f", answer, np.conj(answer)).real
        power = np.einsum("fcc->f", group.components[number]).real / size
        seen = np.exp(2.0 * fit.psi[number]) * power[:, None] * np.conj(answer)
        onto = np.einsum("fc,fcd->fd", seen, np.linalg.inv(Sums.of(group).covariance(fit.psi)))
        part = system.record.sections[section]
        course[:, part] = np.einsum("fd,ftd->ft", onto, group.residual)
        passed[:, part] = np.einsum("fd,fd->f", onto, answer).real[:, None]
        powers[:, part] = power[:, None]
    return course, passed, np.sqrt(powers.mean(axis=1))


def _of_law(fit: Fit, system: Railway) -> np.ndarray:
    """(F, frames) force of a fit's law on the upper body."""
    effects = fit.hypothesis.effects
    number = next(place for place, one in enumerate(effects) if one.kind == "law")
    begin = len(system.coordinates) + sum(len(one.own) for one in effects[:number])
    law, found = system.installed[effects[number].listed], []
    assert isinstance(law, Law)
    values, setup = fit.x[begin : begin + len(effects[number].own)], system.at(fit.x, effects)
    system.simulated.visit([setup], lambda _, truth: found.append((law.acting(values, truth), truth.rate)))
    return system.record.modelled(*found[0])
