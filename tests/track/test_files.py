"""Track files: round trip and every kind of bad input."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from railsim.errors import InputError
from railsim.track import CANT_BASE, Track, read_track, shipped_tracks, write_track
from railsim.track.files import format_track, parse_track
from railsim.track.track import UNITS

REFERENCE = Path(__file__).parents[2] / "../shared/reference/track/inspection_car.csv"

_anything = st.floats(-1e6, 1e6, allow_nan=False)
_ranges = {
    "cant": st.floats(-CANT_BASE, CANT_BASE, exclude_min=True, exclude_max=True),
    "gradient": st.floats(-1, 1, exclude_min=True, exclude_max=True),
    "friction": st.floats(1e-300, 2),
    "stiffness": st.floats(1e-300, 1e12),
}
_comment = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), max_size=20)


@st.composite
def _tracks(draw: st.DrawFn) -> Track:
    count = draw(st.integers(4, 12))
    s = sorted(draw(st.lists(_anything, min_size=count, max_size=count, unique=True)))
    keys = draw(st.lists(st.sampled_from(list(UNITS)), unique=True))
    columns = {key: draw(st.lists(_ranges.get(key, _anything), min_size=count, max_size=count)) for key in keys}
    return Track(s, columns, "drawn", draw(st.lists(_comment)))


@given(track=_tracks())
def test_what_is_written_is_read(track: Track) -> None:
    again = parse_track(format_track(track), "again")
    assert again.digest() == track.digest()
    assert again.given == track.given
    assert again.comments == track.comments


def test_file_round_trip(tmp_path: Path) -> None:
    s = np.linspace(0, 1, 7)
    track = Track(
        s, {"vertical": np.sin(s) / 3, "friction": np.full(7, 0.1)}, comments=["first\nsecond", "", "# third"]
    )
    write_track(track, tmp_path / "mine.csv")
    again = read_track(tmp_path / "mine.csv")
    assert again.digest() == track.digest()
    assert again.name == "mine"
    assert again.comments == ("first", "second", "", "# third")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.csv"]


def test_comments_spaces_and_line_ends_do_not_matter() -> None:
    text = '\ufeff# a\r\n"s [m]", "vertical [m]"\r\n0,1e-3\r\n\r\n#between\r\n 1 , 2e-3\r\n2,0\r\n3,0'.lstrip("\ufeff")
    track = parse_track(text, "x")
    assert track.comments == ("a", "between")
    assert track.vertical.tolist() == [1e-3, 2e-3, 0, 0]


def test_no_zero_is_written_with_a_sign() -> None:
    zeros, negative = (Track(np.arange(4.0), {"vertical": np.full(4, zero)}) for zero in (0.0, -0.0))
    assert format_track(negative) == format_track(zeros) == "s [m],vertical [m]\n0,0\n1,0\n2,0\n3,0\n"


def test_the_last_two_tracks_are_kept() -> None:
    texts = ["s [m]\n0\n1\n2\n3\n", "s [m]\n0\n1\n2\n4\n"]
    first, second = (parse_track(text, "kept") for text in texts)
    assert parse_track(texts[0], "kept") is first
    assert parse_track(texts[1], "kept") is second


def test_byte_order_mark_is_no_column(tmp_path: Path) -> None:
    path = tmp_path / "bom.csv"
    path.write_bytes("s [m]\n0\n1\n2\n3\n".encode("utf-8-sig"))
    assert read_track(path).length == 3


BAD = {
    "empty": ("", "no columns"),
    "only comments": ("# nothing\n", "no columns"),
    "no rows": ("s [m],vertical [m]\n", "line 1: only 0 rows"),
    "three rows": ("s [m]\n0\n1\n2\n", "line 4: only 3 rows"),
    "no distance": ("vertical [m]\n0\n1\n2\n3\n", 'line 1: first column is "vertical [m]"'),
    "distance without unit": ("s,vertical [m]\n0,0\n", 'line 1: first column is "s"'),
    "semicolons": ("s [m];vertical [m]\n0;0\n", "columns with commas"),
    "not first": ("vertical [m],s [m]\n0,0\n", "first column is"),
    "unknown column": ("s [m],height [m]\n0,0\n", 'unknown column "height [m]"; a track knows curvature [1/m]'),
    "wrong unit": ("s [m],vertical [mm]\n0,0\n", 'unknown column "vertical [mm]"'),
    "twice": ("s [m],cant [m],cant [m]\n0,0,0\n", 'column "cant [m]" appears twice'),
    "backwards": ("# c\ns [m]\n0\n1\n\n0.5\n2\n", "line 6: s goes from 1 to 0.5 m"),
    "standing": ("s [m]\n0\n1\n1\n2\n", "line 4: s goes from 1 to 1 m"),
    "NaN": ("s [m],lateral [m],cant [m]\n0,0,0\n1,0,nan\n2,0,0\n3,0,0\n", "line 3: cant is nan"),
    "infinite": ("s [m],lateral [m]\n0,0\n1,0\n2,-inf\n3,0\n", "line 4: lateral is -inf"),
    "word": ("s [m],lateral [m]\n0,0\n1,zero\n2,0\n3,0\n", "line 3: lateral is 'zero', not a number"),
    "empty cell": ("s [m],lateral [m]\n0,0\n1,\n2,0\n3,0\n", "line 3: lateral is '', not a number"),
    "short line": ("s [m],lateral [m]\n0,0\n1\n2,0\n3,0\n", "line 3: 1 values for 2 columns"),
    "long line": ("s [m],lateral [m]\n0,0\n1,0,0\n2,0\n3,0\n", "line 3: 3 values for 2 columns"),
    "no friction": ("s [m],friction [-]\n0,0.3\n1,0\n2,0.3\n3,0.3\n", "line 3: friction is 0; it must be greater"),
    "cant in mm": ("s [m],cant [m]\n0,0\n1,0\n2,100\n3,100\n", "line 4: cant is 100 m"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_refused_in_one_line(case: str, tmp_path: Path) -> None:
    text, message = BAD[case]
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_track(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "latin.csv"
    path.write_bytes("# Gleis Köln\ns [m]\n".encode("latin-1"))
    with pytest.raises(InputError, match="byte 9 is not UTF-8 text"):
        read_track(path)


def test_missing_files_name_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there are: .*curve_r400.*smooth"):
        read_track("no_such_track")
    with pytest.raises(InputError, match="check the path"):
        read_track(tmp_path / "none.csv")
    with pytest.raises(InputError, match="cannot read track"):
        read_track(tmp_path)


def test_shipped_names_and_paths_both_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert {"straight_erri_low", "straight_erri_high", "curve_r400", "smooth"} <= set(shipped_tracks())
    monkeypatch.chdir(tmp_path)
    write_track(Track(np.arange(4.0)), "plain")  # a file without suffix, in the working folder
    assert read_track("plain").length == 3
    assert read_track("smooth").length == 3000


def test_unwritable_places_are_refused_and_left_clean(tmp_path: Path) -> None:
    track = Track(np.arange(4.0))
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot write"):
        write_track(track, tmp_path / "file" / "x.csv")
    with pytest.raises(InputError, match="cannot write"):
        write_track(track, "/")  # a place without a name
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match="cannot write"):
        write_track(track, tmp_path / "folder.csv")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.csv"]


@pytest.mark.skipif(not REFERENCE.exists(), reason="shared reference data are not here")
def test_measured_track_reads() -> None:
    track = read_track(REFERENCE)
    assert track.given == ("left_vertical", "right_vertical")
    assert (track.s.size, track.spacing) == (8800, 0.25)
    assert 1e3 * track.left_vertical.std() == pytest.approx(0.44, abs=0.01)
    assert "inspection car" in track.comments[0]
