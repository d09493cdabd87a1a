"""Scores of the wheels' roundness: orders of the radius, and flats, against those of the run's effects."""

from typing import Any, ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.wheel_rail.flats import flat_orders
from estimators.wheel_rail.wheel_roundness import SIDES
from experiments.reporting.units import MM
from experiments.scoring.interface import Check, Scorer
from railsim.analysis.statistics import root_mean_square
from railsim.effects.interface import EFFECTS
from railsim.truth import Truth

ALLOWED = 0.05  # mm
WAVE = frozenset({"amplitude", "order", "phase", "wheelset", "side"})
FLAT = frozenset({"length", "angle", "wheelset", "side"})
"""Fields of an effect by which the radius has a wave around the turn, and a flat."""


class WheelRoundnessScorer(Scorer):
    """Amplitudes of orders, and flats."""

    columns: ClassVar[tuple[str, ...]] = ("left_order_1 [m]", "right_order_1 [m]")
    needs: ClassVar[tuple[str, ...]] = ("s [m]", "valid [-]")
    checks: ClassVar[tuple[Check, ...]] = (
        Check(
            "orders of the wheels",
            "orders rms error [mm]",
            ALLOWED,
            "illustrative: a sixth of 0.3 mm, of which wheels are turned",
            "orders within 2 std [-]",
            "orders answered [-]",
        ),
        Check("flats", "missed or false flats [-]", 0.0, "illustrative: none", answered="flats told [-]"),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Rms error of all amplitudes, share within two deviations and answered; flats missed or false."""
        valid = estimate.series["valid [-]"].to_numpy() > 0.5
        if not valid.any():
            return {"orders answered [-]": 0.0}
        settings = estimate.about["settings"]
        true = np.abs(true_orders(truth, int(settings["axle"]), int(settings["orders"])))
        names = [[f"{side}_order_{m + 1}" for m in range(true.shape[1])] for side in SIDES]
        found = np.array([[estimate.series[f"{one} [m]"].to_numpy()[valid] for one in row] for row in names])
        std = np.array([[estimate.series[f"{one}_std [m]"].to_numpy()[valid] for one in row] for row in names])
        known = np.isfinite(found)
        scores = {"orders answered [-]": float(known.mean())}
        if known.any():
            wrong = (found - true[..., None])[known]
            scores["orders rms error [mm]"] = root_mean_square(wrong) * MM
            scores["orders within 2 std [-]"] = float(np.mean(np.abs(wrong) <= 2.0 * std[known]))
        return scores | self._flats(estimate, truth, int(settings["axle"]))

    def _flats(self, estimate: Estimate, truth: Truth, axle: int) -> dict[str, float]:
        there = {
            side: float(one["length"])
            for one in _effects(truth, FLAT, axle)
            for side in SIDES
            if one["side"] in (side, "both") and one["length"] > 0.0
        }
        said = {one["side"]: one for one in estimate.about["flats"]}
        wrong = [(side in there) != (side in said) for side in SIDES]
        told = [estimate.about["flats told"] or side in said for side in SIDES]
        known = [one for one, sure in zip(wrong, told, strict=True) if sure]
        scores = {"flats told [-]": float(np.mean(told))}
        if known:
            scores["missed or false flats [-]"] = float(np.mean(known))
        for side in there.keys() & said.keys():
            if said[side]["length [m]"] is not None:
                error = said[side]["length [m]"] - there[side]
                scores[f"{side} flat length error [mm]"] = error * MM
                scores[f"{side} flat length error over std [-]"] = abs(error) / said[side]["length_std [m]"]
        return scores


def true_orders(truth: Truth, axle: int, orders: int) -> np.ndarray:
    """Complex amplitudes of the wheels' radii, m, shape (sides, orders): those of the run's effects."""
    radius = float(truth.about["vehicle"]["wheel_radius [m]"])
    found = np.zeros((len(SIDES), orders), dtype=complex)
    for row, side in enumerate(SIDES):
        for one in _effects(truth, WAVE, axle):
            if one["side"] in (side, "both") and one["order"] <= orders:
                found[row, one["order"] - 1] += one["amplitude"] * np.exp(1j * one["order"] * one["phase"])
        for one in _effects(truth, FLAT, axle):
            if one["side"] in (side, "both") and one["length"] > 0.0:
                turned = np.exp(1j * np.arange(1, orders + 1) * one["angle"])
                found[row] += flat_orders(one["length"], radius, orders) * turned
    return found


def _effects(truth: Truth, fields: frozenset[str], axle: int) -> list[dict[str, Any]]:
    """The run's effects on the wheels of an axle that have these fields."""
    kinds = EFFECTS.classes()
    return [
        one
        for one in truth.about.get("effects", [])
        if fields <= one.keys() and kinds[one["kind"]].acts_on == "wheel" and one["wheelset"] == axle
    ]
