"""A recording as loggers would write it: foreign units, one sign turned round, seven formats; and the map to it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from railsim.measurements import Measurements
from tests.field.matlab import seven

FOREIGN = {"rad/s": ("deg/s", 180 / np.pi), "m/s2": ("g", 1 / 9.80665), "m/s": ("km/h", 3.6), "m": ("mm", 1e3)}
TURNED = "_y [m/s2]"
"""Channels that are mounted the wrong way round."""

Written = tuple[Path, dict[str, Any]]


def tables(seen: Measurements) -> dict[float, dict[str, np.ndarray]]:
    """By rate: "t" in ms, and the channels in foreign units."""
    found: dict[float, dict[str, np.ndarray]] = {}
    for name in seen.channels:
        factor = FOREIGN[name.rpartition("[")[2][:-1]][1] * (-1 if name.endswith(TURNED) else 1)
        table = found.setdefault(seen.rate(name), {"t": 1e3 * seen.time(name)})
        table[_column(name)] = factor * seen[name]
    return found


def table_map(names: list[str], rate: float, **more: Any) -> dict[str, Any]:
    """One entry of a map's `tables`."""
    return {
        "time": {"kind": "seconds", "column": "t", "unit": "ms"},
        "rate": rate,
        "channels": {
            name: {
                "column": _column(name),
                "unit": FOREIGN[name.rpartition("[")[2][:-1]][0],
                "sign": -1 if name.endswith(TURNED) else 1,
            }
            for name in names
        },
        **more,
    }


def whole_map(seen: Measurements, **more: Mapping[float, dict[str, Any]] | Any) -> dict[str, Any]:
    """The map for all tables; `groups` gives further keys by rate."""
    groups = more.pop("groups", {})
    rates = sorted({seen.rate(name) for name in seen.channels})
    sensors = [{key: value for key, value in sheet.items() if key != "rate"} for sheet in seen.about["sensors"]]
    return {
        "origin": "written by a test",
        "vehicle": seen.vehicle["name"],
        "tables": [
            table_map([n for n in seen.channels if seen.rate(n) == rate], rate, **groups.get(rate, {}))
            for rate in rates
        ],
        "sensors": sensors,
        **more,
    }


def write_csv(seen: Measurements, folder: Path) -> Written:
    """One wide table at the highest rate; slower channels leave cells empty; decimal commas, semicolons."""
    wide = _wide(tables(seen))
    path = folder / "data.csv"
    wide.to_csv(path, sep=";", decimal=",", index=False)
    mapped = whole_map(seen, groups={rate: {"rows": "filled"} for rate in tables(seen)})
    return path, mapped


def write_parquet(seen: Measurements, folder: Path) -> Written:
    """As the text, in one Parquet table."""
    path = folder / "data.parquet"
    _wide(tables(seen)).to_parquet(path)
    return path, whole_map(seen, groups={rate: {"rows": "filled"} for rate in tables(seen)})


def write_mdf4(seen: Measurements, folder: Path) -> Written:
    """A channel group a rate, its master in s, units in the file."""
    from asammdf import MDF, Signal

    path = folder / "data.mf4"
    groups = {}
    with MDF(version="4.10") as file:
        for number, (rate, table) in enumerate(sorted(tables(seen).items())):
            stamps = table["t"] / 1e3
            signals = [
                Signal(samples=values, timestamps=stamps, name=name, unit=_unit(name, seen))
                for name, values in table.items()
                if name != "t"
            ]
            file.append(signals, acq_name=f"at {rate:g}")
            groups[rate] = {"group": number if number else f"at {rate:g}", "time": {"kind": "own"}}
        file.save(path, overwrite=True)
    return path, whole_map(seen, groups=groups)


