"""Readers: formats, frames, units, and one line per kind of bad file."""

from pathlib import Path

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.profiles.files import read_profile, shipped_profiles, write_profile
from railsim.profiles.s1002 import s1002
from railsim.profiles.uic60 import uic60
from tests.profiles.reference import PROFILES, needs_reference


def table(points: np.ndarray, form: str = "{:.6f} {:.6f}") -> str:
    return "\n".join(form.format(*point) for point in points) + "\n"


def wheel_points(spacing: float = 4e-4) -> np.ndarray:
    wheel = s1002(spacing)
    return 1e3 * np.column_stack((wheel.y, wheel.z))


def simpack(points: np.ndarray, type_: int, scale: float = 1e3) -> str:
    return (
        f"header.begin\n  type = {type_}   ! 0=rail profile, 1=wheel profile\nheader.end\nspline.begin\n"
        f"  units.len.f = {scale:.6e} ! Unit factor\n  point.begin\n ! y z\n{table(points, ' {:.9e} {:.9e} 1.0')}"
        "  point.end\nspline.end\n"
    )


def miniprof_wheel(points: np.ndarray, unit: str = "") -> str:
    return f"#MINIWHEELPROF\n{unit}" + '" 32.58 37.11 14.71\n(Sd/Sh/qR)\n\n' + table(points)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize("flip", [1.0, -1.0])
@pytest.mark.parametrize("backwards", [False, True])
def test_every_direction_of_a_simpack_wheel(tmp_path: Path, mirror: float, flip: float, backwards: bool) -> None:
    points = wheel_points() * [mirror, flip]
    path = tmp_path / "wheel.prw"
    path.write_text(simpack(points[::-1] if backwards else points, 1))
    profile = read_profile(path)
    assert profile.kind == "wheel"
    assert 1e3 * np.column_stack((profile.y, profile.z)) == pytest.approx(wheel_points(), abs=1e-5)


@pytest.mark.parametrize(("metres", "unit"), [(1e-3, ""), (0.0254, "Unit=inch\n")])
def test_miniprof_wheel_counts_from_the_flange_back(tmp_path: Path, metres: float, unit: str) -> None:
    points = (wheel_points() * [1.0, -1.0] + np.array([70.0, 0.0])) * 1e-3 / metres
    path = tmp_path / "wheel.whl"
    path.write_text(miniprof_wheel(points, unit))
    profile = read_profile(path)
    assert 1e3 * profile.y == pytest.approx(wheel_points()[:, 0], abs=1e-4)
    assert 1e3 * profile.z == pytest.approx(wheel_points()[:, 1], abs=1e-4)


def test_miniprof_rail_has_its_gauge_side_where_the_face_is(tmp_path: Path) -> None:
    rail = uic60(1 / 40)
    part = rail.y < 0.02  # the field side was not measured
    points = np.column_stack((-rail.y, rail.z, 0.1 * rail.z))[part] * 1e3
    path = tmp_path / "rail.ban"
    path.write_text("Filename=x\nColumnDef=X,Y,A\n\n" + table(points, "{:.6f} {:.6f} {:.4f}"))
    profile = read_profile(path)
    assert profile.kind == "rail"
    assert profile.gauge_point(0.014) == pytest.approx(rail.gauge_point(0.014), abs=1e-6)


def test_rail_in_metres_and_given_side(tmp_path: Path) -> None:
    rail = uic60(1 / 20)
    path = tmp_path / "rail.prr"
    path.write_text(simpack(np.column_stack((-rail.y, -rail.z)), 0, scale=1.0))
    profile = read_profile(path, gauge_side="positive")
    places = np.linspace(-0.045, 0.027, 50)
    assert profile.surface().height(places) == pytest.approx(rail.surface().height(places), abs=1e-7)


