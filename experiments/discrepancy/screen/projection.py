"""Projection: what of a signature the numbers that are fitted so far cannot take, and what it would gain."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.discrepancy.baseline.noise import split
from experiments.discrepancy.fit.fitting import Fit, Problem
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.fit.scores import TOLERATED, Shares, at_bound

RANGE = (0.3, 2.5)  # of the signature's size that may be scaled linearly
SLIGHTEST = 0.05  # the same of what is linear over all of its sizes, to smaller ones


class Projection:
    """Linear model of all that is fitted so far, over some frames: what of a signature it cannot take.

    Numbers at the edge of their tolerance are held there, or come back if the signature lets them. All in double
    precision: what is left of a gain of a sensor that feels gravity is a millionth of its signature.
    """

    def __init__(self, fit: Fit, frames: np.ndarray, bounds: np.ndarray | None = None) -> None:
        if fit.jacobian is None:
            raise ValueError("give the fit its whitened derivatives (Problem.differentiated)")
        shares = Shares(fit.candidates)
        n, m = len(fit.z), len(fit.shares)
        self.frames = frames
        self.residual = (WEIGHT * fit.residual[frames]).ravel()
        flat = fit.jacobian[:, frames].astype(float).reshape(n + m, -1)
        flat *= WEIGHT
        matrix, downhill, self.at = shares.scaled(flat @ flat.T, flat @ self.residual, fit.z, fit.shares)
        self.flat = flat
        self.flat[n:] *= 0.5 / TOLERATED
        self.bound = at_bound(self.at, bounds)
        self._paired_flat: np.ndarray | None = None
        self._sets: list[tuple[np.ndarray, np.ndarray, float]] = []
        for held in [self.bound, np.zeros_like(self.bound)] if self.bound.any() else [self.bound]:
            inverse = np.zeros_like(matrix)
            free = np.flatnonzero(held == 0)
            inverse[np.ix_(free, free)] = np.linalg.inv(matrix[np.ix_(free, free)])
            own = inverse @ downhill
            self._sets.append((inverse, own, 0.5 * float(downhill @ own)))

    def cleaned(self, signature: np.ndarray) -> np.ndarray:
        """What of a signature (n,) the numbers cannot take."""
        return signature - (self._sets[0][0] @ (self.flat @ signature)) @ self.flat

    def row(self, white: np.ndarray) -> np.ndarray:
        """(n,) of a complex whitened signature (k, f, c)."""
        return WEIGHT * split(white[self.frames].astype(complex)).ravel()

    def along(self, signatures: np.ndarray) -> np.ndarray:
        """(p, numbers) products of signatures (p, n) with the derivatives."""
        return (self.flat @ signatures.T).T

    def judge_each(self, signatures: np.ndarray, least: Sequence[float]) -> list["Judgement"]:
        """Each of some signatures (p, n) by itself, scaled as it is best, the numbers following; `least` (p,): the
        smallest scale that it may have.

        With d = J r - x / std^2, M = J J^T + 1 / std^2: gain(a) = d M^-1 d / 2 + a s (r - J^T M^-1 d) - a^2 (s s - s
        J^T M^-1 J s) / 2; what the numbers could gain by themselves is no gain.
        """
        along = self.along(signatures)
        across, size = signatures @ self.residual, np.einsum("pn,pn->p", signatures, signatures)
        ones = [slice(number, number + 1) for number in range(len(signatures))]
        found = [self.weighed(along[one], across[one], size[one], low) for one, low in zip(ones, least, strict=True)]
        taken = np.stack([moved for *_, moved, _ in found]) @ self.flat
        taken += np.array([[factor] for _, _, factor, *_ in found]) * signatures
        return [
            Judgement(0, factor, gain, moved, one, left)
            for (gain, _, factor, moved, left), one in zip(found, taken, strict=True)
        ]

    def products(self, white: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Products of some complex whitened signatures (j, k, f, c) with the derivatives and, last, the residual (j, t,
        f, numbers + 1), and of each with itself (j, t, f), complex: sums of the real parts are the products, those of a
        signature that is turned (and made larger) frame by frame and frequency by frequency if these are turned first.
        """
        shape = len(white), int(self.frames.sum()), white.shape[2], -1
        rows = _paired(np.stack([self.row(one) for one in white]).reshape(shape))
        along = np.matmul(self._conjugate(rows.shape[1:3]), np.moveaxis(rows, 0, -1))
        return np.moveaxis(along, -1, 0), _squared(rows).sum(axis=-1)

    def _conjugate(self, shape: tuple[int, ...]) -> np.ndarray:
        """(t, f, numbers + 1, c) of the derivatives and the residual; made once."""
        if self._paired_flat is None:
            pairs = _paired(np.stack([*self.flat, self.residual]).reshape(len(self.flat) + 1, *shape, -1))
            self._paired_flat = np.ascontiguousarray(np.moveaxis(pairs, 0, -2).conj())
        return self._paired_flat

    def judge_turned(self, white: np.ndarray, factors: np.ndarray, least: float = RANGE[0]) -> "Judgement":
        """The best of what a whitened signature (k, f, c) becomes by factors (p, k or 1, f or 1)."""
        turned = factors[:, self.frames] if factors.shape[1] > 1 else factors
        (along,), (own,) = self.products(white[None])
        for axis in (0, 1):  # what is turned alike is summed up first
            if turned.shape[1 + axis] == 1:
                along, own = along.sum(axis=axis, keepdims=True), own.sum(axis=axis, keepdims=True)
        turned = turned.reshape(len(turned), -1)
        sums = _real_product(turned, along.reshape(turned.shape[1], -1))
        gain, best, factor, moved, left = self.weighed(sums[:, :-1], sums[:, -1], _squared(turned) @ own.ravel(), least)
        return self._judged(white * factors[best][..., None], (best, factor, gain, moved, left))

    def judge_later(
        self, parts: np.ndarray, rows: np.ndarray, turn: np.ndarray, least: float = RANGE[0]
    ) -> "Judgement":
        """The best of what whitened signatures (j, k, f, c), each a row of truth later than the one before, become so
        many rows (p, k) later; `turn` (f,) is what `j` rows later is to each frequency [rad].
        """
        here = rows[:, self.frames]
        whole, part = np.divmod(here, len(parts))
        first, at = int(whole.min()), np.arange(here.shape[1])
        angles = np.outer(np.arange(first, int(whole.max()) + 1), turn)
        along, own = self.products(parts)
        pairs = np.concatenate([np.real(along), np.imag(along)], axis=2)
        sums = np.matmul(np.concatenate([np.cos(angles), np.sin(angles)], axis=1), pairs)
        sums = sums[part, at, whole - first].sum(axis=1)
        size = own.sum(axis=-1)[part, at].sum(axis=1)
        gain, best, factor, moved, left = self.weighed(sums[:, :-1], sums[:, -1], size, least)
        whole, part = np.divmod(rows[best], len(parts))
        signature = parts[part, np.arange(parts.shape[1])] * np.exp(-1j * np.outer(whole, turn))[..., None]
        return self._judged(signature, (best, factor, gain, moved, left))

    def _judged(self, signature: np.ndarray, found: tuple[int, float, float, np.ndarray, float]) -> "Judgement":
        best, factor, gain, moved, left = found
        return Judgement(best, factor, gain, moved, factor * self.row(signature) + moved @ self.flat, left, signature)

    def weighed(
        self, along: np.ndarray, across: np.ndarray, size: np.ndarray, least: float = RANGE[0]
    ) -> tuple[float, int, float, np.ndarray, float]:
        """Gain of the best of some signatures, which it is, its scale, how the numbers move, and its power left, from
        products with the derivatives (p, numbers), with the residual (p,) and with itself (p,); none is made smaller
        than by `least`.
        """
        best = (-np.inf, 0, 1.0, np.zeros(0), 0.0)
        for inverse, own, relief in self._sets:
            follow = along @ inverse
            power = np.maximum(size - np.einsum("pi,pi->p", along, follow), 1e-9)
            slope = across - along @ own
            scale = np.clip(slope / power, least, RANGE[1])
            gain = relief - self._sets[0][2] + scale * slope - 0.5 * scale**2 * power
            move = own - scale[:, None] * follow
            gain[(move * self.bound > 1e-9).any(axis=1)] = -np.inf
            top = int(np.argmax(gain))
            if gain[top] > best[0]:
                best = float(gain[top]), top, float(scale[top]), move[top], float(power[top])
        return best


