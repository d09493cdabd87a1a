"""Whole files of every format that railsim reads, what reads each, and ways to damage them."""

import json
import shutil
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from hypothesis import strategies as st

from estimators.interface import Estimate
from railsim import Recording, load_scenario
from railsim.digests import MARKER
from railsim.field.guard import Guard
from railsim.field.importing import import_file
from railsim.profiles.files import read_profile
from railsim.track.files import read_track
from tests.field.formats import WRITERS, save_map
from tests.field.positions import gpx, nmea, way

WORDS = [b"\xff" * 8, b"\0" * 8, struct.pack("<q", 2**62), struct.pack("<q", -1), struct.pack("<I", 2**31 - 1), b"\x7f"]
TEXTS = [
    b"nan", b"1e999", b"-1", b'"', b",", b";", b"\n", b"\xef\xbb\xbf", b"\xff\xfe", b"../../x", b"/etc/passwd", b"{}",
    b"[" * 60, b"&a [*a]", b"!!python/object/apply:os.system ['true']", b"null", b"9" * 400, b"\x1b]0;x\x07", b"inf",
    b"#", b"true", b": ", b"- ",
]  # fmt: skip


@dataclass(frozen=True)
class Target:
    """A file to be damaged, and a call that reads it (and may write the folder or file that it is given)."""

    name: str
    file: Path
    read: Callable[[Path], object]
    text: bool
    share: float


@st.composite
def damages(draw: st.DrawFn, text: bool) -> list[tuple[str, float, bytes]]:
    """One to four edits: a kind, a place as a share of the file, bytes."""
    kinds = ["cut", "drop", "double", "put", "over", "zero"]
    words = TEXTS if text else WORDS
    edit = st.tuples(
        st.sampled_from(kinds),
        st.floats(0, 1, allow_nan=False),
        st.one_of(st.sampled_from(words), st.binary(min_size=1, max_size=16)),
    )
    return draw(st.lists(edit, min_size=1, max_size=4))


def damaged(data: bytes, edits: list[tuple[str, float, bytes]]) -> bytes:
    """The bytes after all edits."""
    for kind, share, word in edits:
        at = min(int(share * len(data)), max(len(data) - 1, 0))
        end = at + len(word)
        if kind == "cut":
            data = data[:at]
        elif kind == "drop":
            data = data[:at] + data[end:]
        elif kind == "double":
            data = data[:at] + data[at : at + 64] + data[at:]
        elif kind == "put":
            data = data[:at] + word + data[at:]
        else:
            data = data[:at] + (bytes(len(word)) if kind == "zero" else word) + data[end:]
    return data


def targets(original: Recording, guard: Guard, folder: Path) -> list[Target]:
    """All of them; the files stand in `folder`."""
    short = _short(original, folder / "short")
    found = []
    for kind, write in WRITERS.items():
        place = folder / kind
        place.mkdir()
        path, mapped = write(short.measurements, place)
        map_file = save_map(mapped, place)
        found.append(
            Target(kind, path, _importer(path, map_file, guard), kind == "csv", 0.15 if kind != "csv" else 0.1)
        )
        if kind == "csv":
            found.append(Target("map", map_file, _importer(path, map_file, guard), True, 0.15))
    for part in ("about.json", "measured/256hz.parquet", "track.csv", "truth/about.json", "truth/channels.parquet"):
        found.append(
            Target(
                f"recording {part}",
                short.folder / part,
                lambda _: read_all(short.folder),
                part[-4:] in (".csv", "json"),
                0.04,
            )
        )
    found.append(_track_import(folder / "car", guard))
    found += _tables(folder / "others", short)
    found += [_receiver(folder / "receiver", kind, guard) for kind in ("nmea", "gpx")]
    return found


def read_all(folder: Path) -> None:
    """Everything that a recording holds."""
    recording = Recording.open(folder)
    seen = recording.measurements
    for name in seen.channels:
        assert seen[name].shape == seen.time(name).shape
    if recording.truth is not None:
        for name in recording.truth.columns:
            assert recording.truth[name].ndim == 1
    assert recording.scenario is None or recording.scenario


