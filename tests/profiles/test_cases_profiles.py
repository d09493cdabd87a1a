"""Profile files as measuring devices and other programs write them: right, or one line with a cure that works."""

from pathlib import Path

import numpy as np
import pytest

from railsim.errors import InputError
from railsim.profiles.files import read_profile
from railsim.profiles.s1002 import s1002
from railsim.profiles.uic60 import uic60
from railsim.profiles.wheelset import WheelsetOnTrack
from railsim.vehicles.manchester import Manchester

MINIPROF = "ProgramName=MiniProf\nDate=1/2/2023\nXYPoints=237\n"


def wheel() -> np.ndarray:
    """Points of a wheel from the flange's back, z down, mm."""
    profile = s1002(5e-4)
    return 1e3 * np.column_stack((profile.y + 0.070, -profile.z))


def rail(side: float = 1.0) -> np.ndarray:
    """Points of a leaning rail over its whole head, gauge side at negative y for `side` 1, mm."""
    profile = uic60(1 / 40)
    points = 1e3 * np.column_stack((side * profile.y, profile.z))
    return points if side > 0 else points[::-1]


def write(path: Path, head: str, points: np.ndarray, form: str = "{:.4f} {:.4f}", end: str = "") -> Path:
    path.write_text(head + "\n".join(form.format(*row) for row in points) + "\n" + end)
    return path


def is_wheel(path: Path, tolerance: float = 1e-6, **options: object) -> None:
    """The file holds the S1002."""
    profile, own = read_profile(path, "wheel", **options), s1002(5e-4)  # pyright: ignore[reportArgumentType]
    assert profile.y.size == own.y.size
    assert profile.y == pytest.approx(own.y, abs=tolerance)
    assert profile.z == pytest.approx(own.z, abs=tolerance)


@pytest.mark.parametrize("names", ["A,X,Y", "N,X,Y,A", "Y,X", "X Y A C", "K,Y,X,N"])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_columns_go_by_the_header(tmp_path: Path, names: str, mirror: float):
    points = wheel() * [mirror, 1.0]
    order = names.replace(",", " ").split()
    other = np.linspace(-90.0, 90.0, len(points))
    table = np.column_stack([{"X": points[:, 0], "Y": points[:, 1]}.get(name, other) for name in order])
    path = write(tmp_path / "a.whl", f"{MINIPROF}ColumnDef={names}\n\n", table, " ".join(["{:.4f}"] * len(order)))
    is_wheel(path)


def test_missing_column_of_the_header_is_one_line(tmp_path: Path):
    path = write(tmp_path / "a.whl", f"{MINIPROF}ColumnDef=X,A\n\n", wheel())
    with pytest.raises(InputError, match="ColumnDef names X, A, a profile needs X and Y; export them too"):
        read_profile(path)
    is_wheel(write(path, f"{MINIPROF}ColumnDef=X,Y\n\n", wheel()))


@pytest.mark.parametrize(
    ("head", "end"),
    [
        ("MINIPROF 2020\nStock.......:\n32.58 37.11 14.71\n\n", ""),
        ("MINIPROF 2020\n32.58 37.11 \n14.71 0.0\n(Sd/Sh/qR)\n", ""),
        ("ProgramName=MiniProf\n\n", "\nSd Sh qR\n32.58 37.11\n28.0 10.8\n"),
    ],
)
def test_rows_of_a_header_or_summary_are_no_points(tmp_path: Path, head: str, end: str):
    is_wheel(write(tmp_path / "a.whl", head, wheel(), end=end))


@pytest.mark.parametrize("form", ["{:.4f};{:.4f}", "{:.4f}\t{:.4f}", "{:.4f} {:.4f}", "{:.4f} ; {:.4f}"])
@pytest.mark.parametrize("name", ["a.whl", "a.txt"])
def test_decimal_commas(tmp_path: Path, form: str, name: str):
    path = write(tmp_path / name, "ProgramName=MiniProf\n\n" if name == "a.whl" else "", wheel(), form)
    head, _, body = path.read_text().rpartition("\n\n")
    path.write_text(head + ("\n\n" if head else "") + body.replace(".", ","))
    is_wheel(path)


