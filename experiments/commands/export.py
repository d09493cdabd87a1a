"""`railsim export`: write a recording or an estimate as one file for other programs, with units and names.

examples:
  railsim export recording --to recording.csv
  railsim export estimate --to condition.geojson --recording recording
"""

import argparse
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.reporting.outcome import Outcome
from railsim.errors import InputError
from railsim.files import read_json

if TYPE_CHECKING:
    from railsim.field.writers.interface import Content


def configure(parser: argparse.ArgumentParser) -> None:
    """What to export, and the file."""
    parser.add_argument("what", metavar="RECORDING|ESTIMATE", help="folder of a recording or of an estimate")
    parser.add_argument(
        "--to",
        metavar="FILE",
        required=True,
        help="file ending in .csv, .parquet, .mat, .mf4 or .mcap; of an estimate also .geojson or .html, a map",
    )
    parser.add_argument(
        "--map", metavar="MAP.yaml", help="also write the map by which 'railsim import' reads the file of a recording"
    )
    parser.add_argument("--recording", metavar="DIR", help="for a map: recording that holds latitude and longitude")
    parser.add_argument("--section", type=float, metavar="M", help="for a map: length of a section, m (100)")
    parser.add_argument("--overwrite", action="store_true", help="replace files that are there already")


def execute(given: argparse.Namespace) -> Outcome:
    """Write the file, and say what stands in it."""
    from railsim.field.exporting import MAPS, check_free, export

    what, path = Path(given.what), Path(given.to)
    kind = _kind(what)
    if path.resolve().is_relative_to(what.resolve()):
        raise InputError(f"--to '{path}' lies within the {kind} itself; name a file outside of it")
    if given.map:
        _check_map(kind, path, Path(given.map), given.overwrite)
    check_free(path, given.overwrite)
    if path.suffix.lower() in MAPS:
        return _map(given, what, kind, path)
    if given.recording or given.section:
        raise InputError(f"--recording and --section are for a map ({', '.join(MAPS)}); leave them out")
    content = _content(what, kind)
    export(content, path, given.overwrite)
    result = {"exported": str(path), "kind": kind, "sheets": {one.label: list(one.columns) for one in content.sheets}}
    lines = [f"{path}: {kind} '{what}'"]
    lines += [f"  {one.label}: {len(one.axis)} rows of {', '.join(one.columns)}" for one in content.sheets]
    if given.map:
        _write_map(what, path, Path(given.map), given.overwrite)
        result["map"] = str(given.map)
        lines.append(f"{given.map}: map of it, for 'railsim import {path} --map {given.map} --out DIR'")
    return Outcome(result, "\n".join(lines))


def _map(given: argparse.Namespace, folder: Path, kind: str, path: Path) -> Outcome:
    """Condition on a map.

    Raises
    ------
    InputError : no estimate, no recording with positions, or a section that is no length.
    """
    from estimators.interface import Estimate
    from experiments.maintenance.condition import is_track
    from experiments.maintenance.condition_map import SECTION, features, without_place
    from experiments.maintenance.map_page import page
    from experiments.maintenance.positions import positions_of
    from experiments.maintenance.traces import traces
    from railsim.field.exporting import write_whole
    from railsim.recording import read_measurements

    if kind != "estimate":
        raise InputError(f"'{path.suffix}' shows an estimate on a map; run 'railsim estimate NAME {folder} --out DIR'")
    section = SECTION if given.section is None else given.section
    if not 5.0 <= section < 1e6:
        raise InputError(f"--section {section:g}: give a length of 5 m or more")
    estimate = Estimate.open(folder)
    source = Path(given.recording) if given.recording else _recording_of(folder)
    seen = read_measurements(source)
    start = seen.about.get("start")
    found = features(estimate, positions_of(seen), start if isinstance(start, str) else None, section)
    count, lost = len(found["features"]), without_place(found)
    said = f"{count} sections, defects and events" + (f", {lost} of them without a position" if lost else "")
    if path.suffix.lower() == ".html":
        lines = [str(seen.about["origin"]), f"{said}; sections of {section:g} m"]
        drawn = traces(estimate) if is_track(estimate) else []
        text = page(f"{estimate.name} on the map", found, lines, drawn)
    else:
        text = json.dumps(found, allow_nan=False, ensure_ascii=False) + "\n"
    write_whole(path, lambda aside: _text(aside, text), given.overwrite)
    result = {"exported": str(path), "kind": kind, "features": count, "without_position": lost}
    return Outcome(result, f"{path}: {said}, positions of '{source}'")


def _recording_of(folder: Path) -> Path:
    """The recording that an estimate was made of.

    Raises
    ------
    InputError : the estimate does not say, or it has gone.
    """
    stated = read_json(folder / "about.json", "an estimate").get("recording")
    if not isinstance(stated, str):
        raise InputError(f"'{folder}' does not say which recording it was made of; add --recording DIR")
    found = Path(os.path.normpath(folder / stated))
    if not found.is_dir():
        raise InputError(f"the recording '{found}' that the estimate was made of has gone; add --recording DIR")
    return found


def _kind(folder: Path) -> str:
    """recording or estimate.

    Raises
    ------
    InputError : the folder is neither.
    """
    if not folder.is_dir():
        raise InputError(f"there is no folder '{folder}'; name a recording or an estimate")
    about = read_json(folder / "about.json", "a recording or an estimate")
    if "origin" in about:
        return "recording"
    if "about" in about:
        return "estimate"
    raise InputError(f"'{folder}' is neither a recording nor an estimate; name the folder that --out named")


def _content(folder: Path, kind: str) -> "Content":
    from railsim.field.exporting import recording_content
    from railsim.field.writers.interface import Content, Sheet
    from railsim.recording import read_measurements

    if kind == "recording":
        return recording_content(read_measurements(folder))
    from estimators.interface import Estimate

    estimate = Estimate.open(folder)
    columns = {str(name): estimate.series[name].to_numpy(dtype=float) for name in estimate.series.columns}
    return Content(f"estimate of {estimate.name}", [Sheet(estimate.name, columns)])


def _check_map(kind: str, path: Path, map_path: Path, overwrite: bool) -> None:
    from railsim.field.exporting import check_free, check_readable

    if kind != "recording":
        raise InputError("--map is for recordings: an estimate is not imported; leave it out")
    if map_path.resolve() == path.resolve():
        raise InputError("--map and --to name the same file; name two")
    check_readable(path)
    check_free(map_path, overwrite)


def _write_map(folder: Path, path: Path, map_path: Path, overwrite: bool) -> None:
    from railsim.field.exporting import import_map, write_whole
    from railsim.recording import read_measurements
    from railsim.settings import dump_yaml

    mapped = import_map(read_measurements(folder), path)
    text = dump_yaml(mapped)
    write_whole(map_path, lambda aside: _text(aside, text), overwrite)


def _text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
