"""Short recordings of shipped scenarios, made once a process: what estimators and scorers are tried on."""

from collections.abc import Iterator
from functools import cache

from estimators.interface import Estimate, Estimator
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.recording import Recording
from railsim.scenario import load_scenario, shipped_scenarios
from railsim.simulation import measure, simulate
from railsim.truth import Truth

LENGTHS = (5.0, 10.0, 20.0, 40.0)  # s; what needs a longer record gets the next


@cache
def recording(name: str, seconds: float) -> Recording:
    """What the sensors of a shipped scenario give of its first seconds."""
    full = load_scenario(name)
    scenario = full.but(duration=min(seconds, full.duration))
    return measure(simulate(scenario, "compiled"), scenario)


@cache
def channels_by_scenario() -> dict[str, frozenset[str]]:
    """Channels of each shipped scenario, those with most of them first."""
    sensors = {name: load_scenario(name).sensors for name in shipped_scenarios()}
    channels = {name: frozenset(c for sensor in suite for c in sensor.channels()) for name, suite in sensors.items()}
    return dict(sorted(channels.items(), key=lambda one: -len(one[1])))


def fitting(estimator: Estimator) -> Iterator[tuple[Measurements, Truth]]:
    """Recordings that the estimator fits, short ones first."""
    names = [name for name, channels in channels_by_scenario().items() if set(estimator.needed()) <= channels]
    for seconds in LENGTHS:
        for name in names:
            made = recording(name, seconds)
            if estimator.fits(made.measurements) and made.truth is not None:
                yield made.measurements, made.truth


def first_estimate(estimator: Estimator) -> tuple[Measurements, Truth, Estimate]:
    """The first recording that the estimator answers with a row at least, and its answer.

    Raises
    ------
    InputError : there is none.
    """
    reason = "it fits no shipped recording: none has all that it needs"
    for number, (measured, truth) in enumerate(fitting(estimator)):
        try:
            estimate = estimator.estimate(measured)
        except InputError as error:
            reason = reason if number else f"it refuses every shipped recording that it fits; the first with: {error}"
        else:
            if len(estimate.series):
                return measured, truth, estimate
            reason = reason if number else "it gives no row for any shipped recording"
    raise InputError(reason)
