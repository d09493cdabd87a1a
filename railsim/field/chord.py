"""Versines over a chord to the alignment of the rail, and back.

The versine at s over a chord from s - b to s + a is v(s) = y(s) - [a y(s - b) + b y(s + a)] / (a + b). A wave
exp(i k s) comes out with the gain

    H(k) = 1 - [a exp(-i k b) + b exp(i k a)] / (a + b),

which vanishes for long waves (as a b k^2 / 2) and, over a symmetric chord of length L, for the wavelengths L/2, L/4 ...
(Haigermoser, Luber, Rauh and Graefe 2015, Vehicle System Dynamics 53, 878-957, on versine measurements; EN 13848-1).
"""

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from railsim.errors import InputError
from railsim.field.map import Chord
from railsim.field.tables import Notes

_SOFT = 0.15  # of a band edge's wave number: width of its raised-cosine flank


def gain(wave_number: np.ndarray, chord: Chord) -> np.ndarray:
    """H(k), complex, for wave numbers k in rad/m."""
    a, b = chord.ahead, chord.behind
    return 1 - (a * np.exp(-1j * wave_number * b) + b * np.exp(1j * wave_number * a)) / (a + b)


def alignment(versine: np.ndarray, spacing: float, chord: Chord, name: str, notes: Notes) -> np.ndarray:
    """Alignment (or level) y from versines v on a uniform grid, both in m, shape (n,).

    Y = V conj(H) / (|H|^2 + floor^2), Tikhonov's regularised inverse, holds back waves that the chord does not see.
    Only wavelengths from `shortest` to `longest` are given; the ends are continued by odd reflection and are
    uncertain over one `longest`.

    Raises
    ------
    InputError : the record is shorter than four times `longest`, or too coarse for `shortest`.
    """
    length = versine.size * spacing
    if length < 4 * chord.longest:
        raise InputError(
            f"{name}: {length:.0f} m of versines give no wavelengths up to {chord.longest:g} m; record at least "
            f"{4 * chord.longest:.0f} m or lower chord.longest"
        )
    if not max(2.5 * spacing, 0.0) < chord.shortest < chord.longest:
        raise InputError(f"{name}: chord.shortest must lie between {2.5 * spacing:g} m and chord.longest")
    margin = min(versine.size - 1, int(np.ceil(4 * chord.longest / spacing)))
    padded = _reflected(versine, margin)
    size = int(next_fast_len(padded.size, real=True) or padded.size)
    k = 2 * np.pi * np.fft.rfftfreq(size, spacing)
    response = gain(k, chord)
    inverse = np.conj(response) / (np.abs(response) ** 2 + chord.floor**2) * _band(k, chord)
    result = np.asarray(irfft(np.asarray(rfft(padded, size)) * inverse, size))
    notes.assume(_described(name, chord))
    return result[margin : margin + versine.size]


def _reflected(values: np.ndarray, margin: int) -> np.ndarray:
    """Values with odd reflections of `margin` values at both ends, which fade to the end's value."""
    fade = np.cos(np.pi / 2 * np.arange(1, margin + 1) / margin) ** 2
    before = values[0] - (values[1 : margin + 1] - values[0]) * fade
    after = values[-1] - (values[-2 : -margin - 2 : -1] - values[-1]) * fade
    return np.concatenate([before[::-1], values, after])


def _band(k: np.ndarray, chord: Chord) -> np.ndarray:
    """1 between the wavelengths, raised-cosine flanks about both edges."""
    low, high = 2 * np.pi / chord.longest, 2 * np.pi / chord.shortest
    rise = np.clip((k / low - 1) / (2 * _SOFT) + 0.5, 0, 1)
    fall = np.clip((1 - k / high) / (2 * _SOFT) + 0.5, 0, 1)
    return np.sin(np.pi / 2 * rise) ** 2 * np.sin(np.pi / 2 * fall) ** 2


def _described(name: str, chord: Chord) -> str:
    """What the inverse does, with the wavelengths that it cannot give."""
    length = np.geomspace(chord.shortest, chord.longest, 2000)
    power = np.abs(gain(2 * np.pi / length, chord)) ** 2
    kept = power / (power + chord.floor**2)
    blind = length[kept < 0.5]
    text = (
        f"{name}: alignment from versines over a chord of {chord.behind:g} + {chord.ahead:g} m, wavelengths "
        f"{chord.shortest:g} to {chord.longest:g} m, inverse held back where the chord's gain is below {chord.floor:g}"
    )
    if not blind.size:
        return text
    edges = np.flatnonzero(np.diff(np.flatnonzero(kept < 0.5)) > 1)
    starts = np.concatenate([[0], edges + 1])
    ends = np.concatenate([edges, [blind.size - 1]])
    bands = ", ".join(f"{blind[i]:.3g} to {blind[j]:.3g} m" for i, j in zip(starts, ends, strict=True))
    return f"{text}; less than half is left of wavelengths {bands}"
