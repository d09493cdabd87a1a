"""Steps of Kalman filters as compiled kernels, for long records; a short one takes filterpy's filters.

The filters differ in how they predict. What all share is the update by one measured number at a time, which inverts no
matrix: with z = h' x + noise of variance R, error e = z - h' x and its variance S = h' P h + R,

    x = x + P h e / S,   P = P - P h h' P / S.
"""

import numpy as np

from railsim.compiled import inlined


@inlined
def dot(one, other):
    """Sum of products of two short rows, (n,) each."""
    total = 0.0
    for i in range(len(one)):
        total += one[i] * other[i]
    return total


@inlined
def multiply(M, x, out):
    """out = M x, shapes (m, n), (n,), (m,); for a few dozen entries a call of BLAS costs more than that."""
    for i in range(M.shape[0]):
        total = 0.0
        for j in range(M.shape[1]):
            total += M[i, j] * x[j]
        out[i] = total


@inlined
def project(P, h, gain):
    """gain = P h, shapes (n, n), (n,), (n,); return h' P h."""
    n = len(h)
    total = 0.0
    for i in range(n):
        part = 0.0
        for j in range(n):
            part += P[i, j] * h[j]
        gain[i] = part
        total += h[i] * part
    return total


@inlined
def correct(x, P, gain, S, error):
    """Take one measured number into mean x (n,) and covariance P (n, n), which stays symmetric to the last digit.

    Parameters
    ----------
    gain : P h, (n,); what is left in it is the Kalman gain P h / S.
    S : variance of the innovation. error : the innovation.
    """
    n = len(gain)
    root = np.sqrt(S)
    for i in range(n):
        gain[i] /= root
    share = error / root
    for i in range(n):
        x[i] += gain[i] * share
        for j in range(n):
            P[i, j] -= gain[i] * gain[j]
    for i in range(n):
        gain[i] /= root


@inlined
def move(P, F, A):
    """P = F P F' for square matrices; A is scratch of their shape, and rows of F may be sparse."""
    n = len(F)
    for i in range(n):
        for j in range(n):
            A[i, j] = 0.0
        for m in range(n):
            factor = F[i, m]
            if factor != 0.0:
                for j in range(n):
                    A[i, j] += factor * P[m, j]
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for m in range(n):
                total += A[i, m] * F[j, m]
            P[i, j] = P[j, i] = total
