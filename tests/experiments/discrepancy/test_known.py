"""What is known of a fitted share: against its posterior on a grid, and by how often the true share lies within."""

import math

import numpy as np
import pytest
from scipy.optimize import fminbound

from experiments.discrepancy.core.known import INTERVAL, about, within_bounds

PRIOR = (-1.0, 1.0)


def fitted(seen: float, noise: float) -> tuple[float, float]:
    """Mode of a share's logarithm and its standard deviation by first derivatives, from y = share + noise."""

    def cost(log: float) -> float:
        return 0.5 * ((seen - math.exp(log)) / noise) ** 2 + 0.5 * ((log - PRIOR[0]) / PRIOR[1]) ** 2

    log = float(np.asarray(fminbound(cost, -12.0, 0.0, xtol=1e-10)))
    return log, ((math.exp(log) / noise) ** 2 + PRIOR[1] ** -2) ** -0.5


@pytest.mark.parametrize(("seen", "noise"), [(0.0, 0.01), (0.004, 0.01), (-0.01, 0.01), (0.4, 0.05), (0.97, 0.05)])
def test_its_interval_is_that_of_the_posterior_within_0_and_1(seen: float, noise: float) -> None:
    likeliest, low, high = within_bounds(*fitted(seen, noise), *PRIOR)
    grid = np.linspace(0.0, 1.0, 200_001)
    density = np.exp(-0.5 * ((seen - grid) / noise) ** 2)
    order = np.argsort(-density, kind="stable")
    inside = grid[order[: np.searchsorted(np.cumsum(density[order]) / density.sum(), INTERVAL) + 1]]
    assert likeliest == pytest.approx(grid[order[0]], abs=0.1 * noise)
    assert (low, high) == pytest.approx((inside.min(), inside.max()), abs=0.15 * noise)


def test_nine_of_ten_true_shares_lie_within_and_a_total_loss_too() -> None:
    rng, noise = np.random.default_rng(5), 0.02
    true = rng.random(400) * 0.2
    ends = [within_bounds(*fitted(one + noise * rng.standard_normal(), noise), *PRIOR)[1:] for one in true]
    assert 0.86 < np.mean([low <= one <= high for one, (low, high) in zip(true, ends, strict=True)]) < 0.94
    lost = [within_bounds(*fitted(noise * rng.standard_normal(), noise), *PRIOR) for _ in range(200)]
    assert np.mean([low <= 0.0 for _, low, _ in lost]) > 0.9


def test_a_number_has_its_interval_to_both_sides() -> None:
    value, low, high = about(3.0, 0.5)
    assert value == 3.0 and high - value == pytest.approx(value - low) == pytest.approx(1.644854 * 0.5, rel=1e-6)
