"""SWEEP.yaml: what is wrong with one is said in one line, before anything is simulated."""

from pathlib import Path

import pytest

from estimators.interface import ESTIMATORS
from experiments.sweep.plan import make_plan
from experiments.sweep.settings import read_sweep, studies
from railsim.errors import InputError
from tests.experiments.conftest import ROOT
from tests.experiments.sweep.conftest import POINTS, RUNS, SWEEP


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("scenario: straight", "scenarios: straight", "scenarios: unknown key; a sweep knows description, scenario"),
        ("scenario: straight_erri_low", "", "scenario: missing; add it"),
        ("scenario: straight_erri_low", "scenario: nix", "no point of the design can be simulated; the first says: no"),
        ("scenario: straight_erri_low", "scenario: smooth\nengine: steam", "engine: unknown engine 'steam'"),
        ("seeds: [3, 1]", "seeds: 3", "seeds: give a list of whole numbers"),
        ("seeds: [3, 1]", "seeds: [3, 3]", "seeds.1: 3 appears twice"),
        ("seeds: [3, 1]", "seeds: [-1]", "seeds.0: give a whole number from 0 (got -1)"),
        ("name: speed_plain", "name: speed_plane", "unknown estimator 'speed_plane'; did you mean 'sp"),
        ("slowest: 20", "slowest: -20", "estimators.plain.slowest: Input should be greater than 0.5"),
        ("slowest: 20}]", "slowest: 20}, plain]", "estimators: 'plain' appears twice"),
        ("[{name: speed_plain, label: plain, slowest: 20}]", "[speed_plain, 3]", "estimators.1: give the name"),
        ("estimators.plain.window", "estimators.other.window", "write estimators.LABEL.SETTING; labels are: plain"),
        ("[0.8, 1.0]", "[0.8, 100]", "estimators.plain.window: Input should be less than or equal to 60"),
        ("speed.speed: [25", "seed: [25", "design.keys.seed: noise seeds are given by the sweep's own key 'seeds'"),
        ("speed.speed: [25", "score: [25", "design.keys.score: the table has a column of that name"),
        ("speed.speed: [25, 30, 35]", "speed.sped: [25]", "the first says: speed.sped: unknown key; did you mean"),
        ("gyro: [bogie.rate_pitch]", "gyro: [bogie.rate_bitch]", "sensors.gyro: no channel fits 'bogie.rate_bitch'"),
        ("gyro: [bogie.rate_pitch]", "gyro: {channels: ['*'], cost: -1}", "sensors.gyro.cost: give a number from 0"),
        ("  both: [bogie.*]\n  all: [\"*\"]\n", "", "estimators.plain: speed_plain needs channel 'bogie.accel"),
        ("seeds: [3, 1]", "seeds: [3, 1]\nreport: {score: x}", "report: knows scores and panels"),
        ("set:\n", "set:\n  estimators.nix.window: 1\n", "set.estimators.nix.window: write estimators.LABEL.SETTING"),
        ("both: [bogie.*]", "both: {channels: [bogie.*], at: [25]}", "sensors.both.at: give a factor of the design"),
        ("both: [bogie.*]", "both: {channels: [bogie.*], at: {speed: 25}}", "sensors.both.at.speed: no factor of the"),
        ("both: [bogie.*]", "both: {channels: [bogie.*], at: {speed.speed: 26}}", "does not take 26; it takes 25, 3"),
        ("seeds: [3, 1]", "seeds: [3, 1]\nreport: {panels: {a: b}}", "report.panels.a: give the score with its unit"),
        ("seeds: [3, 1]", "seeds: [3, 1]\nreport: {panels: {a: {score: s, at: {x: 1}}}}", "report.panels.a.at.x: no "),
        ("set:\n", "set:\n  seed: 3\n", "set.seed: noise seeds are given by the sweep's own key 'seeds'"),
        ("design:", "design: [", "is not YAML"),
    ],
)  # fmt: skip
def test_bad_sweep_says_where(tmp_path: Path, old: str, new: str, line: str):
    assert old in SWEEP
    path = tmp_path / "mine.yaml"
    path.write_text(SWEEP.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        make_plan(read_sweep(path))
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_points_that_differ_in_settings_of_estimators_share_a_run(sweep_file: Path):
    plan = make_plan(read_sweep(sweep_file))
    assert (plan.points, len(plan.tasks)) == (POINTS, RUNS)
    assert [[point.number for point in task.points] for task in plan.tasks] == [[2 * n, 2 * n + 1] for n in range(RUNS)]
    assert plan.columns["speed.speed"] == ("number", [25.0] * 4 + [30.0] * 4 + [35.0] * 4)


def test_a_point_that_cannot_be_built_is_known_before(sweep_file: Path):
    sweep_file.write_text(SWEEP.replace("[25, 30, 35]", "[25, 999]"))
    plan = make_plan(read_sweep(sweep_file))
    assert sorted(plan.bad) == [4, 5, 6, 7]
    assert plan.bad[4].startswith("speed.speed: Input should be less than or equal to 120")


def test_unknown_study_names_those_there_are():
    with pytest.raises(
        InputError, match="no sweep 'nix'; there are: sampling_rate, sensor_sets, speed_error, suspension_f"
    ):
        read_sweep("nix")


def test_a_sensor_set_stands_at_the_points_that_it_names_only(sweep_file: Path):
    sweep_file.write_text(SWEEP.replace("gyro: [bogie.rate_pitch]", "gyro: {channels: ['*'], at: {speed.speed: [30]}}"))
    plan = make_plan(read_sweep(sweep_file))
    assert [plan.sets[number] for number in range(POINTS)] == [(0, 1)] * 4 + [(0, 1, 2)] * 4 + [(0, 1)] * 4


def test_settings_of_an_estimator_can_be_fixed(sweep_file: Path):
    sweep_file.write_text(SWEEP.replace("set:\n", "set:\n  estimators.plain.low: 1.5\n"))
    plan = make_plan(read_sweep(sweep_file))
    changes = [point.changes["plain"] for task in plan.tasks for point in task.points]
    assert changes == [{"low": 1.5, "window": 0.8}, {"low": 1.5, "window": 1.0}] * RUNS


@pytest.mark.parametrize("name", list(studies()))
def test_shipped_study_can_be_planned(name: str):
    plan = make_plan(read_sweep(name))
    assert plan.bad == {}
    assert plan.sweep.description
    if name == "sensor_sets":
        assert plan.unserved == {}, "an estimator has no row: give `sensor_sets` the sensors or the place that it needs"
        assert {variant.name for variant in plan.sweep.variants} == set(ESTIMATORS.classes())


def test_the_example_of_the_docs_is_a_sweep(tmp_path: Path):
    """Its numbers are numbers: 14e+3 is one as people write it."""
    page = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
    (tmp_path / "example.yaml").write_text(page.partition("```yaml\n")[2].partition("```")[0])
    sweep = read_sweep(tmp_path / "example.yaml")
    mass = next(factor for factor in sweep.design.factors if factor.name == "vehicle.body_mass")
    assert [values["vehicle.body_mass"] for _, values in mass.levels()] == [14e3, 16e3, 18e3]
    assert len(sweep.design.rows()) == 3 * 3 * 2 * 2


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("scenario: a\nscenario: b\n", "key 'scenario' appears twice"),
        ("[" * 5000, "nests deeper than 50 levels"),
        (
            "a0: &a0 [x,x]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]\n" for i in range(1, 30)),
            "once its aliases",
        ),
    ],
)
def test_a_hostile_sweep_is_refused_in_one_line(text: str, line: str, tmp_path: Path):
    (tmp_path / "hostile.yaml").write_text(text)
    with pytest.raises(InputError, match=line):
        read_sweep(tmp_path / "hostile.yaml")
