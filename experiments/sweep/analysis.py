"""Numbers of a report: responses, sensitivity indices, best and worst points, cost against score, memory."""

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import sobol_indices

from experiments.sweep.design import INDICES
from experiments.sweep.selection import Selection
from experiments.sweep.task import OK, UNFIT

Frame = Any
"""A pandas.DataFrame; its stubs do not follow selections and groups."""

RESPONSE = "response"
FEW = 3  # best and worst points that are shown
MOST_RESPONSES = 8
SETTLED = 50  # runs after which memory has to stay where it is
NEAR_BEST = 1.1  # a score within 10 % of the best one is as good
_SMALLER = ("error", "bias", "deviation", "false", "delay", "rms", "std [")


def scored(frame: Frame) -> Frame:
    """The rows that hold a number, with the column "response" (`"score [unit]"`)."""
    return with_response(frame[is_scored(frame)])


def is_scored(frame: Frame) -> Any:
    """Which rows hold a number."""
    return (frame["status"] == OK) & frame["value"].notna()


def with_response(rows: Frame) -> Frame:
    """The rows with the column "response"; rows of one score share its text."""
    pairs = rows[["score", "unit"]].drop_duplicates()
    names = {(score, unit): f"{score} [{unit}]" for score, unit in pairs.itertuples(index=False, name=None)}
    found = [names[pair] for pair in zip(rows["score"], rows["unit"], strict=True)]
    return rows.assign(**{RESPONSE: pd.Series(found, rows.index, dtype=rows["score"].dtype)})


def needs_a_word(frame: Frame) -> Any:
    """Which rows failed or say something."""
    return (frame["status"] != OK) | (frame["message"] != "")


def responses(scores: Frame, wanted: Sequence[str]) -> list[str]:
    """Scores to show: those asked for that there are, else the first error of each estimator."""
    there = list(dict.fromkeys(scores[RESPONSE]))
    if wanted:
        return [name for name in wanted if name in there]
    return list(dict.fromkeys(main_responses(scores).values()))[:MOST_RESPONSES]


def smaller_is_better(response: str) -> bool:
    """Whether a score is an error."""
    return any(word in response for word in _SMALLER) and not response.startswith("within")


def per_point(scores: Frame, response: str, factors: Sequence[str]) -> Frame:
    """Mean over the noise seeds: a row a point, sensor set and estimator, with the design values."""
    chosen = scores[scores[RESPONSE] == response]
    keys = ["point", *factors, "sensors", "estimator"]
    return chosen.groupby(keys, sort=False, dropna=False, as_index=False)["value"].mean()


