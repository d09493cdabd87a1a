"""Numbers of a data sheet, and what is taken where it states nothing."""

from typing import Any

import numpy as np
import pytest

from railsim.data_sheet import DataSheet, channels_on, data_sheet
from railsim.measurements import Measurements

NAME = "mine.rate_yaw [rad/s]"


def stated(**errors: Any) -> DataSheet:
    """A data sheet with these errors."""
    return DataSheet({"errors": errors})


def test_nothing_stated_is_no_error_no_delay_and_the_middle_of_the_body():
    empty = data_sheet({"sensors": [{"name": "other", "channels": ["other.speed [m/s]"]}]}, NAME)
    assert empty.error("bias_std") == empty.delay == empty.density(256.0) == empty.variance(256.0) == 0.0
    assert empty.position == (0.0, 0.0, 0.0)
    assert np.array_equal(empty.low_pass(np.array([0.0, 10.0])), [1.0, 1.0])


def test_an_error_without_a_number_takes_the_default():
    sheet = stated(bandwidth=None, bias_correlation_time=30.0)
    assert not sheet.states("bandwidth")
    assert sheet.delay == 0.0
    assert sheet.error("bias_correlation_time", 100.0) == 30.0
    assert sheet.error("noise_density", 2.0) == 2.0


def test_noise_of_samples_and_its_density_agree():
    """White noise of density d has the variance d^2 rate / 2; rounding to steps q the variance q^2 / 12."""
    sheet = stated(noise_density=3e-3, resolution=0.04)
    assert sheet.variance(128.0) == pytest.approx(9e-6 * 64.0 + 0.0016 / 12.0, rel=1e-12)
    assert sheet.density(128.0) ** 2 * 64.0 == pytest.approx(sheet.variance(128.0), rel=1e-12)


@pytest.mark.parametrize("order", [1, 2, 4])
def test_delay_is_the_slope_of_the_phase_at_low_frequency(order: int):
    sheet = stated(bandwidth=40.0, bandwidth_order=order, latency=0.01)
    omega = np.array([0.01])
    phase = float(np.angle(sheet.low_pass(omega))[0])
    assert sheet.delay == pytest.approx(0.01 - phase / 0.01, rel=1e-6)


def test_channels_on_a_body_go_by_the_data_sheet_and_else_by_the_name():
    tables = {64.0: {"time [s]": np.arange(3) / 64.0, NAME: np.zeros(3), "bogie.rate_yaw [rad/s]": np.zeros(3)}}
    sheet = {"name": "mine", "body": "bogie", "channels": [NAME]}
    measured = Measurements({"origin": "test", "vehicle": {}, "sensors": [sheet]}, tables)
    assert channels_on(measured, "bogie", "rate_yaw") == [NAME, "bogie.rate_yaw [rad/s]"]
    assert channels_on(measured, "mine", "rate_yaw") == []
    assert channels_on(measured, "bogie", "rate_roll") == []
