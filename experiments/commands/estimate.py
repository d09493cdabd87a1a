"""`railsim estimate`: run one estimator on a recording.

examples:
  railsim estimate speed_refined recording --out estimate
  railsim estimate my_filter.py recording --out estimate --set window=5
"""

import argparse
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.commands._out import add_overwrite, replaces
from experiments.reporting.logs import tell
from experiments.reporting.outcome import Outcome
from railsim.errors import InputError

if TYPE_CHECKING:
    from estimators.interface import Estimator
    from railsim.measurements import Measurements

_VEHICLE = "vehicle."


def configure(parser: argparse.ArgumentParser) -> None:
    """Estimator, recording and folder, and what the recording lacks."""
    parser.add_argument(
        "name", metavar="ESTIMATOR", help="see 'railsim list estimators'; or the path of a file with one"
    )
    parser.add_argument("recording", metavar="RECORDING", help="folder of a recording")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the estimate")
    parser.add_argument("--speed-source", metavar="CHANNEL", help="channel that gives the speed, or refined")
    parser.add_argument("--start", type=float, metavar="M", help="distance along the track at the first sample, m")
    parser.add_argument(
        "--set",
        action="extend",
        nargs="+",
        default=[],
        metavar="KEY=VALUE",
        help="a setting of the estimator, or a nominal parameter of the vehicle: vehicle.semi_wheelbase=1.3",
    )
    add_overwrite(parser)


def execute(given: argparse.Namespace) -> Outcome:
    """Write the estimate and its picture; of track geometry also deviations a section and isolated defects."""
    from estimators.interface import ESTIMATORS
    from experiments.maintenance.condition import tables
    from experiments.runs.long_record import in_sections, joined
    from railsim.plots.estimate import PICTURE, writer
    from railsim.recording import Recording

    settings, vehicle = _changes(given.set)
    kind = ESTIMATORS.resolve(given.name)
    if given.start is not None:
        if "start" not in kind.model_fields:
            raise InputError(f"{given.name} has no setting 'start': it does not need to know the place; leave it out")
        settings["start"] = given.start
    estimator = kind.build(settings)
    said = replaces(given.out, "estimate", given.overwrite)
    measurements = _completed(Recording.open(given.recording).measurements, vehicle, given.speed_source)
    parts = Path(f"{given.out}.sections")
    if in_sections(estimator, measurements):
        estimator.need(measurements)
        places = _kept_sections(estimator, measurements, parts, Path(given.recording))
        del measurements  # of a long record, memory is wanted for what follows
        estimate = joined(places)
    else:
        estimate = estimator.estimate(measurements)
    more = tables(estimate)
    estimate.save(given.out, more, given.recording, {PICTURE: writer(estimate)})
    shutil.rmtree(parts, ignore_errors=True)
    columns = [str(name) for name in estimate.series.columns]
    result = {"estimator": estimator.name, "estimate": str(given.out), "rows": len(estimate.series), "columns": columns}
    result |= {"tables": list(more), "picture": f"{given.out}/{PICTURE}"}
    line = f"{given.out}: {len(estimate.series)} rows of {', '.join([*columns, *more])}; {PICTURE}"
    return Outcome(result, line if said is None else f"{said}\n{line}")


def _kept_sections(estimator: "Estimator", measurements: "Measurements", parts: Path, recording: Path) -> list[Path]:
    """All sections; one who interrupts is told what was kept."""
    from experiments.runs.long_record import estimate_sections

    try:
        return estimate_sections(estimator, measurements, parts, recording, tell)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted; sections that are done stand in '{parts}': the same command goes on from there"
        ) from None


def _changes(texts: list[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Settings of the estimator, and parameters of the vehicle."""
    from railsim.settings import load_yaml

    settings: dict[str, Any] = {}
    vehicle: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        key = key.strip()
        if not equals or not key:
            raise InputError(f"--set {text}: write key=value, for example vehicle.semi_wheelbase=1.3")
        chosen = load_yaml(value, f"--set {text}: the value")
        if not key.startswith(_VEHICLE):
            settings[key] = chosen
        elif isinstance(chosen, bool) or not isinstance(chosen, int | float):
            raise InputError(f"--set {text}: {value!r} is not a number; give SI units (text needs a point: 1.0e6)")
        else:
            vehicle[key.removeprefix(_VEHICLE)] = chosen
    return settings, vehicle


def _completed(measurements: "Measurements", vehicle: dict[str, Any], source: str | None) -> "Measurements":
    """The measurements with what the options add to their description."""
    from estimators.speed.odometry import speed_channel
    from railsim.measurements import Measurements
    from railsim.quality.draft import tables_of

    if not vehicle and source is None:
        return measurements
    about = {**measurements.about, "vehicle": {**measurements.vehicle, **vehicle}}
    if source is not None:
        about["speed_source"] = source
    completed = Measurements(about, tables_of(measurements), measurements.track)
    speed_channel(completed)
    return completed
