"""Condition of the secondary dampers and conicity by an extended Kalman filter of state and parameters (filterpy)."""

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from estimators.suspension.augmented_state import JointEstimator, Matrices


class SuspensionEkf(JointEstimator, frozen=True):
    """Lateral and yaw damping and conicity of a half vehicle, by an extended Kalman filter.

    It is of first order in the product of state and parameters (Jazwinski 1970), and needs a start that is not far off.
    """

    def begin(self, now: Matrices, mean: np.ndarray, covariance: np.ndarray, walk: float) -> "_Filter":
        """The filter at its start."""
        return _Filter(now, mean, covariance, walk)


class _Filter(ExtendedKalmanFilter):
    def __init__(self, now: Matrices, mean: np.ndarray, covariance: np.ndarray, walk: float) -> None:
        super().__init__(dim_x=len(mean), dim_z=len(now.R))
        self.x, self.P = mean, covariance
        self._walk = walk

    def move(self, now: Matrices, known: np.ndarray, inputs: np.ndarray, readings: np.ndarray) -> None:
        """Linearise about the mean, then filterpy's equations."""
        n = len(now.Q)
        point = self.x[n:]
        moved, _ = now.at(point[None, :])
        slopes, _ = now.slopes(point)
        before = np.concatenate([self.x[:n], known])
        self.F = np.eye(n + 3)
        self.F[:n, :n] = moved[0, :, :n]
        self.F[:n, n:] = (slopes @ before).T
        self.Q = np.zeros((n + 3, n + 3))
        self.Q[:n, :n], self.Q[n:, n:] = now.Q, self._walk * np.eye(3)
        self.x = np.concatenate([moved[0] @ before, point])
        self.P = self.F @ self.P @ self.F.T + self.Q
        _, seen = now.at(point[None, :])
        _, slopes = now.slopes(point)

        def reading(x: np.ndarray) -> np.ndarray:
            return seen[0] @ np.concatenate([x[:n], inputs])

        def jacobian(x: np.ndarray) -> np.ndarray:
            return np.hstack([seen[0][:, :n], (slopes @ np.concatenate([x[:n], inputs])).T])

        self.dim_z = len(now.R)
        self.update(readings, jacobian, reading, R=now.R)