def test_commas_that_may_be_either_are_refused_and_the_cure_works(tmp_path: Path):
    path = write(tmp_path / "a.txt", "", wheel(), "{:.4f},{:.4f}")
    is_wheel(path)
    text = path.read_text()
    path.write_text(text.replace(".", ","))
    with pytest.raises(InputError, match="write decimal points, or ';' between numbers"):
        read_profile(path, "wheel")
    path.write_text(text.replace(",", ";").replace(".", ","))
    is_wheel(path)


@pytest.mark.parametrize("count", ["{}", "{} 2", "{} 0.0"])
def test_count_line_is_no_point(tmp_path: Path, count: str):
    is_wheel(write(tmp_path / "a.txt", f"# kind: wheel\n{count.format(len(wheel()))}\n", wheel()))


def test_inch_is_named_and_can_be_set_in_a_scenario(tmp_path: Path):
    path = write(tmp_path / "inch.txt", "# kind: wheel\n", wheel() / 25.4, "{:.7f} {:.7f}")
    pair = {"kind": "profiles", "wheel": str(path)}
    with pytest.raises(InputError, match="the numbers look like inch: state units=inch"):
        Manchester.build({"pair": pair}).model()
    is_wheel(path, units="inch")
    Manchester.build({"pair": pair | {"units": "inch"}}).model()


def simpack(points: np.ndarray, options: str, scale: float = 1e3) -> str:
    rows = "\n".join(f" {y:.9e} {z:.9e} 1.0" for y, z in points)
    return (
        f"header.begin\n  type = 1 ! 0=rail profile, 1=wheel profile\nheader.end\nspline.begin\n{options}"
        f"  units.len.f = {scale:.8e} ! Unit factor\n  point.begin\n{rows}\n  point.end\nspline.end\n"
    )


def test_simpack_options(tmp_path: Path):
    path = tmp_path / "a.prw"
    path.write_text(simpack(wheel() - [70.0, 0.0], ""))
    is_wheel(path)
    path.write_text(simpack((wheel() - [70.0, 0.0]) / 25.4, "", 1e3 / 25.4))
    is_wheel(path)
    path.write_text(simpack(wheel() - [70.0 - 3.0, 0.0], "  shift.y = -3.0 ! 2: y shift\n"))
    is_wheel(path)
    turn = np.radians(2.0)
    back = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    turned = (wheel() - [70.0, 0.0]) @ back
    path.write_text(simpack(turned, f"  rotate = {turn:.9f} ! 3: Rotation\n  units.ang.f = 1.0\n"))
    is_wheel(path, 1e-5)
    assert any("rotated by 2 deg" in text for text in read_profile(path).assumptions)
    path.write_text(simpack(turned, f"  rotate = {2.0:.9f} ! 3: Rotation\n  units.ang.f = {180 / np.pi:.9f}\n"))
    is_wheel(path, 1e-5)
    path.write_text(simpack(wheel() - [70.0, 0.0], "  bound.y.min = -100.0\n  bound.y.max = 40.0\n"))
    assert read_profile(path).y.max() == pytest.approx(0.040, abs=6e-4)


def vampire(points: np.ndarray, right: np.ndarray) -> str:
    rows = [f"{-680 - a:9.3f} {b:8.3f} {680 + c:9.3f} {d:8.3f}" for (a, b), (c, d) in zip(points, right, strict=True)]
    return "WHEELPROFILE\nown points\nTREADDATUM EUROPEAN\nFLANGEBACK 1360.0\n" + "\n".join(rows) + "\n"


def test_vampire_wheel(tmp_path: Path):
    path = tmp_path / "a.whe"
    path.write_text(vampire(wheel(), wheel()))
    is_wheel(path, 1e-6)
    path.write_text(vampire(wheel(), wheel() + np.array([0.0, 0.5])))
    assert "left and right side differ" in read_profile(path).assumptions[0]
    text = vampire(wheel(), wheel()).replace("FLANGEBACK 1360.0\n", "")
    path.write_text(text)
    with pytest.raises(InputError, match="add 'FLANGEBACK 1360.0'"):
        read_profile(path)


