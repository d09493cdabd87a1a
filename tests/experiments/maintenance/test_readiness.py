"""What `railsim inspect` says can be estimated, against what the estimators then do."""

import json
from pathlib import Path

import pytest

from estimators.interface import ESTIMATORS, Missing
from experiments.cli import main
from experiments.conformance.recordings import recording
from experiments.maintenance.readiness import Readiness, needs_page, readiness, readiness_text, what_each_brings
from railsim import InputError
from railsim.measurements import Measurements
from railsim.quality.draft import tables_of

PAGE = Path(__file__).parents[3] / "docs" / "what_can_be_estimated.md"
PITCH = "bogie.rate_pitch [rad/s]"


def home() -> Measurements:
    return recording("straight_erri_low", 5.0).measurements


def without(measured: Measurements, channels: set[str], parameters: set[str]) -> Measurements:
    tables = {
        rate: {name: values for name, values in table.items() if name not in channels}
        for rate, table in tables_of(measured).items()
    }
    vehicle = {name: value for name, value in measured.vehicle.items() if name not in parameters}
    return Measurements({**measured.about, "vehicle": vehicle}, tables, measured.track)


def test_ready_ones_estimate_and_others_say_the_same() -> None:
    measured = without(home(), {PITCH}, {"primary_half_spacing"})
    for one in readiness(measured):
        if one.estimator.startswith("suspension"):
            continue  # their estimates take long; the next test has what they lack
        estimator = ESTIMATORS.resolve(one.estimator).build({})
        if one.missing:
            with pytest.raises(InputError) as refused:
                estimator.estimate(measured)
            things = (*one.missing.channels, *one.missing.parameters, *one.missing.others)
            assert all(thing in str(refused.value) for thing in things)
        else:
            try:
                estimator.estimate(measured)
            except InputError as error:
                assert "needs" not in str(error)  # too short, or standing: not what the table is about


def test_what_is_missing_is_named_all_at_once() -> None:
    found = {one.estimator: one.missing for one in readiness(without(home(), {PITCH}, {"primary_half_spacing"}))}
    assert PITCH in found["alignment_displacement"].channels
    assert found["alignment_displacement"].parameters == ("primary_half_spacing",)
    assert found["suspension_spectral"].parameters == ("primary_half_spacing",)
    assert not found["alignment_accelerometer"]


def test_the_last_thing_that_is_missing_brings_the_estimator() -> None:
    measured = without(home(), {PITCH}, set())
    brings = what_each_brings(readiness(measured))
    assert {"alignment_vertical", "track_smoother", "speed_refined"} <= set(brings[PITCH])
    ready = {one.estimator for one in readiness(home()) if not one.missing}
    assert set(brings[PITCH]) <= ready


def test_the_table_ends_the_inspection(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "straight_erri_low", "--set", "duration=3", "--out", str(tmp_path / "r")]) == 0
    capsys.readouterr()
    assert main(["inspect", str(tmp_path / "r"), "--json"]) == 0
    stated = json.loads(capsys.readouterr().out)["inspected"][0]
    assert {one["estimator"] for one in stated["estimators"]} == set(ESTIMATORS.classes())
    assert any(one["ready"] for one in stated["estimators"])


def test_a_gain_of_several_estimators_is_said_once() -> None:
    found = [
        Readiness("one", Missing(), {"a [m]": "more"}),
        Readiness("two", Missing(channels=("a [m]",)), {}),
        Readiness("three", Missing(), {"a [m]": "more"}),
    ]
    assert readiness_text(found).splitlines()[-1] == "a [m]  two; one, three: more"


def test_text_names_every_estimator_and_every_note() -> None:
    text = readiness_text(readiness(home()), columns=100)
    assert all(name in text for name in ESTIMATORS.classes())
    assert "(1) " in text


def test_the_page_is_what_the_estimators_say() -> None:
    assert PAGE.read_text(encoding="utf-8").endswith(needs_page() + "\n"), (
        "renew the page: its part from the first estimator on is experiments.maintenance.readiness.needs_page()"
    )
