"""Targets, intervals and the three outcomes of a claim."""

import math

import numpy as np
import pytest
from scipy.stats import binomtest

from experiments.reporting import intervals
from experiments.reporting.claims import (
    Claim,
    Target,
    above,
    at_least,
    at_most,
    below,
    between,
    exactly,
    near,
)
from experiments.reporting.intervals import Interval


@pytest.mark.parametrize(
    ("target", "text", "inside", "outside"),
    [
        (at_most(0.2, "mm"), "<= 0.2 mm", 0.2, 0.21),
        (at_least(0.5, meaning="lost"), ">= 0.5: lost", 0.5, 0.49),
        (above(1.0), "> 1", 1.01, 1.0),
        (below(0.0, "km/h"), "< 0 km/h", -0.1, 0.0),
        (between(0.9, 0.97), "0.9 to 0.97", 0.97, 0.98),
        (exactly(0.0), "0", 0.0, 1.0),
        (near(0.18, 0.005, "m/s2"), "0.18 ± 0.005 m/s2", 0.178, 0.186),
    ],
)
def test_target_holds_its_ends_and_says_so(target: Target, text: str, inside: float, outside: float):
    assert str(target) == text
    assert inside in target
    assert outside not in target
    assert math.nan not in target


@pytest.mark.parametrize(
    ("low", "high", "held"),
    [(0.91, 0.96, True), (0.80, 0.89, False), (0.98, 0.99, False), (0.85, 0.95, None), (0.5, 1.0, None)],
)
def test_outcome_is_that_of_the_whole_interval_or_undecided(low: float, high: float, held: bool | None):
    claim = Claim.sampled("coverage", 0.5 * (low + high), between(0.90, 0.97), Interval(low, high, 20))
    assert (claim.held, claim.low, claim.high, claim.cases) == (held, low, high, 20)


def test_unbounded_interval_is_undecided_and_has_no_ends_in_json():
    claim = Claim.sampled("rms", 0.01, at_most(0.05), intervals.unbounded(1))
    assert (claim.held, claim.low, claim.high, claim.outcome) == (None, None, None, "undecided")


def test_interval_without_an_upper_end_bears_out_a_target_without_one():
    assert Claim.sampled("ratio", 3.0, at_least(1.0), Interval(1.2, math.inf, 9)).held is True
    assert Claim.sampled("ratio", 3.0, above(1.0), Interval(1.0, math.inf, 9)).held is None


def test_definite_value_is_held_or_not_and_of_too_little_undecided():
    assert Claim.definite("yaw", 0.077, near(0.077, 0.001)).held is True
    assert Claim.definite("yaw", 0.09, near(0.077, 0.001)).held is False
    assert Claim.definite("yaw", 0.09, near(0.077, 0.001), enough=False).held is None
    assert Claim.definite("yaw", 0.077, near(0.077, 0.001), enough=False).held is True


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
def test_value_that_could_not_be_found_is_not_held_and_null(value: float | None):
    claim = Claim.definite("delay", value, at_most(60.0, "s"))
    assert (claim.value, claim.held) == (None, False)


def test_interval_of_a_share_is_that_of_clopper_and_pearson():
    """Twenty of twenty: lower end 0.025^(1/20), by hand."""
    found = intervals.of_share(np.ones(20, dtype=bool))
    assert found == (pytest.approx(0.025 ** (1 / 20)), 1.0, 20)
    half = intervals.of_share(np.arange(10) < 5)
    assert half[:2] == tuple(binomtest(5, 10).proportion_ci(method="exact"))


def covered(interval_of, true: float, cases: int, tries: int = 400) -> float:
    """Share of samples of normal numbers of mean 1 and deviation 1 whose interval has the true value."""
    rng = np.random.default_rng(cases)
    found = [interval_of(1.0 + rng.standard_normal(cases)) for _ in range(tries)]
    return float(np.mean([one.low <= true <= one.high for one in found]))


@pytest.mark.parametrize(
    ("interval_of", "true"),
    [(intervals.of_mean, 1.0), (intervals.of_median, 1.0), (intervals.of_deviation, 1.0)],
)
@pytest.mark.parametrize("cases", [3, 20])
def test_intervals_cover_the_true_value_in_95_percent_of_samples(interval_of, true: float, cases: int):
    assert covered(interval_of, true, cases) >= 0.92


def test_interval_of_a_root_mean_square_covers_it_and_is_exact_without_offset():
    assert covered(intervals.of_rms, math.sqrt(2.0), 5) >= 0.95
    assert covered(lambda values: intervals.of_rms(values - 1.0), 1.0, 5) == pytest.approx(0.95, abs=0.03)


def test_resampling_covers_a_ratio_of_root_mean_squares_of_the_same_cases():
    rng = np.random.default_rng(4)
    hits = 0
    for _ in range(60):
        one, other = rng.standard_normal((2, 20)) * ((2.0,), (1.0,))
        found = intervals.of_statistic(lambda c, a=one, b=other: float(np.std(a[c]) / np.std(b[c])), 20)
        hits += found.low <= 2.0 <= found.high
    assert hits / 60 > 0.85


def test_resampling_gives_the_same_twice_and_nothing_of_few_cases():
    values = np.random.default_rng(5).standard_normal(12)
    first, second = (intervals.of_statistic(lambda c: float(np.max(values[c])), 12) for _ in range(2))
    assert first == second
    assert intervals.of_statistic(lambda c: float(np.max(values[c])), 9) == intervals.unbounded(9)


def test_weighted_mean_is_that_of_cases_of_different_size():
    """Doubling the weights changes nothing; equal weights give Student's interval."""
    shares, weights = np.array([0.9, 0.95, 1.0, 0.97]), np.array([10, 20, 5, 40])
    assert intervals.of_mean(shares, 2 * weights) == pytest.approx(intervals.of_mean(shares, weights))
    assert intervals.of_mean(shares, np.full(4, 7)) == pytest.approx(intervals.of_mean(shares))


def test_shares_that_are_all_one_are_as_uncertain_as_hits():
    assert intervals.of_mean_share(np.ones(10)) == intervals.of_share(np.ones(10, dtype=bool))
    low, high, _ = intervals.of_mean_share(np.array([0.7, 0.99, 1.0]))
    assert (low >= 0.0, high) == (True, 1.0)


def test_worst_of_several_is_bounded_by_the_worst_ends():
    parts = [Interval(0.8, 0.9, 5), Interval(0.7, 0.95, 4)]
    assert intervals.least(parts) == (0.7, 0.9, 4)
    assert intervals.largest(parts) == (0.8, 0.95, 4)


def test_size_of_a_number_whose_sign_is_open_may_be_nothing():
    assert intervals.of_size(Interval(-0.02, 0.01, 3)) == (0.0, 0.02, 3)
    assert intervals.of_size(Interval(-0.02, -0.01, 3)) == (0.01, 0.02, 3)
