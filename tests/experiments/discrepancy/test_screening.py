"""What nuisances can take is no evidence for an effect; what they cannot take counts in full."""

import numpy as np

from experiments.discrepancy.fitting import WEIGHT, Fit
from experiments.discrepancy.screening import Projection


def _fit(jacobian: np.ndarray, residual: np.ndarray) -> Fit:
    z = np.zeros(len(jacobian))
    return Fit(z, (), residual, jacobian, jacobian, {})


def test_a_signature_along_a_nuisance_is_worth_no_more_than_its_prior():
    """However strong the data: moving a nuisance by z costs z^2 / 2 nats, so the effect cannot gain more."""
    rng = np.random.default_rng(6)
    column = 50.0 * rng.standard_normal((1, 8, 5, 2))
    frames = np.arange(8) < 6
    projection = Projection.of(_fit(column, column[0]), frames)
    own = (WEIGHT * 0.4 * column[0][frames]).ravel()
    power = float(projection.cleaned(own) @ own)
    assert 0.95 * 0.4**2 < power <= 0.4**2


def test_a_signature_across_all_nuisances_keeps_its_power():
    column = np.zeros((1, 4, 3, 2))
    column[..., 0] = 5.0
    across = np.zeros((4, 3, 2))
    across[..., 1] = 2.0
    projection = Projection.of(_fit(column, across), np.ones(4, bool))
    own = (WEIGHT * across).ravel()
    assert np.isclose(float(projection.cleaned(own) @ own), float(own @ own))
