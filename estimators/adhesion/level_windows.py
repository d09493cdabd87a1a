"""Tables of windows of an adhesion level: of several bogies, without what the calibration does not hold for."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from estimators.adhesion.classifier import LEVELS
from estimators.adhesion.level_gates import Gate

COLUMNS = tuple(f"adhesion_{level.replace(' ', '_')} [-]" for level in LEVELS)
LEFT_OUT = 0.05  # share of a window that may be left out
LIKELY = 0.9  # probability of a level from which on it counts as told
LEAST = 1e-6  # probability: one bogie alone does not decide


class Reason(NamedTuple):
    """What would help, and the share of the windows of which nothing can be told."""

    help: str
    share: float


def withheld(
    table: pd.DataFrame, window: float, time: np.ndarray, shut: Sequence[Gate], reasons: dict[str, Reason]
) -> pd.DataFrame:
    """The table without windows that hold what the calibration does not, and `reasons` filled.

    Parameters
    ----------
    window : s. time : of the gates' samples, s, (n,).
    """
    table = table.copy()
    middle = table["time [s]"].to_numpy(float)
    first, last = (np.searchsorted(time, middle + sign * window / 2.0) for sign in (-1.0, 1.0))
    strange = table["unlike_calibration [-]"].to_numpy(float) > 1.0
    closed = [
        *((one.reason, one.help, _share_of(one.closed, first, last) > LEFT_OUT) for one in shut),
        ("unlike all of the calibration", "a calibration of this vehicle as it is", strange),
    ]
    for reason, help_, marks in closed:
        marks = marks & (table["valid [-]"].to_numpy() > 0.5)
        if marks.any():
            reasons[reason] = Reason(help_, float(np.mean(marks)))
            table.loc[marks, [*COLUMNS, "creep_slope [-]", "creep_slope_std [-]"]] = np.nan
            table.loc[marks, "valid [-]"] = 0.0
    return table


def undecided(table: pd.DataFrame, reasons: dict[str, Reason]) -> pd.DataFrame:
    """The table in which windows of no likely level are not valid; their probabilities stay."""
    valid = table["valid [-]"].to_numpy() > 0.5
    unlikely = valid & ~(table[list(COLUMNS)].max(axis=1).to_numpy() >= LIKELY)
    if unlikely.any():
        share = float(np.mean(unlikely))
        reasons[f"no level has a probability of {LIKELY:g}"] = Reason(
            "sensors on more wheelsets, or a longer record", share
        )
    return table.assign(**{"valid [-]": (valid & ~unlikely).astype(float)})


def pooled(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Windows of several bogies on the same rails: geometric mean of those that count at a time."""
    if len(tables) == 1:
        return tables[0]
    count = min(map(len, tables))
    names = [*COLUMNS, "creep_slope [-]", "creep_slope_std [-]", "unlike_calibration [-]", "wheelset_sensors [-]"]
    valid = np.stack([one["valid [-]"].to_numpy(float)[:count] > 0.5 for one in tables])
    values = np.stack([one[names].to_numpy(float)[:count] for one in tables])
    counted = np.where(valid[:, :, None], values, np.nan)
    any_valid = valid.any(axis=0)
    result = np.full(values.shape[1:], np.nan)
    logs = np.nanmean(np.log(np.maximum(counted[:, any_valid, :5], LEAST)), axis=0)
    result[any_valid, :5] = np.exp(logs)
    result[any_valid, :4] /= result[any_valid, :4].sum(axis=1, keepdims=True)
    result[any_valid, 5:] = np.nanmax(counted[:, any_valid, 5:], axis=0)
    table = pd.DataFrame(
        {"time [s]": tables[0]["time [s]"].to_numpy()[:count], **dict(zip(names, result.T, strict=True))}
    )
    table["wheelset_sensors [-]"] = table["wheelset_sensors [-]"].fillna(0.0)
    table = table.assign(**{"valid [-]": any_valid.astype(float)})
    return pd.DataFrame({name: table[name] for name in tables[0].columns})


def with_spare(table: pd.DataFrame, spare: pd.DataFrame) -> pd.DataFrame:
    """The better set where it counts, the other one elsewhere."""
    count = min(len(table), len(spare))
    table, spare = table.iloc[:count].reset_index(drop=True), spare.iloc[:count].reset_index(drop=True)
    return spare.where(~pd.Series(table["valid [-]"].to_numpy() > 0.5), table)


def _share_of(marks: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Share of the marks from each first sample to the last."""
    total = np.concatenate([[0], np.cumsum(marks)])
    return (total[last] - total[first]) / np.maximum(last - first, 1)