def write_tdms(seen: Measurements, folder: Path) -> Written:
    """A group a rate; the slowest as a waveform, the others with a channel of time."""
    from nptdms import ChannelObject, TdmsWriter

    path = folder / "data.tdms"
    groups: dict[float, dict[str, Any]] = {}
    with TdmsWriter(path) as file:
        for number, (rate, table) in enumerate(sorted(tables(seen).items())):
            wave = {"wf_increment": 1 / rate, "wf_start_offset": 0.0} if number == 0 else {}
            for name, values in table.items():
                unit = {} if name == "t" else {"unit_string": _unit(name, seen)}
                file.write_segment([ChannelObject(f"{rate:g} Hz", name, values, properties=wave | unit)])
            groups[rate] = {"group": f"{rate:g} Hz", **({"time": {"kind": "own"}} if number == 0 else {})}
    return path, whole_map(seen, groups=groups)


def write_mat(seen: Measurements, folder: Path) -> Written:
    """A struct a rate, units beside the vectors."""
    from scipy.io import savemat

    structs, groups = _structs(seen)
    path = folder / "data.mat"
    savemat(path, structs, long_field_names=True, do_compression=True)
    return path, _with_fields(whole_map(seen, groups=groups))


def write_mat73(seen: Measurements, folder: Path) -> Written:
    """The same as MATLAB saves it by -v7.3."""
    structs, groups = _structs(seen)
    return seven(folder / "data.mat", structs), _with_fields(whole_map(seen, groups=groups))


def _structs(seen: Measurements) -> tuple[dict[str, Any], dict[float, dict[str, Any]]]:
    structs, groups = {}, {}
    for rate, table in tables(seen).items():
        units = {_field(name): _unit(name, seen) for name in table if name != "t"}
        structs[f"r{rate:g}"] = {_field(name): values for name, values in table.items()} | {"units": units}
        groups[rate] = {"group": f"r{rate:g}"}
    return structs, groups


def write_hdf5(seen: Measurements, folder: Path) -> Written:
    """As a measuring train writes RCM-DX: a data source a rate with timestamps, a group a channel."""
    import h5py

    path, groups = folder / "data.rcmdx", {}
    start = 1_714_730_400_000_000_000
    with h5py.File(path, "w") as file:
        for rate, table in tables(seen).items():
            source = file.create_group(f"RCMDX/20240503_100000.000/TRAIN/SYSTEM/RATE_{rate:g}")
            stamps = start + np.rint(1e6 * table["t"]).astype(np.int64)
            source.create_dataset("timestamp", data=stamps, compression="gzip", chunks=True)
            for name, values in table.items():
                if name != "t":
                    data = source.create_dataset(f"{_field(name)}/data", data=values, compression="gzip", chunks=True)
                    data.attrs["Unit"] = _unit(name, seen)
            groups[rate] = {"group": f"RATE_{rate:g}", "time": {"kind": "own"}}
    return path, _with_fields(whole_map(seen, groups=groups))


def _field(name: str) -> str:
    return name.replace(" ", "_")


def _with_fields(mapped: dict[str, Any]) -> dict[str, Any]:
    for table in mapped["tables"]:
        for channel in table["channels"].values():
            channel["column"] = _field(channel["column"])
    return mapped


WRITERS: dict[str, Callable[[Measurements, Path], Written]] = {
    "csv": write_csv,
    "parquet": write_parquet,
    "mdf4": write_mdf4,
    "tdms": write_tdms,
    "mat": write_mat,
    "mat73": write_mat73,
    "hdf5": write_hdf5,
}


def save_map(mapped: dict[str, Any], folder: Path) -> Path:
    """The map as a YAML file."""
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump(mapped, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return path


def _wide(parts: Mapping[float, dict[str, np.ndarray]]) -> pd.DataFrame:
    frames = [pd.DataFrame(table).set_index("t") for _, table in sorted(parts.items(), reverse=True)]
    return pd.concat(frames, axis=1).reset_index()


def _column(name: str) -> str:
    return name.partition(" [")[0].replace(".", " ")


def _unit(column: str, seen: Measurements) -> str:
    name = next(name for name in seen.channels if _column(name) == column)
    return FOREIGN[name.rpartition("[")[2][:-1]][0]
