"""How long raw data are kept (Ward et al. 2011, section 6): reduced to events and features, then removed.

`features/` of a pruned recording holds every estimate with its tables, `events.json` (what the inspection and the
estimators found) and `seconds.parquet` (mean, standard deviation, least and greatest value of every channel, each
second). The raw data go only after these are on the disk and have been read back.
"""

import os
import shutil
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from experiments.maintenance.condition import tables
from experiments.reporting.outcome import Outcome
from experiments.runs.estimation import Estimates, estimate_all
from railsim.digests import is_whole
from railsim.errors import InputError
from railsim.files import read_json, write_folder_atomically, write_json
from railsim.measurements import Measurements
from railsim.parquet import read_column, read_names, write_frame
from railsim.quality.inspection import Inspection, inspect
from railsim.recording import Recording

DAY = 86400.0  # s
FEATURES = "features"
_RAW = "measured"
_LEAVING = ".measured.leaving"


def prune(folder: Path, after: float, really: bool) -> Outcome:
    """Say what pruning would do; with `really` do it.

    Parameters
    ----------
    folder : of a recording.
    after : age [days] from which raw data go.

    Raises
    ------
    InputError : no recording, or features cannot be written or read back; the raw data then stay.
    """
    if after < 0 or not np.isfinite(after):
        raise InputError(f"--after {after:g}: give an age in days, 0 or more")
    _check_no_links(folder)
    age, by = _age(folder)
    if (folder / _LEAVING).is_dir() and really and age >= after and gone_on(folder):
        return Outcome({"pruned": True, "folder": str(folder)}, f"{folder}: the rest of the raw data was removed")
    recording = Recording.open(folder)
    size = sum(path.stat().st_size for path in (folder / _RAW).rglob("*") if path.is_file())
    facts: dict[str, Any] = {"folder": str(folder), "age [days]": round(age, 3), "age from": by, "raw [bytes]": size}
    if age < after:
        text = f"{folder}: {age:.1f} days old ({by}), raw data stay until {after:g} days"
        return Outcome({**facts, "pruned": False, "due": False}, text)
    inspection = inspect(recording.measurements, progress=True)
    estimates = estimate_all(inspection.cleaned)
    if estimates.failed:
        failed = [str(failure) for failure in estimates.failed.values()]
        text = f"{folder}: raw data stay, as an estimator's features would be lost: {'; '.join(failed)}"
        return Outcome({**facts, "due": True, "pruned": False, "failed": failed}, text, held=False)
    facts |= {"due": True, "pruned": really, "estimates": sorted(estimates.given), "findings": len(inspection.findings)}
    kept = f"{', '.join(sorted(estimates.given)) or 'no estimates'}, events, a row a second of each channel"
    if not really:
        text = f"{folder}: {age:.1f} days old ({by}); {size / 1e6:.2f} MB of raw data would be reduced to: {kept}"
        return Outcome(facts, f"{text}\nnothing was changed; --yes does it")
    _write(recording, inspection, estimates, folder / FEATURES)
    os.rename(folder / _RAW, folder / _LEAVING)
    shutil.rmtree(folder / _LEAVING)
    facts["features [bytes]"] = sum(p.stat().st_size for p in (folder / FEATURES).rglob("*") if p.is_file())
    text = f"{folder}: {size / 1e6:.2f} MB of raw data reduced to {facts['features [bytes]'] / 1e6:.2f} MB: {kept}"
    return Outcome(facts, text)


def seconds(measured: Measurements) -> pd.DataFrame:
    """A row a second and channel: "channel", "time [s]" (its start), mean, std, least, greatest, share of samples."""
    rows = []
    for name in measured:
        values, at = measured[name], measured.time(name)
        edges = np.arange(np.floor(at[0]), at[-1] + 1e-9)
        first = np.searchsorted(at, edges - 1e-9)
        for start, piece in zip(edges, np.split(values, first[1:]), strict=True):
            good = piece[np.isfinite(piece)]
            numbers = (good.mean(), good.std(), good.min(), good.max()) if good.size else (np.nan,) * 4
            rows.append((name, float(start), *map(float, numbers), good.size / max(1, piece.size)))
    return pd.DataFrame(rows, columns=["channel", "time [s]", "mean", "std", "least", "greatest", "share [-]"])


def _check_no_links(folder: Path) -> None:
    """Raise `InputError` where something to be written or removed lies outside the recording, behind a link."""
    for name in (FEATURES, _RAW, _LEAVING):
        for path in (folder / name, *(folder / name).rglob("*")):
            if path.is_symlink():
                raise InputError(f"'{path}' is a link; nothing behind it is touched: put the folder itself there")


def gone_on(folder: Path) -> bool:
    """Go on with a pruning that was stopped: remove the raw data where the features are whole, else put them back.

    Returns
    -------
    Whether the raw data were removed.

    Raises
    ------
    InputError : there are raw data in both places.
    """
    raw, leaving, features = folder / _RAW, folder / _LEAVING, folder / FEATURES
    if raw.exists():
        raise InputError(f"'{leaving}' stands beside '{raw}': raw data in both; move one of them elsewhere")
    if not is_whole(features):
        os.rename(leaving, raw)
        return False
    shutil.rmtree(leaving)
    return True


def _age(folder: Path) -> tuple[float, str]:
    """Days since the recording began, or since it was written; and which."""
    start = read_json(folder / "about.json", "a recording").get("start")
    if isinstance(start, str):
        try:
            began = datetime.fromisoformat(start)
        except ValueError:
            raise InputError(f"about.json: start '{start}' is no ISO 8601 instant; mend or remove it") from None
        began = began if began.tzinfo else began.replace(tzinfo=UTC)
        return (datetime.now(UTC) - began).total_seconds() / DAY, "by its start"
    return (time.time() - (folder / "about.json").stat().st_mtime) / DAY, "by its file"


def _write(recording: Recording, inspection: Inspection, estimates: Estimates, folder: Path) -> None:
    """Write the features and read them back."""
    table = seconds(inspection.cleaned)
    codes = {name: number for number, name in enumerate(inspection.cleaned.channels)}
    numeric = table.assign(channel=[float(codes[name]) for name in table["channel"]]).rename(
        columns={"channel": "channel [-]"}
    )
    with write_folder_atomically(folder) as aside:
        write_frame(aside / "seconds.parquet", numeric)
        for name, estimate in estimates.given.items():
            estimate.save(aside / name, tables(estimate))
        write_json(aside / "events.json", _events(recording, inspection, estimates, codes))
    _check(folder, numeric, estimates.given)


def _events(
    recording: Recording, inspection: Inspection, estimates: Estimates, codes: Mapping[str, int]
) -> dict[str, Any]:
    return {
        "of": recording.folder.name,
        "reduced": datetime.now(UTC).isoformat(timespec="seconds"),
        "channels": list(codes),
        "inspection": [one.stated() for one in inspection.findings],
        "estimators": {name: one.about.get("events", []) for name, one in estimates.given.items()},
        "refused": estimates.refused,
    }


def _check(folder: Path, written: pd.DataFrame, estimates: Mapping[str, Estimate]) -> None:
    """Raise `InputError` where what was written is not what is read."""
    path = folder / "seconds.parquet"
    same = all(np.array_equal(read_column(path, n), written[n], equal_nan=True) for n in read_names(path)[0])
    same = same and all(Estimate.open(folder / name).series.equals(one.series) for name, one in estimates.items())
    if not same:
        raise InputError(f"'{folder}' does not read back as it was written; the raw data stay; check the disk")