def test_vampire_rail_knows_its_gauge_side(tmp_path: Path):
    path, points = tmp_path / "a.rai", rail()
    rows = [f"{-(752.5 + y):9.4f} {z:8.4f} {752.5 + y:9.4f} {z:8.4f}" for y, z in points]
    path.write_text("RAILPROFILE\nown points\nGAUGE 1435.0\n" + "\n".join(rows) + "\n")
    profile = read_profile(path)
    assert profile.assumptions == () and profile.kind == "rail"
    assert profile.z == pytest.approx(uic60(1 / 40).z, abs=1e-6)


def conicity(path: Path, **options: object) -> float:
    profile = read_profile(path, "rail", **options)  # pyright: ignore[reportArgumentType]
    pair = WheelsetOnTrack((read_profile("s1002"), profile))
    return float(pair.radius_difference(np.array([3e-3]))[0]) / 6e-3


def test_gauge_side_is_said_and_can_be_set(tmp_path: Path):
    negative = write(tmp_path / "negative.ban", f"{MINIPROF}Rail=high\n\n", rail())
    positive = write(tmp_path / "positive.ban", f"{MINIPROF}Rail=high\n\n", rail(-1.0))
    right = conicity(negative)
    assert conicity(positive) != pytest.approx(right, rel=0.2)
    assert conicity(positive, gauge_side="positive") == pytest.approx(right, rel=1e-3)
    assert "gauge side (gauge_side)" in read_profile(positive).assumptions[0]
    pair = {"kind": "profiles", "rail": str(positive)}
    assert any("gauge side" in text for text in Manchester.build({"pair": pair}).assumptions())
    stated = Manchester.build({"pair": pair | {"gauge_side": "positive"}})
    assert stated.assumptions() == []
    assert read_profile("uic60_40").assumptions == ()


def guard(at: float) -> np.ndarray:
    """A guard rail 20 mm higher than the running rail, 60 mm beside it, from `at` mm."""
    y = np.concatenate([[at], np.linspace(at + 1, at + 40, 40), [at + 41]])
    return np.column_stack((y, np.concatenate([[-20.0], np.full(40, 20.0), [-20.0]])))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_guard_rail_is_told_from_the_rail(tmp_path: Path, side: float):
    points = rail(-side)
    ballast = np.column_stack((np.linspace(46.0, 88.0, 20), np.full(20, -45.0)))
    beside = np.concatenate([ballast, guard(90.0)]) * [side, 1.0]
    both = np.concatenate([points, beside]) if side > 0 else np.concatenate([beside[::-1], points])
    path = write(tmp_path / "a.ban", f"{MINIPROF}\n", both)
    profile = read_profile(path)
    assert "two heads" in profile.assumptions[0]
    own = read_profile(write(tmp_path / "b.ban", f"{MINIPROF}\n", rail()))
    inside = profile.y > -0.03
    assert profile.z[inside] == pytest.approx(np.interp(profile.y[inside], own.y, own.z), abs=1e-4)
    shifted = write(tmp_path / "c.ban", f"{MINIPROF}\n", both + np.array([60.0 * side, 0.0]))
    with pytest.raises(InputError, match="2 heads .a guard rail.*count y from its middle"):
        read_profile(shifted)


def test_shallow_head_is_one_line(tmp_path: Path):
    points = rail()
    path = write(tmp_path / "a.ban", f"{MINIPROF}\n", points[points[:, 1] > -8.0])
    pair = {"kind": "profiles", "rail": str(path)}
    with pytest.raises(InputError, match="does not reach 14 mm .*measure it further down") as caught:
        Manchester.build({"pair": pair}).model()
    assert "\n" not in str(caught.value)
    deeper = write(tmp_path / "b.ban", f"{MINIPROF}\n", points[points[:, 1] > -20.0])
    Manchester.build({"pair": pair | {"rail": str(deeper)}}).model()


@pytest.mark.filterwarnings("error")
def test_what_is_no_rail_gives_no_warnings(tmp_path: Path):
    steep = np.column_stack((np.linspace(0.0, 40.0, 50), np.linspace(0.0, 80.0, 50)))
    with pytest.raises(InputError, match="nothing is flatter than a slope"):
        read_profile(write(tmp_path / "a.ban", f"{MINIPROF}\n", steep))
