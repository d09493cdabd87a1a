"""`railsim condition`: sections, defects and changes of the track for maintenance: tables, a map and a page.

examples:
  railsim condition results/default/estimates/track_smoother --out condition
"""

import argparse
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.commands._out import add_overwrite
from experiments.reporting.outcome import Outcome
from railsim.errors import InputError
from railsim.files import read_json

if TYPE_CHECKING:
    from estimators.interface import Estimate
    from experiments.maintenance.positions import Positions

_WORST = 10  # defects in the text


def configure(parser: argparse.ArgumentParser) -> None:
    """Estimates, what they are held against and compared with, and the folder."""
    parser.add_argument("estimates", metavar="ESTIMATE", nargs="+", help="folders of estimates of one recording")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the tables, the map and the page")
    parser.add_argument(
        "--line-speed",
        metavar="KMH|FILE",
        help="km/h, or a CSV file with 'from [m]' or 'from [km]', and 'line speed [km/h]' (else the speed travelled)",
    )
    parser.add_argument("--kilometre", type=float, metavar="KM", help="kilometre of the line where s is 0")
    parser.add_argument("--falling", action="store_true", help="the vehicle ran against the kilometrage")
    parser.add_argument(
        "--before",
        metavar="ESTIMATE",
        nargs="+",
        action="append",
        default=[],
        help="estimates of an earlier pass over the same track; once for each pass",
    )
    parser.add_argument("--limits", metavar="FILE", help="limits of your own (YAML) in place of those of EN 13848")
    parser.add_argument("--recording", metavar="DIR", help="recording with latitude and longitude, for the map")
    add_overwrite(parser)


def execute(given: argparse.Namespace) -> Outcome:
    """Write tables, GeoJSON and page; say the worst."""
    from experiments.maintenance.kilometre import Kilometre
    from experiments.maintenance.limits import read_limits, shipped
    from experiments.maintenance.line_speed import line_speed
    from experiments.maintenance.report import report
    from experiments.reporting.text import table
    from railsim.files import write_folder_atomically

    out = Path(given.out)
    if (out / "about.json").exists() and not given.overwrite:
        raise InputError(f"'{out}' holds a recording or an estimate, which would be lost; name another folder")
    runs = _runs(given.estimates, [folder for run in given.before for folder in run])
    limits = read_limits(Path(given.limits)) if given.limits else shipped()
    origin, start, positions, note = _recording(given)
    if given.falling and given.kilometre is None:
        raise InputError("--falling says how the kilometrage runs; add --kilometre KM, that where s is 0")
    along = Kilometre(given.kilometre, given.falling)
    made = report(origin, runs, limits, line_speed(given.line_speed, along), positions, start, along)
    with write_folder_atomically(out) as aside:
        for name, write in made.writers().items():
            write(aside / name)
    notes = [*made.notes, *([note] if note else [])]
    worst = made.tables["defects.csv"].head(_WORST)
    lines = [f"{out}: {', '.join(made.writers())}", *(f"note: {one}" for one in notes)]
    lines.append(", ".join(f"{name}: {count}" for name, count in made.counts.items()))
    shown = [
        "quantity",
        "level",
        "kilometre" if along.known else "s [m]",
        "size [mm or mm/m]",
        "limit [mm or mm/m]",
        "speed [km/h]",
    ]
    lines += [table(shown, worst[shown].to_numpy().tolist(), decimals=1)] if len(worst) else ["no defects"]
    result = {"condition": str(out), "files": list(made.writers()), "counts": made.counts, "notes": notes}
    return Outcome(result, "\n".join(lines))


def _runs(latest: list[str], before: list[str]) -> Iterator[tuple["Estimate", list["Estimate"]]]:
    """Each estimate with those of earlier passes by the same estimator, opened when it is their turn.

    Raises
    ------
    InputError : an earlier estimate has none beside it.
    """
    from estimators.interface import Estimate

    names = [read_json(Path(one) / "about.json", "an estimate").get("name") for one in latest]
    earlier = {one: read_json(Path(one) / "about.json", "an estimate").get("name") for one in before}
    for name in earlier.values():
        if name not in names:
            listed = ", ".join(map(str, names))
            raise InputError(f"--before: an estimate of {name} has none beside it; there are: {listed}")
    for folder, name in zip(latest, names, strict=True):
        yield Estimate.open(folder), [Estimate.open(one) for one, other in earlier.items() if other == name]


def _recording(given: argparse.Namespace) -> tuple[str, str | None, "Positions | None", str | None]:
    """(origin, instant of time 0, positions, what is to be said of them) of the recording of the estimates."""
    from experiments.maintenance.positions import positions_of
    from railsim.recording import read_measurements

    folder = Path(given.recording) if given.recording else _stated(Path(given.estimates[0]))
    if folder is None:
        return "condition of the track", None, None, "no map: the recording has gone; name it by --recording"
    seen = read_measurements(folder)
    start = seen.about.get("start")
    at = start if isinstance(start, str) else None
    try:
        return str(seen.about["origin"]), at, positions_of(seen), None
    except InputError as error:
        if given.recording:
            raise
        return str(seen.about["origin"]), at, None, f"no map: {error}"


def _stated(folder: Path) -> Path | None:
    """The recording that an estimate was made of, where it is still there."""
    stated: Any = read_json(folder / "about.json", "an estimate").get("recording")
    found = Path(os.path.normpath(folder / stated)) if isinstance(stated, str) else None
    return found if found is not None and found.is_dir() else None
