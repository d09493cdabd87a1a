"""Candidates keep within the effects' bounds, come in sizes that are there, and know the run that they are for."""

from dataclasses import replace

import numpy as np

from experiments.discrepancy.fit.candidates import Context, candidates, in_tune
from experiments.discrepancy.fit.scores import Shares

CONTEXT = Context(
    ("bogie.acceleration_y", "bogie.rate_yaw"), (50.0, 900.0), (1.0, 30.0), ((300.0, 10.0), (600.0, 20.0))
)


def test_every_size_of_every_candidate_can_be_built_and_differs_from_absence():
    for one in candidates(CONTEXT):
        free = one.parameters
        sizes = list(one.sizes())
        assert sizes, one.label
        for values in sizes:
            effect = one.build(values)
            assert effect != one.kind.at_absent(**dict(one.choices)), one.label
            assert all(free[name].low <= value <= free[name].high for name, value in values.items()), one.label


def test_a_sensor_at_fault_is_one_of_the_recording():
    """Of a recording of one channel too, whichever it is."""
    channel = CONTEXT.channels[1]
    alone = [one for one in candidates(replace(CONTEXT, channels=(channel,))) if one.of_sensor]
    assert alone and {dict(one.choices).get("channel", channel) for one in alone} == {channel}
    assert all(getattr(one.build(next(iter(one.sizes()))), "channel", channel) == channel for one in alone)


def test_places_lie_within_the_run():
    for one in candidates(CONTEXT):
        for values in one.variants_of(next(iter(one.sizes()))):
            for name in ("place", "first"):
                if name in values:
                    assert CONTEXT.distance[0] <= values[name] <= CONTEXT.distance[1], one.label


def test_steps_of_derivatives_are_small_against_the_range():
    for one in candidates(CONTEXT):
        shares = Shares((one,))
        middle = np.full(len(shares.parameters), 0.5)
        assert np.all(np.array(shares.steps(middle)) <= 0.05), one.label


def test_a_wave_is_varied_by_less_than_a_turn_at_the_end_of_the_run():
    soft = next(one for one in candidates(CONTEXT) if one.name == "soft_track")
    for wavelength in (0.5, 3.0, 40.0):
        step = soft.step(soft.parameters["wavelength"], wavelength)
        assert 0.005 < step / wavelength**2 * CONTEXT.distance[1] / 1.0 < 0.2


def test_tones_say_wavelengths_frequencies_and_waves_a_turn():
    heard = replace(CONTEXT, tones=((10.2, 2.95), (31.8, 0.943)), wheel_radius=0.45)
    found = {one.name: one for one in in_tune(candidates(heard))}
    assert [one["wavelength"] for one in found["soft_track"].at_tones()] == [2.95, 2.95, 0.943, 0.943]
    assert {one["frequency"] for one in found["body_bending"].at_tones()} == {10.2}
    orders = {dict(one.choices).get("order", 1) for one in in_tune(candidates(heard)) if one.name == "out_of_round"}
    assert orders == {1, 3}


def test_what_has_a_place_or_a_time_begins_on_the_run():
    context = Context(("bogie.rate_yaw",), (300.0, 900.0), (2.0, 20.0), ((400.0, 5.0),))
    found = {one.name: one.parameters for one in candidates(context)}
    place, begin = found["exposed_stretch"]["place"], found["wind_gust"]["begin"]
    assert (place.low, place.high) == (300.0, 900.0)
    assert (begin.low, begin.high) == (2.0, 20.0)


def test_the_bank_holds_every_size_in_more_than_one_shape():
    """A blow-off that keeps 0.84 of its slope has next to nothing in common with one that keeps 0.1 at any velocity."""
    made = {one.name: one for one in candidates(replace(CONTEXT, tones=((1.2, 21.0),)))}
    for name in ("lateral_damper_blow_off", "yaw_damper_blow_off"):
        kept: dict[float, set[float]] = {}
        for values in made[name].banked():
            kept.setdefault(values["velocity"], set()).add(values["share"])
        assert all({0.1, 0.4, 0.7} <= shares for shares in kept.values())
    soft = made["soft_track"]
    long = {(values["wavelength"], values["variation"]) for values in soft.banked() if values["wavelength"] > 7.0}
    assert len(long) == 2 * len({wavelength for wavelength, _ in long}) > 2
    assert {values["variation"] for values in soft.at_tones()} == {0.1, 0.5}
    assert [values["share"] for values in made["secondary_asymmetry"].banked() if values["share"] == 0.7] == []


def test_what_does_nothing_until_a_threshold_is_known_by_its_numbers():
    found = {one.name for one in candidates(CONTEXT) if one.from_a_threshold}
    assert found == {"bump_stop_contact", "lateral_damper_blow_off", "yaw_damper_blow_off"}


def test_the_bank_holds_a_body_that_bends_and_is_damped():
    bending = next(one for one in candidates(CONTEXT) if one.name == "body_bending")
    assert {round(values["damping"], 3) for values in bending.banked()} == {0.02, 0.15}
