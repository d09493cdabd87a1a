"""An answer on a recording: statement, files, refusals of the command."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from experiments.cli import main
from experiments.discrepancy.core.fitting import fit
from experiments.discrepancy.core.model import Coordinate, Effect, Hypothesis, Library, System
from experiments.discrepancy.core.policy import Policy
from experiments.discrepancy.core.problem import Problem
from experiments.discrepancy.core.search import healthy_fit, places
from experiments.discrepancy.core.verdict import Action, Verdict, decide
from experiments.discrepancy.railway.answer import Answer, answer
from experiments.discrepancy.railway.cases import VERTICAL, nominal, recorded
from experiments.discrepancy.railway.elsewhere import Elsewhere, elsewhere
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.report import write
from experiments.discrepancy.railway.statement import in_words, parameters, statement
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.files import read_json
from railsim.scenario import load_scenario
from railsim.simulation import simulate_held

GAIN = 1.3


def two_hypotheses(system: System, library: Library, policy: Policy, limit: float, say: object) -> Verdict:
    """A search that tries the first effect alone, in place of the whole one."""
    assert limit > 0.0 and callable(say)
    none, effect = healthy_fit(system, policy), library.effects[0]
    found = fit(Problem(system, Hypothesis((effect,)), policy), none.x, None, none.slopes, 1)
    assert found is not None
    return decide([none, found], library, places(system.levels, library), policy)


@pytest.fixture(scope="module")
def found() -> Iterator[Answer]:
    """Two channels, of which one is too large by a share that the nominal model knows nothing of."""
    sensors, channel = VERTICAL[:2], "bogie.acceleration_z"
    hidden = [{"kind": "sensor_gain", "channel": channel, "factor": GAIN}]
    measured = recorded(np.random.default_rng(6), "home", hidden, sensors)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"{answer.__module__}.infer", two_hypotheses)
        yield answer(evidence_of(measured, nominal("home", sensors)), ("sensor_gain",))


def test_a_wrong_gain_is_named_with_its_size(found: Answer, tmp_path: Path) -> None:
    told = write(found, tmp_path)
    assert told["status"] == "named" and told["effects"] == ["sensor_gain"]
    assert (told["effect"], told["class"], told["alternatives"]) == ("sensor_gain", "sensor_gain", [])
    assert told["confidence"] > 0.9 and told["evidence"] > 10.0
    assert 1.0 < told["detectable_size"]["sensor_gain"] < GAIN or GAIN < told["detectable_size"]["sensor_gain"] < 1.0
    size = told["parameters"]["factor"]
    assert size["value"] == pytest.approx(GAIN, rel=0.02) and size["high"] - size["low"] < 0.1
    gaps = told["channels"]["bogie.acceleration_z [m/s2]"]
    assert gaps["before"] > 1.5 * gaps["after"] and gaps["after"] < 1.5
    held = told["held_out"]
    assert held["after"]["gap"] < held["nuisance_only"]["gap"] < held["before"]["gap"]
    assert told["gap"] == {name: one["gap"] for name, one in held.items()}
    assert "sensor gain" in in_words(found)


def test_another_recording_bears_out_what_is_there_too_and_nothing_else(found: Answer) -> None:
    hidden = [{"kind": "sensor_gain", "channel": "bogie.acceleration_z", "factor": GAIN}]
    others = {
        name: Record(
            evidence_of(recorded(np.random.default_rng(8), "home", there, VERTICAL[:2]), nominal("home", VERTICAL[:2]))
        )
        for name, there in (("the same", hidden), ("healthy", ()))
    }
    same, healthy = (one.plain()["gap"] for one in elsewhere(found, others, lambda _: None))
    assert same["after"] < 0.94 * same["nuisance_only"] <= same["before"] and same["after"] < 1.3
    assert healthy["after"] > 1.42 * healthy["nuisance_only"]  # the first recording pulled it off the middle


def test_all_models_are_held_against_the_same_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the errors of the track file are found to be others than stated; they pass through each one's vehicle."""
    measured = recorded(np.random.default_rng(6), "survey loud", (), VERTICAL[:2])
    monkeypatch.setattr(f"{answer.__module__}.infer", two_hypotheses)
    loud = answer(evidence_of(measured, nominal("home", VERTICAL[:2])), ("sensor_gain",))
    assert isinstance(loud.none.system, Railway) and any(loud.none.system.survey or ())
    survey = [k for k, one in enumerate(loud.system.levels) if one.name.startswith("survey")]
    aligned, over = loud.system.middle, loud.none.system
    aligned[loud.system.alignment] = loud.none.x[loud.system.alignment]
    found, stated = (one.covariances(aligned, ()) for one in (over, loud.system))
    for before, same, other in zip(loud.nominal, found, stated, strict=True):
        assert np.allclose(before.components[survey], same[survey], rtol=1e-9)
        assert not np.allclose(before.components[survey], other[survey], rtol=0.2)


