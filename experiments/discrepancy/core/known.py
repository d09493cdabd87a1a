"""What is known of a number that was fitted: the likeliest value, and the ends of its interval.

A share from 0 to 1 is fitted by its logarithm, which is never that of 0, and the normal density about it leaves 0 out
though the share may well be lost whole. What is observed is nearly linear in the share itself. So the likelihood is
taken as normal there: the posterior of the logarithm without its prior, by the slope of the share. The posterior is
that density within 0 and 1, under a uniform prior; the interval holds the likeliest values.
"""

import math

from scipy.optimize import root_scalar
from scipy.stats import norm

INTERVAL = 0.9  # probability that an interval holds the true value
Known = tuple[float, float, float]
"""A number and the ends of its interval."""
LEAST = 1e-6  # of the prior's precision: what the likelihood has of its own, at least


def about(value: float, spread: float) -> Known:
    """The ends to both sides of a number with a normal density."""
    reach = float(norm.ppf(0.5 + 0.5 * INTERVAL)) * spread
    return float(value), float(value - reach), float(value + reach)


def within_bounds(log: float, spread: float, mean: float, deviation: float) -> Known:
    """The likeliest share and the ends of its interval.

    Parameters
    ----------
    log, spread : posterior mode of the share's logarithm and its standard deviation. mean, deviation : of the
    logarithm's normal prior.
    """
    prior, share = deviation**-2, math.exp(min(log, 0.0))
    precision = max(spread**-2 - prior, LEAST * prior)
    middle = share * (1.0 + (log - mean) * prior / precision)
    width = share / math.sqrt(precision)

    def held(reach: float) -> float:
        low, high = norm.cdf([max(0.0, middle - reach), min(1.0, middle + reach)], middle, width)
        return float(high - low)

    likeliest = min(max(middle, 0.0), 1.0)
    ends = [abs(likeliest - middle), max(abs(middle), abs(1.0 - middle))]
    reach = float(root_scalar(lambda tried: held(tried) - INTERVAL * held(ends[1]), bracket=ends).root)
    return likeliest, max(0.0, middle - reach), min(1.0, middle + reach)
