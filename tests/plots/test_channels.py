"""Pictures of measured and true channels: which, in what units, of which times."""

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from railsim import InputError
from railsim.measurements import Measurements
from railsim.plots.channels import groups, labels
from railsim.plots.style import MOST_PANELS, Picture
from railsim.truth import HeldTruth

TIME = np.arange(8) / 4.0
ABOUT = {"origin": "a test", "vehicle": {}, "sensors": []}


@pytest.fixture
def measured() -> Measurements:
    """A rate of 4 Hz with a lost sample, one of 1 Hz."""
    rate = np.array([0.0, 0.1, np.nan, 0.3, 0.4, 0.5, 0.6, 0.7])
    fast = {"time [s]": TIME, "bogie.rate_pitch [rad/s]": rate, "bogie.rate_yaw [rad/s]": -rate}
    slow = {"time [s]": [0.0, 1.0], "gnss.speed [m/s]": [10.0, 20.0]}
    return Measurements(ABOUT, {4.0: pd.DataFrame(fast), 1.0: pd.DataFrame(slow)})


def drawn(picture: Picture, panel: int, line: int) -> np.ndarray:
    """Times and values of a line, shape (2, n)."""
    return np.asarray(picture.axes[panel].lines[line].get_xydata(), dtype=float).T


def test_channels_of_one_sensor_and_unit_share_a_panel():
    names = ["axlebox1_left.acceleration_z [m/s2]", "axlebox2_right.acceleration_z [m/s2]", "wheelset1.y [m]"]
    names += ["wheelset2.y [m]", "wheelset1.yaw [rad]"]
    assert [(group.words, group.unit, len(group.names)) for group in groups(names)] == [
        ("axlebox acceleration", "m/s2", 2),
        ("wheelset y", "m", 2),
        ("wheelset yaw", "rad", 1),
    ]


def test_lines_of_a_panel_are_named_by_what_tells_them_apart():
    assert labels(["wheelset1.y [m]", "wheelset2.y [m]"]) == ["wheelset1", "wheelset2"]
    assert labels(["bogie.rate_roll [rad/s]", "bogie.rate_yaw [rad/s]"]) == ["rate_roll", "rate_yaw"]
    assert labels(["speed [m/s]"]) == ["speed"]


def test_large_values_stay_in_si_units():
    names = ["time [s]", "wheelset1.y [m]", "gnss.position_east [m]"]
    truth = HeldTruth(np.array([TIME, 1e-3 * TIME, 1e3 * TIME]), 4.0, names, {})
    assert [panel.get_ylabel() for panel in truth.plot("*.*").axes] == ["wheelset y\n[mm]", "gnss position\n[m]"]


def test_measured_channels_are_drawn_in_units_of_pictures_with_their_gaps(measured: Measurements):
    picture = measured.plot()
    assert [panel.get_ylabel() for panel in picture.axes] == ["gnss speed\n[km/h]", "bogie rate\n[°/s]"]
    assert drawn(picture, 0, 0) == pytest.approx(np.array([[0.0, 1.0], [36.0, 72.0]]))
    rate = drawn(picture, 1, 0)
    assert rate[0] == pytest.approx(TIME)
    assert rate[1] == pytest.approx(np.degrees(measured["bogie.rate_pitch [rad/s]"]), nan_ok=True)
    assert picture.get_suptitle() == "a test"


def test_what_is_named_is_drawn_of_the_times_that_are_asked_for(measured: Measurements):
    picture = measured.plot("bogie.rate_y*", begin=0.5, end=1.5)
    assert len(picture.axes) == 1 and len(picture.axes[0].lines) == 1
    assert drawn(picture, 0, 0)[0] == pytest.approx([0.5, 0.75, 1.0, 1.25])
    assert len(measured.plot("gnss.speed [m/s]").axes) == 1


def test_a_name_that_fits_nothing_is_one_line(measured: Measurements):
    with pytest.raises(InputError, match="no channel fits 'bogie.rate_pich'; .*bogie.rate_pitch"):
        measured.plot("bogie.rate_pich")


def test_what_does_not_fit_is_named():
    columns = {f"s{number}.q{chr(97 + number)} [-]": TIME for number in range(MOST_PANELS + 1)}
    many = Measurements(ABOUT, {4.0: pd.DataFrame({"time [s]": TIME, **columns})})
    picture = many.plot()
    assert len(picture.axes) == MOST_PANELS
    assert f"not drawn: s{MOST_PANELS}." in picture.get_suptitle()


def test_truth_over_time_and_distance():
    names = ["time [s]", "s [m]", "speed [m/s]", "wheelset1.y [m]", "wheel1_left.normal_force [N]"]
    truth = HeldTruth(np.array([TIME, 20.0 * TIME, 0 * TIME + 20.0, 1e-3 * TIME, 0 * TIME + 5e4]), 4.0, names, {})
    picture = truth.plot()
    assert [panel.get_ylabel() for panel in picture.axes] == ["speed\n[km/h]", "wheelset y\n[mm]"]
    assert picture.axes[-1].get_xlabel() == "time [s]"
    force = truth.plot("wheel1_left.*", begin=1.0, over="s [m]")
    assert drawn(force, 0, 0) == pytest.approx(np.array([20.0 * TIME[4:], np.full(4, 50.0)]))
    assert force.axes[0].get_xlabel() == "distance [m]"


def test_pictures_show_themselves_in_notebooks(measured: Measurements):
    estimate = Estimate("mine", pd.DataFrame({"time [s]": TIME, "x [m]": TIME}))
    for picture in (measured.plot(), estimate.plot()):
        assert picture._repr_png_().startswith(b"\x89PNG")
