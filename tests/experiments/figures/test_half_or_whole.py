"""Half vehicle beside the whole one: errors by band, and one that follows from the body's inertia alone."""

import math

import numpy as np
import pytest

from experiments.figures.half_or_whole import (
    ERROR,
    FACTOR,
    FOUND_BEFORE,
    LOW,
    RATE,
    SIZE,
    HalfOrWhole,
    compared,
    spectra,
    vehicle,
)
from experiments.reporting.size import Size
from railsim.vehicles.running_gear import RunningGear
from railsim.vehicles.whole_vehicle import HALVED


def test_squared_amplitudes_in_a_band_add_up_to_the_mean_square_there():
    time = np.arange(round(20.0 * RATE)) / RATE
    slow, fast = 3.0 * np.sin(2.0 * np.pi * 1.5 * time), 0.5 * np.cos(2.0 * np.pi * 20.0 * time)
    frequency, (amplitudes,) = spectra([7.0 + slow + fast])
    for low, high, size in ((1.0, 2.0, 3.0), (16.0, 32.0, 0.5), (2.0, 16.0, 0.0), (0.0, 1.0, 0.0)):
        inside = (frequency > low) & (frequency <= high)
        assert np.linalg.norm(amplitudes[inside]) == pytest.approx(size / math.sqrt(2.0), abs=1e-3)


def test_half_has_all_of_the_suspension_of_the_whole_vehicle():
    whole = vehicle()
    half = whole.half()
    shared = set(RunningGear.model_fields) - set(HALVED)
    assert all(getattr(half, name) == getattr(whole, name) for name in shared)
    assert {element.name for element in whole.model().nonlinear} == {"bump_stop", "bump_stop2"}
    springs = {element.name: element for element in whole.model().elements if element.position[0] > -3.0}
    same = {element.name: element for element in half.model().elements}
    assert set(springs) == set(same) | {"yaw_dampers"}
    assert springs["yaw_dampers"].position == springs["secondary"].position
    for name, element in same.items():
        assert element.position == springs[name].position
        damping = springs[name].damping + (springs["yaw_dampers"].damping if name == "secondary" else 0.0)
        np.testing.assert_array_equal(element.stiffness[1:, 1:], springs[name].stiffness[1:, 1:])
        np.testing.assert_allclose(element.damping[1:, 1:], damping[1:, 1:], rtol=1e-12, atol=1e-6)


def test_body_above_its_modes_errs_as_its_mass_and_yaw_inertia_say():
    """Where the bogies' lateral forces F1 and F2 alone accelerate it, and alike but not together, the point over the
    leading bogie has F1 (1 / M + L² / I) + F2 (1 / M - L² / I), and of half a body 2 F1 / M.
    """
    whole = vehicle().model_copy(update={"yaw_damper_damping": 0.0})
    excess = whole.body_mass * whole.semi_bogie_spacing**2 / whole.body_yaw_inertia - 1.0
    expected = math.sqrt(2.0) * excess / math.hypot(2.0 + excess, excess)
    rows = compared(whole, "straight_erri_low", 30.0, 20.0)
    errors = [row[ERROR] for row in rows if row["channel"] == "body.y" and row[LOW] in (8.0, 16.0)]
    assert errors == pytest.approx([expected, expected], rel=0.15)


def test_small_size_has_all_columns_and_decides_no_miss():
    figure = HalfOrWhole()
    table = figure.compute(Size.SMOKE)
    assert np.isfinite(table[[ERROR, FACTOR, SIZE]].to_numpy(float)).all()
    claims = figure.check(table)
    assert len(claims) == len(FOUND_BEFORE) + 4
    assert all(claim.held is not False for claim in claims)
    assert figure.draw(table).axes
