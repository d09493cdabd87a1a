"""The shipped profile files: their origin and their bytes."""

import hashlib
import re
from pathlib import Path

import pytest

from railsim.distribution import shipped_folder
from railsim.profiles.files import shipped_profiles
from railsim.profiles.shipped import main, profiles

FOLDER = shipped_folder("track_data")


def test_sources_name_every_profile_with_its_checksum() -> None:
    text = FOLDER.joinpath("SOURCES.md").read_text()
    listed = dict(re.findall(r"^\| `profiles/(\w+)\.csv` .* `([0-9a-f]{64})` \|$", text, flags=re.MULTILINE))
    folder = FOLDER.joinpath("profiles")
    found = {
        name: hashlib.sha256(folder.joinpath(f"{name}.csv").read_bytes()).hexdigest() for name in shipped_profiles()
    }
    assert listed == found


def test_files_are_made_again_byte_for_byte(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main([str(tmp_path)])
    printed = capsys.readouterr().out
    assert sorted(profiles()) == shipped_profiles()
    for name in profiles():
        made = (tmp_path / f"{name}.csv").read_bytes()
        assert made == FOLDER.joinpath("profiles", f"{name}.csv").read_bytes()
        assert f"{hashlib.sha256(made).hexdigest()}  {name}.csv" in printed