def _short(original: Recording, folder: Path) -> Recording:
    """The first half of a second, so that damage hits what is not numbers, too."""
    shutil.copytree(original.folder, folder)
    about = folder / "about.json"
    values = json.loads(about.read_text())
    for path in (folder / "measured").iterdir():
        table = pd.read_parquet(path).iloc[: max(4, int(float(path.stem[:-2]) / 2))]
        table.to_parquet(path, index=False)
        values["measured"][path.name]["rows"] = len(table)
    about.write_text(json.dumps(values))
    track = folder / "track.csv"
    track.write_text("".join(track.read_text().splitlines(keepends=True)[:200]))
    for marker in list(folder.rglob(MARKER)):  # without digests, which would stop all damage before it is read
        marker.unlink()
    return Recording.open(folder)


def _importer(path: Path, map_file: Path, guard: Guard) -> Callable[[Path], object]:
    return lambda out: import_file(path, map_file, out / "recording", guard)


def _track_import(folder: Path, guard: Guard) -> Target:
    folder.mkdir()
    s = np.arange(1200) * 0.25
    pd.DataFrame({"km": s / 1e3, "left": np.sin(s), "versine": np.cos(s)}).to_csv(folder / "car.csv", index=False)
    chord = {"behind": 5, "ahead": 5}
    columns = {
        "left_vertical [m]": {"column": "left", "unit": "mm"},
        "lateral [m]": {"column": "versine", "unit": "mm", "chord": chord},
    }
    place = {"column": "km", "unit": "km", "direction": "up"}
    mapped = {
        "kind": "track",
        "origin": "test",
        "kilometrage": place,
        "columns": columns,
        "repair": ["snap", "sort", "fill"],
    }
    map_file = folder / "map.yaml"
    map_file.write_text(yaml.safe_dump(mapped))
    path = folder / "car.csv"
    return Target("car", path, lambda out: import_file(path, map_file, out / "track.csv", guard), True, 0.05)


def _receiver(folder: Path, kind: str, guard: Guard) -> Target:
    folder.mkdir(exist_ok=True)
    path, map_file = folder / f"log.{kind}", folder / f"{kind}.yaml"
    path.write_text(nmea(way(25)) if kind == "nmea" else gpx(way(25)))
    names = ("latitude [deg]", "longitude [deg]", "speed [m/s]")
    channels = {f"gnss.{name}": {"column": name.partition(" ")[0]} for name in names}
    tables = [{"time": {"kind": "own"}, "repair": ["sort", "drop_duplicates", "resample"], "channels": channels}]
    map_file.write_text(yaml.safe_dump({"origin": "test", "vehicle": "manchester", "tables": tables}))
    return Target(kind, path, _importer(path, map_file, guard), True, 0.1)


def _tables(folder: Path, short: Recording) -> list[Target]:
    folder.mkdir()
    track, profile, scenario = folder / "track.csv", folder / "profile.csv", folder / "scenario.yaml"
    track.write_text(
        "# mine\ns [m],vertical [m],curvature [1/m]\n" + "".join(f"{i},{i % 3 / 1e3},0.001\n" for i in range(60))
    )
    root = Path(__file__).parents[2]
    profile.write_bytes((root / "track_data" / "profiles" / "uic60.csv").read_bytes())
    scenario.write_text((root / "scenarios" / "wheel_slide.yaml").read_text())
    estimate = folder / "estimate"
    series = pd.DataFrame({"time [s]": np.arange(50) / 10, "speed [m/s]": np.full(50, 20.0)})
    Estimate("speed_plain", series, {"settings": {}}).save(estimate)
    table = next(path for path in sorted(estimate.rglob("*")) if path.suffix == ".parquet")
    return [
        Target("track", track, lambda _: read_track(track), True, 0.06),
        Target("profile", profile, lambda _: read_profile(profile), True, 0.06),
        Target("scenario", scenario, lambda _: load_scenario(scenario), True, 0.1),
        Target("estimate", table, lambda _: Estimate.open(estimate), False, 0.03),
    ]
