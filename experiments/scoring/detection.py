"""How soon a damper that failed is called so, and what is called so though it is not: scores of a run's verdicts."""

import numpy as np

from estimators.interface import Estimate
from estimators.suspension.verdicts import BAD, COMPONENTS, HOLLOW, WORN, said, std_name
from estimators.vehicle.affine import PARAMETERS, nominal
from railsim.effects.interface import EFFECTS
from railsim.truth import Truth

ASKED = 15.0  # s from which on a verdict is asked for; the filters start from nothing


def damping_left(truth: Truth) -> tuple[np.ndarray, np.ndarray]:
    """Share of the lateral and yaw damping that the run had at its end, and since when (s), shapes (2,)."""
    share, onset, kinds = np.ones(2), np.zeros(2), EFFECTS.classes()
    dampers = [name.partition(" [")[0] for name in PARAMETERS[:2]]
    for effect in truth.about.get("effects", []):
        damping = kinds[effect["kind"]].weakens if effect.get("kind") in kinds else ""
        if damping in dampers:
            which = dampers.index(damping)
            share[which] *= float(effect["factor"])
            onset[which] = max(onset[which], float(effect.get("onset", 0.0)))
    return share, onset


def score_detection(estimate: Estimate, truth: Truth) -> dict[str, float]:
    """Verdicts ("degraded", "failed") of the secondary dampers against the faults that the run had.

    Returns
    -------
    "detected [-]" and, where it is 1, "detection delay [s]" after the onset, for a run with a fault; where two dampers
    are weak the later one counts. What was called so before the onset already is not detected by that: a verdict has to
    be raised after it. "false alarms [-]": dampers (0 to 2) called degraded or failed while they were not weakened, at
    whatever instant; "time under false alarm [s]", until the onset. Empty where the record ends before verdicts are
    asked for, or the estimate states no deviations.
    """
    series = estimate.series
    needed = [*PARAMETERS[:2], *map(std_name, PARAMETERS[:2])]
    time = series["time [s]"].to_numpy(dtype=float) if "time [s]" in series.columns else np.zeros(0)
    if not set(needed) <= set(series.columns) or not (time >= ASKED).any():
        return {}
    built = nominal(truth_vehicle(truth))
    columns = {str(name): series[name].to_numpy(dtype=float) for name in series.columns}
    share, onset = damping_left(truth)
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    delays, alarms, under = [], 0, 0.0
    for which in range(2):
        bad = np.array([one in BAD for one in said(columns, which, float(built[which]))]) & (time >= ASKED)
        weak = (time >= onset[which]) & (share[which] < 1.0)
        alarms += bool((bad & ~weak).any())
        under += step * float((bad & ~weak).sum())
        if share[which] < 1.0:
            first = time[raised(bad, weak)]
            delays.append(float(first[0] - onset[which]) if len(first) else np.inf)
    scores = {"false alarms [-]": float(alarms), "time under false alarm [s]": under}
    if delays:
        seen = bool(np.isfinite(delays).all())
        scores |= {"detected [-]": float(seen)} | ({"detection delay [s]": max(delays)} if seen else {})
    return scores


def score_verdicts(estimate: Estimate, truth: Truth, conicity: float) -> dict[str, float]:
    """The verdicts that an estimate states at its end against what the components were.

    Parameters
    ----------
    conicity : that the wheels had.

    Returns
    -------
    "wrong verdicts [-]": components that were healthy and are called degraded or failed, or the other way round;
    "verdicts given [-]": share of the components that are called something definite. Empty where none are stated.
    """
    stated = {one.get("component"): str(one.get("verdict")) for one in estimate.about.get("verdicts", [])}
    share, _ = damping_left(truth)
    faulty: dict[str, bool] = dict(zip(COMPONENTS, [*(share < WORN).tolist(), conicity > HOLLOW], strict=True))
    known = {name: verdict for name, verdict in stated.items() if name in faulty}
    if not known:
        return {}
    wrong = sum(v in BAD and not faulty[name] or v == "healthy" and faulty[name] for name, v in known.items())
    given = [verdict in (*BAD, "healthy", "not there") for verdict in known.values()]
    return {"wrong verdicts [-]": float(wrong), "verdicts given [-]": float(np.mean(given))}


def raised(bad: np.ndarray, weak: np.ndarray) -> np.ndarray:
    """Where an alarm stands that began after the onset; both arguments and the result are masks of shape (samples,).

    Parameters
    ----------
    bad : where the damper is called degraded or failed.
    weak : where it is; one stretch, to the end.
    """
    before = np.flatnonzero(~weak)
    standing = bool(len(before)) and bool(bad[before[-1]])
    ended = np.cumsum(weak & ~bad) > 0
    return bad & weak & (ended | (not standing))


def truth_vehicle(truth: Truth) -> dict[str, float]:
    """The run's nominal parameters without units in their names."""
    return {
        name.partition(" [")[0]: value
        for name, value in truth.about.get("vehicle", {}).items()
        if isinstance(value, int | float)
    }
