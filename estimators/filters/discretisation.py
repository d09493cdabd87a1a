"""Linear models of continuous time in steps: transition, noise, inputs, mean outputs."""

from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.signal import cont2discrete


def van_loan(A: np.ndarray, intensity: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition and covariance of dx/dt = A x + w over a step, shapes (n, n).

    Van Loan (1978), Computing integrals involving the matrix exponential, IEEE Trans. Autom. Control 23: from the
    exponential of [[-A, W], [0, A']].

    Parameters
    ----------
    intensity : W, covariance of the white noise w per unit of time or distance, (n, n).
    step : duration or distance. It is halved until -A grows by no more than e over a part, and the parts put together:
        what a stiff system forgets within a step would otherwise drown the rest.
    """
    n, halvings = len(A), max(0, int(np.ceil(np.log2(max(-np.linalg.eigvals(A).real.min() * step, 1.0)))))
    moved = expm(np.block([[-A, intensity], [np.zeros((n, n)), A.T]]) * (step / 2**halvings))
    F = moved[n:, n:].T
    Q = F @ moved[:n, n:]
    for _ in range(halvings):
        Q = Q + F @ Q @ F.T
        F = F @ F
    return F, (Q + Q.T) / 2.0


def held_inputs(A: np.ndarray, B: np.ndarray, step: float) -> np.ndarray:
    """What inputs that stay as they are over a step do to the state, (n, k)."""
    found: Any = cont2discrete((A, B, np.eye(len(A)), np.zeros_like(B)), step, "zoh")
    return found[1]


def ramped_inputs(A: np.ndarray, B: np.ndarray, step: float) -> np.ndarray:
    """What inputs that go in a straight line do to the state: for their values before and after the step, (n, 2 k).

    SciPy's first-order hold is for a state from which the share of the present input is taken out.
    """
    found: Any = cont2discrete((A, B, np.eye(len(A)), np.zeros_like(B)), step, "foh")
    F, both, _, after, _ = found
    return np.hstack([both - F @ after, after])


def mean_outputs(A: np.ndarray, C: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition over a step (n, n), and the mean over it of the outputs C x by the state at its start, (m, n)."""
    n, m = len(A), len(C)
    moved = expm(np.block([[A, np.zeros((n, m))], [C, np.zeros((m, m))]]) * step)
    return moved[:n, :n], moved[n:, :n] / step