def test_its_files_say_the_same_and_its_model_runs(found: Answer, tmp_path: Path) -> None:
    told = write(found, tmp_path)
    assert read_json(tmp_path / "verdict.json", "verdict") == told
    assert "<h1>sensor gain" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "where.png").stat().st_size > 5000 and (tmp_path / "evidence.png").stat().st_size > 5000
    model = load_scenario(str(tmp_path / "model.yaml"))
    assert model.start == pytest.approx(found.system.record.registration.start, abs=2.0)
    assert model.distance == pytest.approx(found.system.record.way, rel=0.02)
    assert np.isfinite(simulate_held(model.but(duration=2.0), "compiled")["bogie.z [m]"]).all()
    (effect,) = model.effects
    settings = effect.settings()
    assert settings["kind"] == "sensor_gain" and settings["factor"] == pytest.approx(GAIN, rel=0.02)


def test_a_narrow_interval_of_a_large_number_is_told_whole(found: Answer) -> None:
    """A place at 250 m that is known to 3 cm."""
    fit = found.none
    own = Coordinate("place", "m", 200.0, 100.0)
    effect = Effect("dip", "dip", own=(own,))
    precision = np.pad(fit.precision, (0, 1))
    precision[-1, -1] = 0.03**-2
    there = dataclasses.replace(fit, hypothesis=Hypothesis((effect,)), x=np.append(fit.x, 250.01), precision=precision)
    (told,) = parameters(found, there).values()
    assert told == {"value": 250.01, "low": 249.961, "high": 250.059, "unit": "m"}


def test_nothing_is_said_where_nothing_was_tried(found: Answer) -> None:
    rows = tuple(row for row in found.verdict.rows if row.fit is found.none)
    verdict = dataclasses.replace(found.verdict, action=Action("none"), rows=rows)
    early = dataclasses.replace(found, verdict=verdict)
    assert statement(early)["status"] == "undecided" and "longer --time-limit" in in_words(early)
    assert "Nothing is missing" not in in_words(early)
    cut = dataclasses.replace(found, verdict=dataclasses.replace(found.verdict, cut=True))
    told = statement(cut)
    assert (told["status"], told["effects"]) == ("undecided", []) and "So far sensor gain" in in_words(cut)


def test_what_predicts_unseen_sections_worse_than_the_nominal_model_is_not_named(found: Answer, tmp_path: Path) -> None:
    before, only, after = found.held
    assert before and after and after.gap < before.gap
    worse = dataclasses.replace(found, held=(after, only, before))
    told = write(worse, tmp_path)
    assert (told["status"], told["effects"], told["model"]) == ("unexplained", [], None)
    assert "unseen sections better than the nominal model" in in_words(worse)


def test_tolerances_that_are_stretched_far_are_said(found: Answer) -> None:
    """The same fit, with a mass moved to eight deviations off its sheet."""
    assert "sheet" not in in_words(found)
    place = next(k for k, one in enumerate(found.system.coordinates) if one.name.startswith("log body_mass"))
    x = found.best.x.copy()
    x[place] = 8.0 * found.system.coordinates[place].spread
    fits = {id(row): dataclasses.replace(row, fit=dataclasses.replace(row.fit, x=x)) for row in found.verdict.rows[:1]}
    rows = tuple(fits.get(id(row), row) for row in found.verdict.rows)
    told = in_words(dataclasses.replace(found, verdict=dataclasses.replace(found.verdict, rows=rows)))
    assert "far beyond their sheet (in deviations: log body mass +8)" in told


def test_what_cannot_begin_is_refused_before_anything_is_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    given = ["discrepancy", "nowhere", "--model", "default", "--out", str(tmp_path / "out")]
    assert main([*given, "--time-limit", "0"]) == 2
    assert "give a positive number of seconds" in capsys.readouterr().err
    for model in ("whole_coach", "default"):
        assert main([*given, "--model", model, "--held-out", "other"]) == 2
        assert "nowhere" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_what_to_change_in_the_scenario_is_said(found: Answer) -> None:
    verdict = dataclasses.replace(found.verdict, action=Action("name", ("second_bogie",)))
    assert "Take the whole vehicle as the nominal scenario." in in_words(dataclasses.replace(found, verdict=verdict))
    assert "nominal scenario" not in in_words(found)


def test_what_the_model_lacks_beside_is_said(found: Answer) -> None:
    assert "The model lacks" not in in_words(found)
    lacking = dataclasses.replace(found, verdict=dataclasses.replace(found.verdict, misfit=12.3))
    assert "12.3 times as much" in in_words(lacking) and statement(lacking)["misfit"] == 12.3
    none = dataclasses.replace(lacking.verdict, action=Action("none"))
    assert "Nothing is missing" not in in_words(dataclasses.replace(lacking, verdict=none))


def test_gaps_of_channels_of_unseen_sections_and_of_other_recordings_are_one_thing(found: Answer) -> None:
    """All are root mean squares over the stated noise: of all channels and of some sections they are alike."""
    told = statement(found)
    channels = np.array([[one["before"], one["nuisance_only"], one["after"]] for one in told["channels"].values()])
    unseen = {name: one["gap"] for name, one in told["held_out"].items()}
    assert np.sqrt(np.mean(channels**2, axis=0)) == pytest.approx(list(unseen.values()), rel=0.5)
    assert unseen["before"] > 3.0  # so that its square is more than half away
    before, only, after = found.held
    assert before is not None
    assert Elsewhere("other", 20.0, 16.0, (before, only, after)).plain()["gap"] == unseen
