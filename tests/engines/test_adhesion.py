"""Creep laws and friction along the track in whole runs of both engines."""

import numpy as np
import pytest

from railsim.engines.interface import STABLE, creep_rate, default_substeps
from railsim.speed import Constant, Traction, speed_tables
from railsim.track import Track, read_track
from railsim.vehicles.adhesion import Adhesion
from railsim.vehicles.manchester import Manchester
from tests.engines.rig import ENGINES, RATE, flat, go, make_run, ratio

CHANNELS = [f"{body}.{q}" for body in ("wheelset1", "wheelset2", "bogie") for q in ("y [m]", "yaw [rad]")]
BETTER, WORSE, CHANGE = 0.4, 0.05, 60.0  # friction before and after the place [m]


@pytest.mark.parametrize("law", ["fastsim", "linear"])
def test_engines_agree_with_every_creep_law(law: str) -> None:
    """And the default step is fine enough for it."""
    model, track = Manchester(adhesion=Adhesion.build({"law": law})).model(), read_track("straight_erri_high")
    fast = go("compiled", make_run(model, track, 50.0, 0.75))
    halved = go("compiled", make_run(model, track, 50.0, 0.75, finer=2))
    reference = go("exudyn", make_run(model, track, 50.0, 0.75))
    for name in CHANNELS:
        assert ratio(reference[name], fast[name]) < 5e-3, name
        assert ratio(halved[name], fast[name]) < 1e-3, name


def test_fastsim_and_polach_give_nearly_the_same_ride() -> None:
    """Two laws that agree within some per cent of mu N: in a curve, where creep forces are large, a few per cent of
    the motion; not nothing, or the setting does not act.
    """
    track = read_track("curve_r400")
    rides = [
        go(
            "compiled",
            make_run(Manchester(adhesion=Adhesion.build({"law": law})).model(), track, 14.0, 10.0, start=60.0),
        )
        for law in ("fastsim", "polach")
    ]
    for name in CHANNELS:
        assert 1e-3 < ratio(rides[0][name], rides[1][name]) < 0.1, name


@pytest.mark.parametrize("law", ["polach", "fastsim", "linear"])
def test_slope_that_the_step_is_chosen_by_is_that_of_the_law(law: str) -> None:
    """Creep rate of a condition: (kA + kS) / 2 of Kalker's, for all laws the same."""
    rates = [
        creep_rate(Manchester(adhesion=Adhesion.build({"law": law, "k_adhesion": k, "k_slip": k})).model(), 5.0)
        for k in (1.0, 0.5)
    ]
    assert rates[1] == pytest.approx(0.5 * rates[0], rel=1e-12)
    model = Manchester(adhesion=Adhesion.build({"law": law})).model()
    tables = speed_tables(Constant(speed=5.0), (), 2, 1.0)
    substeps = default_substeps(model, tables, RATE)
    assert creep_rate(model, 5.0) / (RATE * substeps) <= STABLE < creep_rate(model, 5.0) / (RATE * substeps / 2)
    calm = go("compiled", make_run(model, flat(), 5.0, 2.0))
    assert np.abs(calm["wheelset1.yaw [rad]"]).max() < 1e-10


@pytest.mark.parametrize("engine", ENGINES)
def test_friction_of_the_track_acts_under_each_wheelset_at_its_own_place(engine: str) -> None:
    s = np.arange(0.0, 200.0, 0.2)
    friction = np.where(s < CHANGE, BETTER, WORSE)
    track = Track(s, {"friction": friction}, "leaves")
    model = Manchester(adhesion=Adhesion(friction=0.2, friction_ratio=1.0)).model()
    result = go(engine, make_run(model, track, 20.0, 3.0))
    for i, ahead in ((1, 1.28), (2, -1.28)):
        under = result["s [m]"] + ahead
        for side in ("left", "right"):
            found = result[f"wheel{i}_{side}.friction [-]"]
            assert found[under < CHANGE - 1.0] == pytest.approx(BETTER, rel=1e-6)
            assert found[under > CHANGE + 1.0] == pytest.approx(WORSE, rel=1e-6)


def test_track_friction_replaces_that_of_the_vehicle_and_still_falls_with_slip() -> None:
    s = np.arange(0.0, 200.0, 5.0)
    track = Track(s, {"friction": np.full(s.size, 0.1)}, "damp")
    model = Manchester(adhesion=Adhesion(friction=0.4, friction_ratio=0.4, friction_decay=0.6)).model()
    slide = Traction(wheelset=1, time=(0.0, 0.5, 2.0), slip=(0.0, 0.1, 0.1))
    result = go("compiled", make_run(model, track, 10.0, 2.0, traction=[slide]))
    slip = 10.0 * np.hypot(result["wheel1_left.creepage_x [-]"], result["wheel1_left.creepage_y [-]"])
    expected = 0.1 * (0.6 * np.exp(-0.6 * slip) + 0.4)
    assert result["wheel1_left.friction [-]"] == pytest.approx(expected, rel=1e-3)
    assert expected.min() < 0.08
