"""Ends a run with a clear line where its numbers stop making sense."""

import numpy as np

from railsim.engines.interface import Diverged, Run

DERAILED = 0.0145  # m; lateral shift of a wheel relative to its rail beyond which the contact functions end


def check_rows(rows: np.ndarray, finite: int, names: list[str], run: Run) -> None:
    """Raise `Diverged` where a row is not finite or a wheel is off its rail; `finite` rows come before the first bad
    state.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        whole = np.isfinite(rows.sum())  # one pass in place of one for each row: nearly always there is nothing to find
    good = np.ones(len(rows), bool) if whole else np.isfinite(rows).all(axis=1)
    last = min(finite, int(good.argmin()) if not good.all() else len(rows))
    shifts = [i for i, name in enumerate(names) if name.endswith("lateral_shift [m]")]
    off = np.abs(rows[:last, shifts]) > DERAILED
    if off.any():
        row = int(off.any(axis=1).argmax())
        wheel = names[shifts[int(off[row].argmax())]].split(".")[0]
        raise Diverged(
            f"{wheel} leaves its rail {_place(rows, row)}; lower the speed, smooth the track or check the vehicle"
        )
    if last < len(rows):
        bodies = [body.name for body in run.model.bodies]
        bad = [n.split(".")[0] for n, v in zip(names, rows[last], strict=True) if not np.isfinite(v)]
        body = next((name for name in bad if name in bodies), bodies[0])
        raise Diverged(
            f"{body}: state is not finite {_place(rows, max(last - 1, 0))}; a shorter step or a softer model is needed"
        )


def _place(rows: np.ndarray, row: int) -> str:
    return f"at t = {rows[row, 0]:.4f} s, s = {rows[row, 1]:.2f} m"
