"""Tables of a plant that only some runs have: tabulated laws, loads, wheels that are not round, the track below."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from railsim.constants import GRAVITY
from railsim.contact.functions import AXIS_A, AXIS_B, C22, HALF_DISTANCE
from railsim.contact.hertz import STEEL_SHEAR
from railsim.dynamics.extras import OVER_DISTANCE, OVER_TIME, TURN
from railsim.errors import InputError
from railsim.force_laws import MOST_NUMBERS, Tabulated
from railsim.model import AXES, Model
from railsim.track.flexible import check_support
from railsim.track.kernel import COMPLIANCE, TrackTables


def wheel_load(model: Model) -> float:
    """Mean static vertical force of a wheel [N]."""
    carried = sum(body.mass for body in model.bodies if "z" in body.free)
    return (carried * GRAVITY + sum(model.vertical_load.values())) / (2.0 * len(model.wheelsets))


class _Store:
    """Numbers one after the other."""

    def __init__(self) -> None:
        self.parts: list[np.ndarray] = [np.zeros(1)]  # never empty
        self.size = 1

    def add(self, values: np.ndarray) -> int:
        """Place of the first one."""
        offset, flat = self.size, np.ascontiguousarray(values, dtype=float).ravel()
        self.parts.append(flat)
        self.size += len(flat)
        return offset


def build_extras(model: Model) -> tuple[np.ndarray, dict[str, Any]]:
    """The tables and the fields of the plant's record that belong to them.

    Raises
    ------
    InputError : wheels with different numbers of points around a turn.
    """
    store = _Store()
    values = _laws(model, store) | _loads(model, store) | _wheels(model, store)
    return np.concatenate(store.parts), values


def _laws(model: Model, store: _Store) -> dict[str, Any]:
    laws = [element.law for element in model.nonlinear]
    parameters = np.zeros((len(laws), MOST_NUMBERS))
    for row, law in zip(parameters, laws, strict=True):
        numbers = law.numbers()
        if isinstance(law, Tabulated):
            numbers += (store.add(law.table), *law.table.shape)
        row[: len(numbers)] = numbers
    states = np.cumsum([law.has_state for law in laws])
    return {
        "law_code": [law.code for law in laws],
        "parameters": parameters,
        "states": int(states[-1]) if laws else 0,
        "element_state": [int(k) - 1 if law.has_state else -1 for law, k in zip(laws, states, strict=True)],
    }


def _loads(model: Model, store: _Store) -> dict[str, Any]:
    columns: dict[str, list[float]] = {key: [] for key in ("body", "axis", "over", "start", "step", "offset", "count")}
    for load in model.loads:
        columns["body"].append(model.index(load.body))
        columns["axis"].append(AXES.index(load.axis))
        columns["over"].append(OVER_DISTANCE if load.over == "distance" else OVER_TIME)
        columns["start"].append(load.start)
        columns["step"].append(load.step)
        columns["offset"].append(store.add(load.values))
        columns["count"].append(len(load.values))
    return {"loads": len(model.loads)} | {f"load_{key}": column for key, column in columns.items()}


def _wheels(model: Model, store: _Store) -> dict[str, Any]:
    given = [wheelset.roundness for wheelset in model.wheelsets]
    points = {len(radii) for pair in given if pair is not None for radii in pair}
    if len(points) > 1:
        raise InputError("roundness: give the radii of all wheels at the same number of angles")
    count = points.pop() if points else 0
    offsets = np.zeros((len(given), 2), dtype=int)
    for i, pair in enumerate(given):
        for side in range(2) if count else ():
            offsets[i, side] = store.add(_with_slope(pair[side] if pair is not None else np.zeros(count)))
    middle = model.contact.coefficients.shape[1] // 2
    unbalance = np.zeros((len(given), 2, 3))
    for i, wheelset in enumerate(model.wheelsets):
        for side in range(2):
            lever = (1.0 - 2.0 * side) * model.contact.coefficients[side, middle, HALF_DISTANCE, 0]
            unbalance[i, side] = [*wheelset.unbalance[side], lever]
    return {
        "round_points": count,
        "round_offset": offsets,
        "uneven": count > 0 or bool(unbalance[:, :, 0].any()),
        "unbalance": unbalance,
    }


def _with_slope(radius: np.ndarray) -> np.ndarray:
    """(points, 2): deviation [m] and its slope [m/rad] of the periodic spline."""
    angle = np.linspace(0.0, TURN, len(radius) + 1)
    spline = CubicSpline(angle, np.append(radius, radius[0]), bc_type="periodic")
    return np.column_stack((radius, spline(angle[:-1], 1)))


def corunning_numbers(model: Model, track: TrackTables) -> np.ndarray:
    """Numbers of `dynamics.corunning`, or a zero where no track runs with the wheelsets.

    Raises
    ------
    InputError : the track is stated to be stiffer than its pads.
    """
    own = model.corunning
    if own is None:
        return np.zeros(1)
    softness = track.coefficients[:, COMPLIANCE, 0] if track.compliant else np.array([own.compliance])
    check_support(own, 1.0 / softness)
    numbers = [*own, wheel_load(model) * float(softness.mean()), float(track.compliant), _creep_slope(model)]
    return np.array([*numbers, len(model.voids), *(value for void in model.voids for value in void)], dtype=float)


def _creep_slope(model: Model) -> float:
    """Slope of the lateral creep force by the lateral creepage in the wheels' middle position under 1 N [N]."""
    middle = model.contact.coefficients.shape[1] // 2
    row = model.contact.coefficients[0, middle, :, 0]
    share = 0.5 * (model.law.k_adhesion + model.law.k_slip)
    return float(STEEL_SHEAR * row[AXIS_A] * row[AXIS_B] * row[C22] * share)
