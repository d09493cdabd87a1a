"""What values say of themselves, in a line and in a notebook."""

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from railsim import InputError, load_scenario
from railsim.measurements import Measurements
from railsim.truth import HeldTruth

ABOUT = {"origin": "a <test>", "vehicle": {}, "sensors": []}


@pytest.fixture
def measured() -> Measurements:
    """Two rates; one sample is lost."""
    fast = pd.DataFrame({"time [s]": np.arange(5) / 4.0, "a.speed [m/s]": [1.0, 2.0, np.nan, 4.0, 5.0]})
    slow = pd.DataFrame({"time [s]": [0.0, 1.0], "b.speed [m/s]": [1.0, 2.0]})
    return Measurements(ABOUT, {4.0: fast, 1.0: slow})


def test_measurements(measured: Measurements):
    assert repr(measured) == "<Measurements of 'a <test>': 2 channels at 1, 4 Hz, 0 to 1 s>"
    page = measured._repr_html_()
    assert "a &lt;test&gt;" in page and "<test>" not in page
    assert "<td>a.speed [m/s]</td><td>4</td><td>5</td><td>1</td>" in page


def test_frames_go_in_and_out(measured: Measurements):
    frames = {rate: measured.frame(rate) for rate in measured.rates}
    again = Measurements(ABOUT, frames)
    assert list(again) == list(measured)
    assert all(np.array_equal(again[name], measured[name], equal_nan=True) for name in measured)
    with pytest.raises(InputError, match="there are 1, 4 Hz"):
        measured.frame(3.0)


def test_truth():
    truth = HeldTruth(np.zeros((2, 3)), 2.0, ["time [s]", "body.roll [rad]"], {})
    assert repr(truth) == "<HeldTruth in 'memory': 2 channels at 2 Hz, 1 s>"
    assert "<td>body.roll</td><td>rad</td>" in truth._repr_html_()


def test_estimate():
    estimate = Estimate("mine", pd.DataFrame({"time [s]": [0.0, 1.0, 2.0], "x [m]": [1.0, np.nan, 3.0]}))
    assert repr(estimate) == "<Estimate of mine: 3 rows of time [s], x [m]>"
    assert "<td>x [m]</td><td>1</td><td>2</td><td>3</td><td>1</td>" in estimate._repr_html_()


def test_scenario():
    page = load_scenario("default")._repr_html_()
    assert all(text in page for text in ("class175", "60 s", "gnss (gnss, 8 Hz)"))
