"""A day of measured data: simulated rides, one after the other, each with other errors of its sensors."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from railsim.measurements import TIME
from railsim.scenario import Scenario
from railsim.simulation import measure, simulate
from railsim.track import spectra, synthesis
from railsim.track.features import with_features
from railsim.track.files import write_track
from railsim.track.joints import RAIL_LENGTH, rail_joints, vertical_shapes
from railsim.track.spectra import Band
from railsim.track.track import Track

RATE = 256.0  # Hz
PIECE = 600.0  # s of one ride
FASTEST = 30.0  # m/s
_JOINTED = (2000.0, 5000.0)  # m
_SPEED = {"kind": "profile", "time": [0, 100, 200, 350, 450, 600], "speed": [20, 28, 28, 22, 22, 20]}
_SENSORS: tuple[dict[str, Any], ...] = (
    {"kind": "gyro", "name": "bogie", "body": "bogie", "axes": ["roll", "pitch", "yaw"], "errors": "mems"},
    {"kind": "accelerometer", "name": "bogie", "body": "bogie", "axes": ["x", "y", "z"], "errors": "mems"},
    {"kind": "accelerometer", "name": "body", "body": "body", "axes": ["z"], "errors": "mems"},
    {"kind": "accelerometer", "name": "axlebox1_left", "body": "wheelset1", "position": [0, 1.0, 0],
     "axes": ["y", "z"], "errors": "axlebox"},
    {"kind": "accelerometer", "name": "axlebox1_right", "body": "wheelset1", "position": [0, -1.0, 0], "axes": ["z"],
     "errors": "axlebox"},
    {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "radius_error": 0.004},
)  # fmt: skip


def write_day(path: Path, duration: float, piece: float = PIECE) -> dict[str, Any]:
    """Write a file of 12 channels (.csv or .parquet) and `map.yaml` beside it.

    Parameters
    ----------
    duration : s. piece : of one ride, s, at most `PIECE`.

    Returns
    -------
    The map.
    """
    frames = _rides(duration, piece)
    first = next(frames)
    if path.suffix == ".csv":
        first.to_csv(path, index=False, float_format="%.10g")
        for frame in frames:
            frame.to_csv(path, index=False, float_format="%.10g", header=False, mode="a")
    else:
        table = pa.Table.from_pandas(first, preserve_index=False)
        with pq.ParquetWriter(path, table.schema) as writer:
            writer.write_table(table)
            for frame in frames:
                writer.write_table(pa.Table.from_pandas(frame, preserve_index=False))
    names = [str(name) for name in first.columns[1:]]
    channels = {name: {"column": name, "unit": name.partition("[")[2].rstrip("]")} for name in names}
    sensors = [{key: value for key, value in sheet.items() if key != "rate"} for sheet in first.attrs["sensors"]]
    table = {"rate": RATE, "time": {"kind": "seconds", "column": TIME}, "channels": channels}
    mapped = {"origin": f"{duration:g} s of simulated rides", "vehicle": "class175", "tables": [table]}
    mapped |= {"sensors": sensors, "speed_source": "wheelset1.speed [m/s]"}
    (path.parent / "map.yaml").write_text(yaml.safe_dump(mapped, sort_keys=False, allow_unicode=True))
    return mapped


def _rides(duration: float, piece: float) -> Iterator[pd.DataFrame]:
    """Channels of ride after ride, their times going on."""
    count = round(piece * RATE)
    with tempfile.TemporaryDirectory() as folder:
        write_track(_track(FASTEST * piece + 100.0), Path(folder) / "line.csv")
        scenario = Scenario.build(_scenario(str(Path(folder) / "line.csv"), piece))
        truth = simulate(scenario, engine="compiled")
        for number in range(int(np.ceil(duration / piece))):
            seen = measure(truth, scenario, seed=number + 1).measurements
            rows = min(count, round(duration * RATE) - number * count)
            time = np.round((number * count + np.arange(rows)) / RATE, 9)
            frame = pd.DataFrame({TIME: time, **{name: seen[name][:rows] for name in seen.channels}})
            frame.attrs["sensors"] = seen.about["sensors"]
            yield frame


def _scenario(track: str, piece: float) -> dict[str, Any]:
    sensors = [{**sensor, "rate": RATE} for sensor in _SENSORS]
    return {
        "track": track, "vehicle": "class175", "speed": _SPEED, "start": 25.0, "duration": piece + 0.5,
        "output_rate": 4 * RATE, "sensors": sensors,
    }  # fmt: skip


def _track(length: float) -> Track:
    """Irregularities of the spectrum erri_low, and a stretch of jointed rails."""
    s = synthesis.distances(length, 0.2)
    band = Band(shortest=2.0, longest=100.0)
    columns = synthesis.faded_irregularities(
        spectra.spectra("erri_low"), s, 0.2, np.random.default_rng(175), band, (25.0, 20.0)
    )
    places = np.arange(_JOINTED[0], min(_JOINTED[1], length - 50.0), RAIL_LENGTH)
    joints = rail_joints(places, ("left", "right"), np.random.default_rng(176))
    left, right = vertical_shapes(s, joints)
    columns["vertical"] = columns["vertical"] + (left + right) / 2
    columns["cross_level"] = columns["cross_level"] + right - left
    rounded = {key: np.round(value, 7) for key, value in columns.items()}
    return with_features(Track(s, rounded, "line", ["A line for a day of data."]), joints)
