"""Plug-ins outside the program are found in folders and by entry points; what is wrong with one is said in a line."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from estimators.interface import ESTIMATORS
from railsim import load_scenario
from railsim.compiled import sources
from railsim.distribution import ROOT
from railsim.effects.interface import EFFECTS
from railsim.errors import InputError, nearest
from railsim.plugins import VARIABLE, load, more_plugins
from railsim.registry import source_digest
from railsim.scenario import SCENARIOS
from railsim.simulation import run_digest
from railsim.track.files import TRACKS, read_track
from railsim.vehicles.lookup import build_vehicle, vehicle_names

ESTIMATOR = '''
from estimators.interface import Estimate, Estimator


class Any(Estimator, frozen=True):
    """Whatever."""

    def estimate(self, measurements):
        raise ValueError
'''
EFFECT = '''
from railsim.effects.interface import Effect
from ._amount import AMOUNT


class Other(Effect, frozen=True):
    """Whatever."""

    def install(self, setup):
        return setup
'''
TRACK = "s [m]\n0\n3\n6\n9\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of plug-ins."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    return tmp_path


def put(folder: Path, name: str, text: str) -> Path:
    """A file in a folder that is made."""
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(textwrap.dedent(text))
    return folder / name


@pytest.mark.parametrize("place", ["estimators", "estimators/speed"])
def test_a_class_in_a_folder_is_found_by_the_name_of_its_file(folder: Path, place: str):
    before = set(ESTIMATORS.classes())
    put(folder, f"{place}/mine.py", ESTIMATOR)
    put(folder, f"{place}/_parts.py", "1 / 0")
    put(folder, f"{place}/tests/test_mine.py", "1 / 0")
    assert set(ESTIMATORS.classes()) - before == {"mine"}
    assert ESTIMATORS.pick("mine").build({}).name == "mine"


def test_the_places_of_the_repository_are_taken_as_well(folder: Path):
    put(folder, "railsim/effects/other.py", EFFECT)
    put(folder, "railsim/effects/_amount.py", "AMOUNT = 1")
    put(folder, "track_data/flat.csv", TRACK)
    assert EFFECTS.pick("other").build({}).kind == "other"
    assert read_track("flat").s[-1] == 9.0


def test_nothing_is_found_without_the_folder(folder: Path, monkeypatch: pytest.MonkeyPatch):
    put(folder, "estimators/mine.py", ESTIMATOR)
    monkeypatch.delenv(VARIABLE)
    assert "mine" not in ESTIMATORS.classes()
    with more_plugins([folder]):
        assert "mine" in ESTIMATORS.classes()
        assert os.environ[VARIABLE] == str(folder)  # for the processes that this one starts
    assert VARIABLE not in os.environ


def test_the_path_of_a_file_is_a_name_in_a_command_and_nowhere_else(tmp_path: Path):
    file = put(tmp_path, "mine.py", ESTIMATOR)
    assert ESTIMATORS.resolve(str(file)).build({}).name == "mine"
    with pytest.raises(InputError, match="unknown estimator"):
        ESTIMATORS.pick(str(file))


def test_a_shipped_file_by_its_path_is_the_shipped_plug_in():
    shipped = ESTIMATORS.pick("speed_plain")
    module = Path(__file__).parents[1].joinpath(*shipped.__module__.split(".")).with_suffix(".py")
    assert ESTIMATORS.resolve(str(module)) is shipped


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("import nowhere_at_all", r"No module named 'nowhere_at_all' \(broken.py, line 1\)"),
        ("\n\n1 / 0", r"ZeroDivisionError: division by zero \(broken.py, line 3\)"),
        ("def (", r"invalid syntax \(broken.py, line 1\)"),
        (ESTIMATOR.replace("def estimate", "def guess"), "Any in '.*broken.py' lacks estimate; add that"),
        (ESTIMATOR + ESTIMATOR.replace("Any", "Another"), "broken.py' defines 2 plug-ins; one file holds one"),
    ],
)
def test_a_broken_file_is_named_with_the_reason_and_stops_nothing_else(folder: Path, text: str, line: str):
    put(folder, "estimators/broken.py", text)
    put(folder, "estimators/mine.py", ESTIMATOR)
    for failing in (ESTIMATORS.classes, lambda: ESTIMATORS.pick("broken")):
        with pytest.raises(InputError, match=line) as caught:
            failing()
        assert "\n" not in str(caught.value)
    assert ESTIMATORS.pick("mine")
    assert EFFECTS.classes()


def test_a_file_without_a_plug_in_is_passed_over_but_not_as_an_answer(folder: Path):
    file = put(folder, "estimators/helper.py", "NUMBER = 1")
    assert "helper" not in ESTIMATORS.classes()
    with pytest.raises(InputError, match="defines 0 subclasses of estimators.interface.Estimator"):
        ESTIMATORS.resolve(str(file))


def test_a_name_that_ships_is_refused(folder: Path):
    put(folder, "estimators/speed_plain.py", ESTIMATOR)
    put(folder, "tracks/smooth.csv", TRACK)
    put(folder, "vehicles/manchester.yaml", "base: class175")
    for failing in (ESTIMATORS.classes, lambda: ESTIMATORS.pick("speed_plain")):
        with pytest.raises(InputError, match="'speed_plain' stands in 'estimators.speed.speed_plain' and in '.*py'; r"):
            failing()
    with pytest.raises(InputError, match=r"track 'smooth' stands in '.*smooth.csv' and in '.*smooth.csv'; rename"):
        TRACKS.paths()
    with pytest.raises(InputError, match=r"vehicle 'manchester' stands in .*manchester.* and in '.*yaml'; rename"):
        vehicle_names()


def test_a_file_that_python_cannot_import_by_its_name(folder: Path):
    put(folder, "estimators/my-filter.py", ESTIMATOR)
    with pytest.raises(InputError, match="my-filter.py': a plug-in has the name of its file; rename"):
        ESTIMATORS.classes()


def test_a_folder_that_is_not_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "nix"))
    with pytest.raises(InputError, match=r"nix' is not a folder; mend --plugins or RAILSIM_PLUGINS"):
        SCENARIOS.paths()


def advertise(folder: Path, group: str, value: str) -> None:
    """An installed package that advertises `value`."""
    put(folder, "mine-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    put(folder, "mine-1.0.dist-info/entry_points.txt", f"[{group}]\nanything = {value}\n")


def test_an_entry_point_may_name_a_module_or_a_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    put(tmp_path, "mine_installed/__init__.py", "")
    put(tmp_path, "mine_installed/inner/__init__.py", "")
    put(tmp_path, "mine_installed/inner/advertised.py", ESTIMATOR)
    for number, value in enumerate(["mine_installed.inner.advertised", "mine_installed.inner"]):
        site = tmp_path / f"site{number}"
        advertise(site, "railsim.estimators", value)
        with monkeypatch.context() as patch:
            patch.syspath_prepend(tmp_path)
            patch.syspath_prepend(site)
            assert ESTIMATORS.pick("advertised").__module__ == "mine_installed.inner.advertised"
        assert "advertised" not in ESTIMATORS.classes()


def test_an_entry_point_may_name_a_package_of_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    put(tmp_path, "my_tracks/__init__.py", "")
    put(tmp_path, "my_tracks/flat.csv", TRACK)
    advertise(tmp_path, "railsim.tracks", "my_tracks")
    monkeypatch.syspath_prepend(tmp_path)
    assert read_track("flat").s[-1] == 9.0


def test_an_entry_point_that_leads_nowhere_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    advertise(tmp_path, "railsim.effects", "no_such_package.effects")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InputError, match="entry point 'anything = no_such_package.effects' in 'railsim.effects' of 'm"):
        EFFECTS.classes()
    assert ESTIMATORS.classes()


def test_source_of_plug_ins_counts_to_the_runs_that_they_shape_and_to_no_others(folder: Path):
    put(folder, "effects/other.py", EFFECT)
    helper = put(folder, "effects/_amount.py", "AMOUNT = 1")
    plain = load_scenario("default")
    changed = load_scenario("default", {"effects": ["other"]})
    before = run_digest(plain, "compiled"), run_digest(changed, "compiled")
    assert source_digest([EFFECTS.pick("payload")]) == ""
    helper.write_text("AMOUNT = 2")
    after = run_digest(plain, "compiled"), run_digest(changed, "compiled")
    assert after[0] == before[0]
    assert after[1] != before[1]


KERNEL = """
from railsim.compiled import kernel
from ._parts import twice


