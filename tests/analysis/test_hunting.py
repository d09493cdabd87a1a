"""Hunting: limit cycles of ramps, their amplitude, end, mirror image, and the wheelset's linear critical speed."""

import numpy as np
import pytest

from railsim.analysis.hunting import FASTEST_RUN, Ramp, decreasing_speed, growth_rate, hunting, small_motion_speed
from railsim.analysis.linear import critical_speed
from railsim.contact.functions import AXIS_A, AXIS_B, C11, C22, C23
from railsim.contact.pairs import WheelRailPair
from railsim.contact.polach import SHEAR
from railsim.errors import InputError
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.manchester import Manchester
from railsim.vehicles.wheelset import WheelsetVehicle
from railsim.wheelset import WheelsetParameters
from railsim.wheelset import critical_speed as critical_speed_of_the_paper

STEEP = WheelRailPair(conicity=0.4)
MODEL = Manchester(pair=STEEP).model()
CLEARANCE = STEEP.flange_clearance


@pytest.fixture(scope="module")
def ramp() -> Ramp:
    return decreasing_speed(MODEL, 58.0, ((45.0, 0.5),))


def test_cycle_goes_from_flange_to_flange_and_shrinks_with_the_speed(ramp: Ramp) -> None:
    assert 0.7 * CLEARANCE < ramp.amplitude.max() < CLEARANCE + STEEP.flange_width
    alive = ramp.amplitude[7:][ramp.amplitude[7:] > 0.5 * CLEARANCE]
    assert len(alive) > 10
    assert (np.diff(alive[2:]) <= 1e-5).all()


def test_cycle_outlives_the_growth_of_small_motions(ramp: Ramp) -> None:
    """Subcritical: between both speeds a small disturbance decays and a large one does not."""
    assert ramp.end is not None
    speed = ramp.end + 1.5
    assert growth_rate(MODEL, speed) < 0.0
    found = hunting(MODEL)
    assert found.small_motion is not None and found.nonlinear is not None
    assert ramp.end - 0.5 < found.nonlinear < found.small_motion


def test_end_hardly_depends_on_the_rate_of_the_ramp() -> None:
    ends = [decreasing_speed(MODEL, 55.0, ((51.0, 0.5), (46.5, rate))).end for rate in (0.2, 0.1)]
    assert None not in ends
    assert ends[0] == pytest.approx(ends[1], rel=0.015)


def test_mirrored_start_gives_the_mirrored_cycle() -> None:
    left, right = (decreasing_speed(MODEL, 56.0, ((53.0, 1.0),), throw) for throw in (3e-3, -3e-3))
    assert left.amplitude == pytest.approx(right.amplitude, rel=1e-6, abs=1e-9)


def test_both_engines_have_the_same_cycle() -> None:
    first, second = (decreasing_speed(MODEL, 55.0, ((44.5, 1.5),), engine=name) for name in ("compiled", "exudyn"))
    assert first.end is not None and second.end is not None
    assert first.end == pytest.approx(second.end, rel=5e-3)
    assert first.amplitude[3:11] == pytest.approx(second.amplitude[3:11], rel=0.01)


def test_nothing_grows_below_the_fastest_speed() -> None:
    vehicle = WheelsetVehicle(pair=WheelRailPair(conicity=0.05))
    found = hunting(vehicle.model())
    assert (found.matrices, found.small_motion, found.nonlinear) == (None, None, None)
    assert small_motion_speed(vehicle.model(), 60.0, FASTEST_RUN) is None


def test_speed_must_fall() -> None:
    with pytest.raises(InputError, match="let it fall"):
        decreasing_speed(MODEL, 50.0, ((60.0, 0.5),))


@pytest.mark.parametrize("conicity", [0.1, 0.2])
def test_wheelset_has_the_critical_speed_of_the_paper(conicity: float) -> None:
    """Ward et al. 2011, (16) and (17), for a cone with Kalker's coefficients of its ellipse and friction so high that
    spin leaves the creep forces linear.
    """
    kalker = Adhesion(friction=1.0, friction_ratio=1.0, k_adhesion=1.0, k_slip=1.0)
    vehicle = WheelsetVehicle(pair=WheelRailPair(kind="conical", conicity=conicity), adhesion=kalker)
    model = vehicle.model()
    row = model.contact.coefficients[0, model.contact.coefficients.shape[1] // 2, :, 0]
    scale = vehicle.wheel_load ** (1.0 / 3.0)
    a, b = row[AXIS_A] * scale, row[AXIS_B] * scale
    parameters = WheelsetParameters(
        load=2.0 * vehicle.wheel_load,
        longitudinal_creep=SHEAR * a * b * row[C11],
        lateral_creep=SHEAR * a * b * row[C22],
        lateral_spin_creep=SHEAR * (a * b) ** 1.5 * row[C23],
        spin_creep=0.0,
    )
    paper = critical_speed_of_the_paper(parameters, conicity)
    assert paper is not None
    assert critical_speed(model, 10.0, FASTEST_RUN) == pytest.approx(paper, rel=0.05)
