"""What every estimator must do."""

import copy
import json
import re
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate, Estimator
from experiments.conformance.interface import UNIT, Check, described, fields_with_unit_and_source
from experiments.conformance.recordings import first_estimate, fitting
from experiments.scoring.score import score, unscored
from railsim.errors import InputError
from railsim.measurements import TIME, Measurements
from railsim.truth import Truth

Kind = type[Estimator]
_CHANNEL = re.compile(r"\w+\.\w+ \[.+\]")
LOST = slice(0.25, 0.75)  # share of the record that is lost in `lost_samples`
SURER = 0.95  # of a standard deviation: less than that is more certain
DISTANCE = "s [m]"


@cache
def _first(kind: Kind) -> tuple[Estimator, Measurements, Truth, Estimate]:
    estimator = kind.build({})
    return estimator, *first_estimate(estimator)


class _Watched(Measurements):
    """Measurements that remember which channels were read."""

    def __init__(self, measured: Measurements) -> None:
        super().__init__(measured.about, _tables(measured), measured.track)
        self.read: set[str] = set()

    def __getitem__(self, name: str) -> np.ndarray:
        self.read.add(name)
        return super().__getitem__(name)


@cache
def _second(kind: Kind) -> tuple[Estimate, frozenset[str]]:
    """Another estimate from the same recording, and the channels that were read for it."""
    estimator, measured, _, _ = _first(kind)
    watched = _Watched(measured)
    return estimator.estimate(watched), frozenset(watched.read)


def states_what_it_needs(kind: Kind) -> Iterable[str]:
    """It can be made without settings, and names its channels."""
    estimator = kind.build({})
    if not estimator.needed():
        yield "requires no channel; name those that it reads in `requires`"
    for name in estimator.needed():
        if not _CHANNEL.fullmatch(name):
            yield f"requires '{name}', which is not '<sensor>.<quantity> [unit]'"


def estimates(kind: Kind) -> Iterable[str]:
    """A shipped recording gives an estimate."""
    estimator, _, _, estimate = _first(kind)
    if estimate.name != estimator.name:
        yield f"its estimate is called '{estimate.name}', not '{estimator.name}'; pass self.name"


def units_in_every_column(kind: Kind) -> Iterable[str]:
    """Every column is a name with its unit, and holds numbers."""
    series = _first(kind)[3].series
    for name in map(str, series.columns):
        if not UNIT.fullmatch(name):
            yield f"column '{name}' has no unit; name it 'quantity [unit]'"
        elif series[name].dtype.kind not in "fiub":
            yield f"column '{name}' holds {series[name].dtype}, not numbers"
        elif np.isinf(series[name].to_numpy(dtype=float)).any():
            yield f"column '{name}' holds infinity; leave what is not known empty (NaN)"


def about_is_json(kind: Kind) -> Iterable[str]:
    """What it says about itself can be written."""
    try:
        json.dumps(_first(kind)[3].about, allow_nan=False)
    except (TypeError, ValueError) as error:
        yield f"its about is not JSON: {error}"


def pure(kind: Kind) -> Iterable[str]:
    """The same input gives the same bytes, and stays as it was."""
    estimator, measured, _, first = _first(kind)
    before = _state(measured)
    second, _ = _second(kind)
    if _state(measured) != before:
        yield "changes the measurements that it is given"
    if _bytes(first) != _bytes(second):
        yield "gives another estimate for the same measurements; where it is random, take the seed as a setting"


def lost_samples(kind: Kind) -> Iterable[str]:
    """Half of every channel lost: no crash, and what was lost is empty, not valid, or not more certain for it."""
    estimator, measured, truth, whole = _first(kind)
    part, lost = _with_lost(measured)
    try:
        estimate = estimator.estimate(part)
    except InputError as error:
        if "\n" in str(error):
            yield f"refuses a record with lost samples in more than a line: {error}"
        return
    yield from _made_up(estimate, whole, lost, truth)


def names_every_missing_channel(kind: Kind) -> Iterable[str]:
    """Without its channels it says which, all at once."""
    estimator, measured, _, _ = _first(kind)
    said = _refusal(estimator, _without(measured, set(estimator.needed())))
    if said is None:
        yield "estimates although every channel that it requires is missing; call self.need(measurements) first"
        return
    missing = [name for name in estimator.needed() if name not in said]
    if missing:
        yield f"says '{said}' and does not name {', '.join(missing)}, missing as well; call self.need(measurements)"


def adds_what_it_says(kind: Kind) -> Iterable[str]:
    """A channel that is said to add something is read where it is there."""
    estimator, measured, _, _ = _first(kind)
    _, read = _second(kind)
    for name in estimator.adds:
        if not _CHANNEL.fullmatch(name):
            yield f"adds '{name}', which is not '<sensor>.<quantity> [unit]'"
        elif name in estimator.needed():
            yield f"adds '{name}', which it requires as well; leave one of the two out"
        elif name in measured and name not in read:
            yield f"adds '{name}', and does not read it; leave it out of `adds`"


def names_every_missing_parameter(kind: Kind) -> Iterable[str]:
    """Without the vehicle's parameters it says which it needs, all at once."""
    estimator = kind.build({})
    measured, _ = next(fitting(estimator))
    vehicle = measured.vehicle
    said = _refusal(estimator, _with_vehicle(measured, {"name": vehicle.get("name")}))
    if said is None:
        return
    named = [name for name in vehicle if name != "name" and re.search(rf"\b{re.escape(name)}\b", said)]
    if not named:
        yield f"without parameters it says '{said}', which names none"
        return
    again = _refusal(estimator, _with_vehicle(measured, {name: vehicle[name] for name in ("name", *named)})) or ""
    more = [name for name in vehicle if name not in ("name", *named) and re.search(rf"\b{re.escape(name)}\b", again)]
    if more:
        yield f"names {', '.join(named)}, and only when these are given {', '.join(more)}; name all at once"