@kernel
def four_times(x):
    return twice(twice(x))
"""


PART = """
from railsim.compiled import inlined


@inlined
def twice(x):
    return 2.0 * x
"""


def test_kernels_of_a_plug_in_are_compiled_and_kept_by_all_source_that_they_are_made_of(tmp_path: Path):
    helper = put(tmp_path, "_parts.py", PART)
    file = put(tmp_path, "kernels.py", KERNEL)
    assert load(file).four_times(3.0) == 12.0
    assert helper in sources(file)
    code = f"from pathlib import Path; from railsim.plugins import load; module = load(Path({str(file)!r})); "
    code += "print(module.four_times(2.0), sum(module.four_times.stats.cache_hits.values()))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["8.0", "1"], done.stderr  # of another process, from the machine code that is kept


def test_an_effect_of_a_scenario_is_not_code_at_a_path(folder: Path):
    file = put(folder, "mine.py", EFFECT)
    with pytest.raises(InputError, match="unknown effect"):
        load_scenario("default", {"effects": [str(file)]})


def test_a_wrong_name_gets_the_nearest_one_as_a_hint(folder: Path):
    put(folder, "estimators/pitch_bias.py", ESTIMATOR)
    with pytest.raises(InputError, match=r"unknown estimator 'pitch_bais'; did you mean 'pitch_bias'\? there are: adh"):
        ESTIMATORS.pick("pitch_bais")
    with pytest.raises(InputError, match=r"no scenario 'defualt'; did you mean 'default'\? there are: "):
        load_scenario("defualt")
    with pytest.raises(InputError, match=r"vehicle.body_mas: unknown key; did you mean 'body_mass'\? Class175 knows"):
        load_scenario("default", {"vehicle.body_mas": 1.0})
    with pytest.raises(InputError, match=r"unknown vehicle 'manchestr'; did you mean 'manchester'\?"):
        build_vehicle("manchestr")
    assert nearest("nothing like it", ["default"]) == ""