@pytest.mark.parametrize("name", shipped_profiles())
def test_written_profile_comes_back(tmp_path: Path, name: str) -> None:
    profile = read_profile(name)
    write_profile(profile, tmp_path / "again.csv", ["copy"])
    again = read_profile(tmp_path / "again.csv")
    assert again.kind == profile.kind
    assert again.y == pytest.approx(profile.y, abs=1e-9)
    assert again.z == pytest.approx(profile.z, abs=1e-9)


BAD = {
    "empty.txt": ("# kind: wheel\n", "no lines with two numbers"),
    "few.txt": ("# kind: wheel\n" + table(wheel_points()[:10]), "only 10 points"),
    "no_kind.txt": (table(wheel_points()), "wheel or rail"),
    "header.prw": (table(wheel_points()), "point.begin"),
    "cut.prw": (simpack(wheel_points(), 1).split("point.end")[0], "point.end"),
    "scale.prw": (simpack(wheel_points(), 1, 0.0), "units.len.f"),
    "header.whl": (table(wheel_points()), "MiniProf header"),
    "inch.whl": (miniprof_wheel(wheel_points() / 25.4), "state units=inch"),
    "huge.whl": (miniprof_wheel(wheel_points() * 77.0), "check columns"),
    "unsorted.whl": (miniprof_wheel(np.random.default_rng(1).permutation(wheel_points())), "backwards"),
    "flat.whl": (miniprof_wheel(wheel_points()[wheel_points()[:, 0] > -34.0] * [1.3, 1.0]), "no flange"),
    "shifted.whl": (miniprof_wheel(wheel_points() - np.array([-35.0, 0.0])), "flange tip at"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_in_one_line(tmp_path: Path, name: str) -> None:
    text, message = BAD[name]
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_profile(tmp_path / name)
    assert str(caught.value).startswith(name)
    assert "\n" not in str(caught.value)


def test_missing_files() -> None:
    with pytest.raises(InputError, match="s1002_worn_050"):
        read_profile("s1003")
    with pytest.raises(InputError, match="check the path"):
        read_profile("nowhere/wheel.prw")


@needs_reference
def test_analytic_profiles_match_the_manchester_files() -> None:
    wheel = read_profile(PROFILES / "MBench_S1002_v3.prw")
    part = wheel.y > -0.0548
    assert wheel.z[part] == pytest.approx(s1002().surface().height(wheel.y[part]), abs=1e-6)
    rail, own = read_profile(PROFILES / "MBench_UIC60_v3.prr"), uic60(1 / 40).surface()
    part = (rail.y > own.start) & (rail.y < own.end)
    apart = (rail.z[part] - own.height(rail.y[part])) / np.hypot(1.0, own.height(rail.y[part], 1))
    assert np.abs(apart).max() < 0.05e-3


@needs_reference
@pytest.mark.parametrize("name", ["Car7216_0001r.whl", "Car7358_0001r.whl", "avg_wheel.whl"])
def test_measured_wheels_load(name: str) -> None:
    wheel = read_profile(PROFILES / name)
    assert (wheel.kind, wheel.y.size > 600) == ("wheel", True)
    assert -29e-3 < wheel.z.min() < -26e-3
    assert wheel.y[0] == pytest.approx(-0.070, abs=2e-3)
    surface = wheel.smoothed(5e-5).surface()
    assert surface.start == pytest.approx(-0.055, abs=1e-3)
    assert surface.end > 0.06
    slopes = surface.height(np.linspace(-0.01, 0.04, 26), 1)
    assert 0.04 < slopes.mean() < 0.06  # worn or new cones near 1:20
    assert slopes.min() > 0.0


@needs_reference
def test_measured_rail_loads() -> None:
    rail = read_profile(PROFILES / "avg_HR.BAN").smoothed(2e-5)
    surface = rail.surface()
    assert rail.gauge_point(0.014) == pytest.approx(-0.0449, abs=2e-4)
    assert np.all(surface.height(np.linspace(-0.04, 0.01, 26), 2) < 0.0)