def scored_or_noted(kind: Kind) -> Iterable[str]:
    """Its estimate has scores, or a note says why not."""
    _, _, truth, estimate = _first(kind)
    scores = score(estimate, truth)
    for name, value in scores.items():
        if not UNIT.fullmatch(name) or not isinstance(value, int | float):
            yield f"score '{name}' is {value!r}; a score is a number under a name with its unit"
    if not scores and not unscored(estimate):
        yield "nothing scores it and nothing says so"


CHECKS: tuple[Check[Kind], ...] = (
    described,
    fields_with_unit_and_source,
    states_what_it_needs,
    estimates,
    units_in_every_column,
    about_is_json,
    pure,
    lost_samples,
    names_every_missing_channel,
    adds_what_it_says,
    names_every_missing_parameter,
    scored_or_noted,
)


def _refusal(estimator: Estimator, measured: Measurements) -> str | None:
    """The line with which it refuses; None where it does not."""
    try:
        estimator.estimate(measured)
    except InputError as error:
        return str(error)
    return None


def _tables(measured: Measurements) -> dict[float, dict[str, np.ndarray]]:
    tables: dict[float, dict[str, np.ndarray]] = {}
    for name in measured:
        table = tables.setdefault(measured.rate(name), {TIME: measured.time(name)})
        table[name] = measured[name].copy()
    return tables


def _without(measured: Measurements, gone: set[str]) -> Measurements:
    """The recording less some channels; where none is left, one that nobody asks for."""
    tables = {rate: {k: v for k, v in table.items() if k not in gone} for rate, table in _tables(measured).items()}
    kept = {rate: table for rate, table in tables.items() if len(table) > 1}
    rate, table = next(iter(tables.items()))
    kept = kept or {rate: {TIME: table[TIME], "other.temperature [K]": np.full(len(table[TIME]), 293.0)}}
    return Measurements(_less(measured.about, gone), kept, measured.track)


def _less(about: Mapping[str, Any], gone: set[str]) -> dict[str, Any]:
    sheets = [{**one, "channels": [n for n in one.get("channels", ()) if n not in gone]} for one in about["sensors"]]
    return {**about, "sensors": [one for one in sheets if one["channels"]]}


def _with_vehicle(measured: Measurements, vehicle: dict[str, Any]) -> Measurements:
    return Measurements({**measured.about, "vehicle": vehicle}, _tables(measured), measured.track)


def _with_lost(measured: Measurements) -> tuple[Measurements, tuple[float, float]]:
    """A copy with a stretch of all channels lost, and the stretch [s]."""
    tables = _tables(measured)
    end = max(float(table[TIME][-1]) for table in tables.values())
    start, stop = LOST.start * end, LOST.stop * end
    for table in tables.values():
        gone = (table[TIME] >= start) & (table[TIME] <= stop)
        for name, values in table.items():
            if name != TIME:
                values[gone] = np.nan
    return Measurements(copy.deepcopy(measured.about), tables, measured.track), (start, stop)


def _made_up(estimate: Estimate, whole: Estimate, lost: tuple[float, float], truth: Truth) -> Iterable[str]:
    """Values in the middle of what was lost that are not marked, or are more certain than with the samples."""
    row, before = (_middle(one.series, lost, truth) for one in (estimate, whole))
    if "valid [-]" in row:
        believed = row["valid [-]"] > 0.5
        row = {name: values[believed] for name, values in row.items()}
    names = [name for name, values in row.items() if np.isfinite(values).any()]
    spreads = [name for name in names if name.rpartition(" [")[0].endswith("_std")]
    values = [name for name in names if name not in (TIME, DISTANCE, "valid [-]", *spreads)]
    if values and not spreads:
        yield f"{', '.join(values)}: values where all samples are lost, without a mark ('valid [-]') or a deviation"
    elif values and not any(_typical(row[name]) > SURER * _typical(before[name]) for name in spreads):
        yield f"{', '.join(values)}: more certain where all samples are lost than with them"


def _middle(series: pd.DataFrame, lost: tuple[float, float], truth: Truth) -> dict[str, np.ndarray]:
    """Columns in the middle fifth of what was lost; a distance without times counts from the start of the record."""
    centre, half = 0.5 * (lost[0] + lost[1]), 0.1 * (lost[1] - lost[0])
    columns = {str(name): series[name].to_numpy(dtype=float) for name in series.columns}
    travelled = truth[DISTANCE] - truth[DISTANCE][0]
    time = columns[TIME] if TIME in columns else np.interp(columns[DISTANCE], travelled, truth.time)
    return {name: values[abs(time - centre) <= half] for name, values in columns.items()}


def _typical(values: np.ndarray) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else -np.inf


def _state(measured: Measurements) -> list[bytes]:
    track = [] if measured.track is None else [measured.track.to_numpy().tobytes()]
    about = json.dumps(measured.about, sort_keys=True, default=str).encode()
    return [about, *track, *(measured[name].tobytes() for name in measured)]


def _bytes(estimate: Estimate) -> list[bytes]:
    about = json.dumps(estimate.about, sort_keys=True, default=str).encode()
    columns = [str(name).encode() for name in estimate.series.columns]
    return [about, *columns, *(estimate.series[name].to_numpy().tobytes() for name in estimate.series)]
