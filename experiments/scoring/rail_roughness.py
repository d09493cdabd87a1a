"""Scores of rail roughness: bands by place and the record's spectrum, against the true rails under the same wheels.

The true rails go through the same windows, each where the vehicle truly was at the window's time. Simulated wheels
touch the rail at a point, so that the truth is raised by the contact filter where the estimate undid one.
"""

from typing import ClassVar

import numpy as np

from estimators.interface import Estimate
from estimators.track.rail_roughness import FINEST, SIDES
from estimators.track.roughness_bands import CORRUGATION, Spectra, level, spectra, third_octave
from estimators.vehicle.wheel_on_track import contact_filter
from experiments.scoring.interface import Check, Scorer, stated
from railsim.analysis.statistics import root_mean_square
from railsim.truth import Truth

DECIBELS = 3.0
ALLOWED = 10.0 ** (DECIBELS / 20.0) - 1.0
SOURCE = "illustrative: 3 dB; a rail that is ground to be smooth and one that is not lie 10 dB apart"


class RailRoughnessScorer(Scorer):
    """Roughness of both rails by band."""

    columns: ClassVar[tuple[str, ...]] = tuple(
        f"{side}_roughness_{name}mm [m]" for side in SIDES for name in CORRUGATION
    )
    needs: ClassVar[tuple[str, ...]] = ("s [m]", "time [s]", "valid [-]")
    checks: ClassVar[tuple[Check, ...]] = (
        *(
            Check(
                f"roughness {name.replace('_', ' to ')} mm",
                f"roughness {name}mm relative error [-]",
                ALLOWED,
                SOURCE,
                f"roughness {name}mm within 2 std [-]",
                f"roughness {name}mm answered [-]",
            )
            for name in CORRUGATION
        ),
        Check(
            "roughness spectrum",
            "roughness spectrum rms error [dB]",
            DECIBELS,
            SOURCE,
            "roughness spectrum within 2 std [-]",
            "roughness spectrum answered [-]",
        ),
    )

    def score(self, estimate: Estimate, truth: Truth) -> dict[str, float]:
        """Relative error of each band, error of the levels in dB, shares within two deviations and answered."""
        valid = estimate.series["valid [-]"].to_numpy() > 0.5
        if not valid.any():
            return {"roughness valid share [-]": 0.0}
        true = self._true(estimate, truth)
        scores = {"roughness valid share [-]": float(np.mean(valid))}
        for name, band in CORRUGATION.items():
            if f"left_roughness_{name}mm [m]" in estimate.series:
                scores |= self._band(estimate, valid, name, _rms(true, band))
        return scores | self._spectrum(estimate, valid, true)

    def _true(self, estimate: Estimate, truth: Truth) -> Spectra:
        """Spectra of the true rails in the estimate's windows."""
        settings = estimate.about["settings"]
        length, axle = float(settings["length"]), int(settings["axle"])
        s, time = (estimate.series[name].to_numpy() for name in ("s [m]", "time [s]"))
        spacing = length / round(length / FINEST)
        grid = s[0] - length + spacing * np.arange(round((s[-1] - s[0] + 2.0 * length) / spacing) + 1)
        at = np.interp(time, truth.time, truth["s [m]"])  # where the bogie truly was
        scale = (at[-1] - at[0]) / (s[-1] - s[0]) if len(s) > 1 else 1.0
        places = np.interp(grid, s, at) + scale * (np.minimum(grid - s[0], 0.0) + np.maximum(grid - s[-1], 0.0))
        rails = np.stack(
            [np.interp(places, truth["s [m]"], truth[f"track{axle}.{side}_vertical [m]"]) for side in SIDES]
        )
        found = spectra(rails, spacing, length)
        half_length = stated(estimate, "contact half length [m]")
        if half_length:
            raised = contact_filter(1.0 / found.wave_number, half_length) ** -2
            return found._replace(density=found.density * raised)
        return found

    def _band(self, estimate: Estimate, valid: np.ndarray, name: str, true: np.ndarray) -> dict[str, float]:
        columns = [f"{side}_roughness_{name}mm" for side in SIDES]
        found = np.stack([estimate.series[f"{one} [m]"].to_numpy() for one in columns])
        std = np.stack([estimate.series[f"{one}_std [m]"].to_numpy() for one in columns])
        answered = np.isfinite(found) & valid
        scores = {f"roughness {name}mm answered [-]": float(answered[:, valid].mean())}
        if answered.any():
            wrong = (found - true)[answered]
            size = root_mean_square(true[answered])
            scores[f"roughness {name}mm within 2 std [-]"] = float(np.mean(np.abs(wrong) <= 2.0 * std[answered]))
            if size > 0.0:  # of rails that are smooth there no error is relative
                scores[f"roughness {name}mm relative error [-]"] = root_mean_square(wrong) / size
                scores[f"roughness {name}mm relative std [-]"] = root_mean_square(std[answered]) / size
        return scores

    def _spectrum(self, estimate: Estimate, valid: np.ndarray, true: Spectra) -> dict[str, float]:
        wrong, std, asked = [], [], 0
        for entry in estimate.about["spectrum"]:
            band = third_octave(entry["wavelength [m]"])
            known = np.sqrt(np.mean(_rms(true, band)[:, valid] ** 2, axis=1))
            for row, side in enumerate(SIDES):
                asked += 1
                if entry[f"{side} level [dB]"] is not None and known[row] > 0.0:
                    wrong.append(entry[f"{side} level [dB]"] - level(known[row]))
                    std.append(entry[f"{side} level_std [dB]"])
        if not asked:
            return {}
        scores = {"roughness spectrum answered [-]": len(wrong) / asked}
        if wrong:
            within = np.abs(wrong) <= 2.0 * np.array(std)
            scores["roughness spectrum rms error [dB]"] = root_mean_square(np.array(wrong))
            scores["roughness spectrum within 2 std [-]"] = float(np.mean(within))
        return scores


def _rms(true: Spectra, band: tuple[float, float]) -> np.ndarray:
    """Rms of the true rails in a band, m, shape (sides, windows)."""
    return np.sqrt(true.density @ true.share(*band))
