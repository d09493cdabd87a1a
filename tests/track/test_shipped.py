"""The shipped track files: their origin, their bytes and what is in them."""

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest

from railsim.distribution import shipped_folder
from railsim.track import CANT_BASE, kernel, read_track, shipped_tracks
from railsim.track.inspection import problems
from railsim.track.kernel import build_tables, sample
from railsim.track.shipped import BAND, main, tracks
from railsim.track.spectra import QUANTITIES, spectra, variance

FOLDER = shipped_folder("track_data")


def test_sources_name_every_file_with_its_checksum() -> None:
    text = FOLDER.joinpath("SOURCES.md").read_text()
    listed = dict(re.findall(r"^\| `(\w+)\.csv` .* `([0-9a-f]{64})` \|$", text, flags=re.MULTILINE))
    found = {name: hashlib.sha256(FOLDER.joinpath(f"{name}.csv").read_bytes()).hexdigest() for name in shipped_tracks()}
    assert listed == found


def test_files_are_made_again_byte_for_byte(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main([str(tmp_path)])
    printed = capsys.readouterr().out
    for name in tracks():
        made = (tmp_path / f"{name}.csv").read_bytes()
        assert made == FOLDER.joinpath(f"{name}.csv").read_bytes()
        assert f"{hashlib.sha256(made).hexdigest()}  {name}.csv" in printed
        assert len(made) < 2_000_000


@pytest.mark.parametrize("name", shipped_tracks())
def test_nothing_suspicious_and_tables_build(name: str) -> None:
    track = read_track(name)
    assert track.comments
    assert problems(track) == []
    assert np.isfinite(build_tables(track).coefficients[:, : kernel.LEFT_FRICTION]).all()


@pytest.mark.parametrize("level", ["low", "high"])
def test_straights_have_their_spectrum(level: str) -> None:
    track = read_track(f"straight_erri_{level}")
    assert (track.length, track.spacing) == (2000, pytest.approx(0.2))
    assert track.given == QUANTITIES
    for key, spectrum in spectra(f"erri_{level}").items():
        rows = getattr(track, key)[track.s > 45]
        assert rows.std() == pytest.approx(np.sqrt(variance(spectrum, BAND)), rel=0.2)  # 20 waves of 100 m
        assert not getattr(track, key)[track.s <= 25].any()


def test_curve_is_the_papers() -> None:
    track = read_track("curve_r400")
    arc = track.at([400.0, 500.0, 640.0])
    assert 1 / arc.curvature == pytest.approx([400] * 3)
    assert np.degrees(np.arcsin(arc.cant / CANT_BASE)) == pytest.approx([6] * 3, abs=1e-5)
    ends = track.at([0, 290, 740, 1000])
    assert np.abs(ends.curvature).max() == 0
    assert np.abs(ends.cant).max() == 0
    tables = build_tables(track)
    assert sample(tables, kernel.HEADING, [1000.0])[0] == pytest.approx(360 / 400, abs=1e-7)
    assert sample(tables, kernel.NORTH, [1000.0])[0] > 100  # to the left
    assert sample(tables, kernel.ROLL, [500.0])[0] == pytest.approx(np.radians(-6), abs=1e-7)
    assert track.length >= 20 + 28 * 20 + 20  # 20 s at 28 m/s
