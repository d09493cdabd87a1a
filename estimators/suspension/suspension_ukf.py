"""Condition of the secondary dampers and conicity by an unscented Kalman filter of state and parameters (filterpy)."""

import numpy as np
from filterpy.kalman import JulierSigmaPoints, UnscentedKalmanFilter

from estimators.suspension.augmented_state import JointEstimator, Matrices

KAPPA = 0.0  # all weights positive, so that covariances stay so (Julier and Uhlmann 1997)


class SuspensionUkf(JointEstimator, frozen=True):
    """Lateral and yaw damping and conicity of a half vehicle, by an unscented Kalman filter.

    Sigma points go through the product of state and parameters (Julier and Uhlmann 1997).
    """

    def begin(self, now: Matrices, mean: np.ndarray, covariance: np.ndarray, walk: float) -> "_Filter":
        """The filter at its start."""
        return _Filter(now, mean, covariance, walk)


class _Filter(UnscentedKalmanFilter):
    def __init__(self, now: Matrices, mean: np.ndarray, covariance: np.ndarray, walk: float) -> None:
        points = JulierSigmaPoints(len(mean), kappa=KAPPA, sqrt_method=_root)
        super().__init__(len(mean), len(now.R), 1.0, hx=_nothing, fx=_nothing, points=points)
        self.x, self.P = mean, covariance
        self._walk = walk

    def move(self, now: Matrices, known: np.ndarray, inputs: np.ndarray, readings: np.ndarray) -> None:
        """Every sigma point by the matrices of its own parameters, then filterpy's equations."""
        n = len(now.Q)
        self.Q = np.zeros((n + 3, n + 3))
        self.Q[:n, :n], self.Q[n:, n:] = now.Q, self._walk * np.eye(3)

        points = self.points_fn.sigma_points(self.x, self.P)
        of_steps = iter(now.at(np.clip(points[:, n:], 0.0, 1.0))[0])  # filterpy asks for them one by one, in this order

        def move(z: np.ndarray, dt: float) -> np.ndarray:
            del dt
            return np.concatenate([next(of_steps) @ np.concatenate([z[:n], known]), z[n:]])

        def read(z: np.ndarray) -> np.ndarray:
            return next(of_readings) @ np.concatenate([z[:n], inputs])

        self.predict(fx=move)
        of_readings = iter(now.at(np.clip(self.sigmas_f[:, n:], 0.0, 1.0))[1])
        self.update(readings, R=now.R, hx=read)
        self.P = (self.P + self.P.T) / 2.0


def _root(matrix: np.ndarray) -> np.ndarray:
    """Upper triangular root; states of very different size are scaled first."""
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-30))
    scaled = matrix / np.outer(size, size)
    for jitter in (0.0, 1e-12, 1e-9, 1e-6):
        try:
            return np.linalg.cholesky(scaled + jitter * np.eye(len(size))).T * size
        except np.linalg.LinAlgError:
            continue
    values, vectors = np.linalg.eigh(scaled)
    return (vectors * np.sqrt(np.maximum(values, 0.0))).T * size


def _nothing(z: np.ndarray, dt: float = 0.0) -> np.ndarray:
    del dt
    return z
