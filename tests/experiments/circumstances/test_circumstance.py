"""Circumstances as data: every shipped one can be run, and a wrong entry is told in one line."""

from pathlib import Path

import numpy as np
import pytest

from experiments.circumstances.circumstance import HOME, Circumstance, Line, chosen, read_circumstances
from railsim.errors import InputError

SHIPPED = read_circumstances()


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_circumstance_has_a_scenario(name: str, tmp_path: Path) -> None:
    scenario = SHIPPED[name].scenario(name, tmp_path, fast=True)
    assert scenario.setup.model.bodies
    assert {sensor.name for sensor in scenario.sensors}.isdisjoint(SHIPPED[name].lost)


def test_the_matrix_is_on_the_whole_vehicle_wherever_there_is_one() -> None:
    whole = [one for one in SHIPPED.values() if one.base == "whole"]
    assert len(whole) >= 45
    assert {one.group for one in whole} == {one.group for one in SHIPPED.values()}
    assert {one.base for one in SHIPPED.values() if one.group == HOME} == {"whole", "half", "wheelset"}


def test_no_two_circumstances_share_a_recording() -> None:
    digests = {one.digest() for one in SHIPPED.values()} | {one.digest(fast=True) for one in SHIPPED.values()}
    assert len(digests) == 2 * len(SHIPPED)


def test_words_do_not_change_a_recording() -> None:
    one = SHIPPED["payload_25"]
    assert one.but(what="something else").digest() == one.digest()
    assert one.but(noise=1.5).digest() != one.digest()


def test_a_line_through_a_curve() -> None:
    track = Line(seed=3, radius=-500.0, cant=-0.1).track()
    middle = track.at(np.array([100.0, 1000.0]))
    assert middle.curvature == pytest.approx([0.0, -1.0 / 500.0], abs=1e-12)
    assert middle.cant == pytest.approx([0.0, -0.1], abs=1e-9)
    again, rougher = Line(seed=3).track(), Line(seed=3, roughness=2.0).track()
    places = np.linspace(100.0, 1900.0, 500)
    assert 2.0 * again.at(places).vertical == pytest.approx(rougher.at(places).vertical, abs=1e-7)


def test_lost_sensors_rate_and_noise(tmp_path: Path) -> None:
    changed = Circumstance(what="test", group="sensors", rate=128.0, lost=("gnss", "bogie2"), noise=2.0)
    scenario = changed.scenario("test", tmp_path)
    assert {"gnss", "bogie2"}.isdisjoint(sensor.name for sensor in scenario.sensors)
    assert {sensor.rate for sensor in scenario.sensors} == {64.0, 128.0, 1024.0}
    slow = [sensor for sensor in scenario.sensors if sensor.rate == 128.0]
    assert all((sensor.errors.bandwidth or 1e9) <= 52.0 for sensor in slow)
    real = changed.real_sensors(scenario.sensors)
    assert [one.errors.noise_density for one in real] == [2.0 * one.errors.noise_density for one in scenario.sensors]


def test_chosen_by_name_and_group() -> None:
    assert list(chosen(SHIPPED, ["wet", "home"])) == ["home", "half_home", "wheelset_home", "wet"]
    assert list(chosen(SHIPPED, [])) == list(SHIPPED)
    with pytest.raises(InputError, match="unknown circumstance 'wett'.*'wet'"):
        chosen(SHIPPED, ["wett"])


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("wet: {group: adhesion}", "wet.what: missing"),
        ("wet: {what: wet, group: adhesion, bass: half}", "wet.bass: unknown key"),
        ("wet: {what: wet, group: adhesion, base: quarter}", "unknown wet.base 'quarter'"),
        ("off: {what: wet, group: adhesion}", "put off, on, yes and no in quotes"),
        ("- wet", "must hold circumstances by name"),
        ("wet: {what: wet, group: adhesion, line: {seed: 1, spectrum: rough}}", "unknown track spectrum 'rough'"),
        (
            "wet: {what: wet, group: adhesion, set: {vehicle.wheels: 3}}",
            "circumstance 'wet': vehicle.wheels: unknown key",
        ),
        ("wet: {what: wet, group: adhesion, line: {seed: 1, radius: 400, length: 300}}", "piece 3 is"),
    ],
)
def test_a_wrong_entry_is_told_in_one_line(text: str, line: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=".") as raised:
        for name, one in read_circumstances(path).items():
            one.scenario(name, tmp_path)
    assert line in str(raised.value)
    assert "\n" not in str(raised.value)