def _real_product(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Real part of a matrix product, in half of the multiplications of the whole."""
    real, imaginary = (
        np.ascontiguousarray(part(left)) @ np.ascontiguousarray(part(right)) for part in (np.real, np.imag)
    )
    return real - imaginary


def _squared(values: np.ndarray) -> np.ndarray:
    """Squares of the magnitudes, without their roots."""
    return np.real(values) ** 2 + np.imag(values) ** 2


def _paired(values: np.ndarray) -> np.ndarray:
    """Complex (..., c) of what `split` made (..., 2 c)."""
    half = values.shape[-1] // 2
    return values[..., :half] + 1j * values[..., half:]


@dataclass(frozen=True)
class Judgement:
    """Which signature at which scale, gain [nats], move of the numbers, what leaves the residual (n,), power left; of
    turned ones the signature (k, f, c) itself.
    """

    which: int
    scale: float
    gain: float
    move: np.ndarray
    taken: np.ndarray
    power: float
    signature: np.ndarray | None = None


def whitened(problem: Problem, change: np.ndarray) -> np.ndarray:
    """(k, f, c) change in standard deviations of the noise, complex; raises where no noise was stated yet."""
    if problem.white is None:
        raise ValueError("state the noise first")
    return problem.white.complex(change).astype(np.complex64)