def extremes(scores: Frame, response: str, factors: Sequence[str]) -> Frame:
    """The `FEW` best and worst points of each estimator."""
    parts = []
    for _, group in per_point(scores, response, factors).groupby("estimator", sort=False):
        size = group["value"].abs() if smaller_is_better(response) else -group["value"]
        ordered = group.assign(size=size).sort_values(["size", "point"], kind="stable").drop(columns="size")
        few = min(FEW, len(ordered) // 2)
        for name, part in (("best", ordered.head(few)), ("worst", ordered.tail(few).iloc[::-1])):
            parts.append(part.assign(**{"": name}))
    return pd.concat(parts) if parts else pd.DataFrame()


def messages(bad: Frame) -> Frame:
    """Failures and notes by status and estimator, with the number of rows and the first point."""
    keys = ["status", "estimator", "message"]
    counted = bad.groupby(keys, sort=False, dropna=False, as_index=False).agg(
        rows=("point", "size"), first_point=("point", "min")
    )
    return counted.sort_values(["status", "rows"], ascending=[True, False], kind="stable")


def indices(scores: Frame, response: str, factors: Sequence[str], design: Mapping[str, Any]) -> tuple[Frame, list[str]]:
    """First and total order Sobol' indices of a response, with 95 % bootstrap intervals, by estimator.

    `scipy.stats.sobol_indices` (Saltelli et al., 2010) on the mean over the seeds.

    Returns
    -------
    Columns "estimator", "sensors", "factor", "first", "first_low", "first_high", "total", "total_low", "total_high";
    and lines on estimators that lack points.
    """
    rows, notes = [], []
    if design.get("kind") != INDICES:
        return pd.DataFrame(), notes
    base, total = int(design["base"]), int(design["points"])
    for (label, sensors), group in per_point(scores, response, factors).groupby(["estimator", "sensors"], sort=False):
        values = group.set_index("point")["value"].reindex(range(total)).to_numpy(float)
        missing = int(np.isnan(values).sum())
        if missing or np.ptp(values) == 0.0:
            reason = f"{missing} of {total} points have no value" if missing else "all values are equal"
            notes.append(f"{label}, {response}: no indices, {reason}")
            continue
        first, second, mixed = values[:base], values[base : 2 * base], values[2 * base :].reshape(len(factors), base)
        given = {"f_A": first[None], "f_B": second[None], "f_AB": mixed[:, None]}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a bootstrap of few points warns that its interval is degenerate
            result = sobol_indices(func=given, n=base)
            spread = result.bootstrap(confidence_level=0.95, n_resamples=499)
        for index, name in enumerate(factors):
            row = {"estimator": label, "sensors": sensors, "factor": name}
            for order, mean, interval in (
                ("first", result.first_order, spread.first_order),
                ("total", result.total_order, spread.total_order),
            ):
                bounds = interval.confidence_interval
                row[order] = float(mean.ravel()[index])
                row[f"{order}_low"], row[f"{order}_high"] = (
                    float(np.ravel(bounds.low)[index]),
                    float(np.ravel(bounds.high)[index]),
                )
            rows.append(row)
    return pd.DataFrame(rows), notes


def by_set(scores: Frame, response: str, costs: Mapping[str, float]) -> Frame:
    """Cost and mean score of every estimator that a set of sensors serves; "front": no cheaper set is as good.

    Scores are averaged over points and seeds, errors by their size; sets without a cost are left out.
    """
    chosen = scores[(scores[RESPONSE] == response) & scores["sensors"].isin(list(costs))]
    if smaller_is_better(response):
        chosen = chosen.assign(value=chosen["value"].abs())
    mean = chosen.groupby(["estimator", "sensors"], sort=False, as_index=False)["value"].mean()
    mean["cost"] = mean["sensors"].map(dict(costs)).astype(float)
    return mean.assign(
        front=_pareto_front(mean["cost"].to_numpy(), mean["value"].to_numpy(), smaller_is_better(response))
    )


def _pareto_front(cost: np.ndarray, value: np.ndarray, smaller: bool) -> np.ndarray:
    """Whether no other has at most this cost and a value as good, one of them strictly."""
    loss = value if smaller else -value
    beaten = [
        bool(np.any((cost <= c) & (loss <= v) & ((cost < c) | (loss < v)))) for c, v in zip(cost, loss, strict=True)
    ]
    return ~np.array(beaten, dtype=bool)


def smallest_sets(
    estimators: Sequence[str], bad: Frame, scores: Frame, costs: Mapping[str, float], panels: Mapping[str, Any]
) -> Frame:
    """For every panel and estimator the cheapest set that serves it, and the cheapest within 10 % of its best.

    Parameters
    ----------
    estimators : of the sweep, in their order. bad : rows that failed or say something.
    panels : by title "score" and "at"; an estimator that has none of their scores stands with its own first error, and
        one that no set serves with the reason.
    """
    rows, shown = [], set()
    for title, panel in panels.items():
        mine = chosen_points(scores, panel["at"])
        for label, part in mine[mine[RESPONSE] == panel["score"]].groupby("estimator", sort=False):
            row = _smallest(part, panel["score"], costs)
            if row:
                shown.add(label)
                rows.append({"quantity": title, "estimator": label} | row)
    for label in estimators:
        mine = scores[scores["estimator"] == label]
        if label in shown:
            continue
        if mine.empty:
            own = bad[bad["estimator"] == label]
            why = own[own["status"] != UNFIT] if (own["status"] != UNFIT).any() else own
            rows.append({"quantity": "", "estimator": label, "score": f"none: {next(iter(why['message']))}"})
            continue
        row = _smallest(mine, _main_response(mine), costs)
        if row:
            rows.append({"quantity": "", "estimator": label} | row)
    return pd.DataFrame(rows)


def chosen_points(frame: Frame, at: Mapping[str, Any]) -> Frame:
    """The rows of the points that a selection names."""
    if not at or frame.empty:
        return frame
    selection = Selection(tuple((name, tuple(chosen)) for name, chosen in at.items()))
    factors = frame[list(at)].to_dict("records")
    return frame[[selection.has(one) for one in factors]]


def _smallest(mine: Frame, response: str, costs: Mapping[str, float]) -> dict[str, Any]:
    """Cheapest and cheapest near best of one estimator; empty where no set with a cost serves it."""
    table = by_set(mine, response, costs).sort_values(["cost", "value"], kind="stable").reset_index(drop=True)
    if table.empty:
        return {}
    smaller = smaller_is_better(response)
    best = float(table["value"].min() if smaller else table["value"].max())
    good = table[table["value"] <= NEAR_BEST * best] if smaller else table[table["value"] >= best / NEAR_BEST]
    first, near = table.iloc[0], good.iloc[0]
    found = {"score": response, "cheapest": first["sensors"], "cost": first["cost"], "value": first["value"]}
    return found | {
        "cheapest near best": near["sensors"],
        "its cost": near["cost"],
        "its value": near["value"],
        "best value": best,
    }


def _main_response(mine: Frame) -> str:
    """The estimator's first score that is an error, else its first one."""
    names = list(dict.fromkeys(mine[RESPONSE]))
    return next((name for name in names if smaller_is_better(name)), names[0])


def main_responses(scores: Frame) -> dict[str, str]:
    """By estimator the score that stands for it where sets of sensors are compared."""
    return {str(label): _main_response(mine) for label, mine in scores.groupby("estimator", sort=False)}


def memory(facts: Sequence[Mapping[str, Any]]) -> tuple[dict[str, np.ndarray], float | None]:
    """Resident memory [bytes] of each worker over its tasks, and the largest growth after the first `SETTLED` tasks.

    Growth of a worker: its largest memory after the sweep's first `SETTLED` tasks over that at the last of its tasks
    among these (or the first one after), minus 1. None where no worker has tasks beyond.
    """
    series: dict[str, list[tuple[int, float]]] = {}
    for place, one in enumerate(facts):
        series.setdefault(one["worker"], []).append((place, float(one["rss"])))
    growth: list[float] = []
    for points in series.values():
        before = [rss for place, rss in points if place < SETTLED]
        after = [rss for place, rss in points if place >= SETTLED]
        if len(after) > 1 and (before or after):
            start = before[-1] if before else after[0]
            growth.append(max(after) / start - 1.0)
    return {name: np.array(points) for name, points in series.items()}, max(growth) if growth else None
