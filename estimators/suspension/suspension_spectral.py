"""Condition of the secondary dampers of vehicles that are laden, worn or on slippery rails, from spectra."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import chi2

from estimators.interface import Estimate
from estimators.signals.windows import HANN
from estimators.suspension.base import TUNED, SuspensionSettings
from estimators.suspension.observations import SuspensionRecord, read, straight_positions
from estimators.suspension.spectral_likelihood import BANDS, IMPROBABLE, Likelihood, Mode, densities
from estimators.suspension.spectral_record import CURVE, YAW_RATE, Gate, Stretch, gates, stretches
from estimators.suspension.spectral_vehicle import (
    ANGLES,
    CONICITY,
    CREEP,
    LATERAL,
    LOAD,
    STIFFNESS,
    YAW,
    can_be_whole,
    nominal_vehicle,
    wheelsets_ahead,
)
from estimators.suspension.verdicts import CANNOT_TELL, std_name, verdicts
from estimators.vehicle.affine import PARAMETERS, nominal
from estimators.vehicle.lateral_frequency import is_whole
from estimators.vehicle.lateral_roll import NEEDED
from estimators.vehicle.parameters import numbers
from railsim.data_sheet import data_sheet
from railsim.errors import InputError
from railsim.measurements import Measurements
from railsim.spec import quantity

STARTS = ((1.0, 1.0), (0.4, 0.4))
"""Shares of the dampers at which the fit begins: new, and well below what counts as worn."""
COMPARABLE = 12.0  # of minus the logarithm of the posterior: modes beyond it are passed over
MOST_LEFT = 1.0  # of minus the logarithm of the posterior: odds of 2.7, of the 100 that a verdict needs
UNSETTLED = "the fit has not settled; another stretch of track would help"
SETTLING = "the band-pass settles"
SETTLE = 3.0  # s at the beginning, while the band-pass forgets its start
HELPS: Mapping[str, str] = {
    LOAD: "the load that the vehicle carries (load cells, pressure of air springs)",
    CREEP: "dry rails",
    CONICITY: "the wheels' profiles, measured",
    ANGLES: "the wheels' profiles, measured",
    STIFFNESS: "the stiffness of the secondary springs, measured",
}
UNPLACED = (
    "the place on a measured track is not known, so the track counts as unknown; "
    "a position to 0.2 m (RTK) or the distance 'start' would help"
)
STRAIGHT = 20.0  # s of straight track with which curves are left out; with less they are used too (choice)
CURVED = (
    "most of the record is curve, where creep is not linear: only lateral dampers are judged; straight track would help"
)
NO_STRETCH = "nothing of the record can be used"


class _Fitted(NamedTuple):
    """A mode, the likelihood that has it, the covariance of the vehicle's unknowns there, and misfits in words."""

    likelihood: Likelihood
    mode: Mode
    covariance: np.ndarray
    misfits: list[str]


class SuspensionSpectral(SuspensionSettings, frozen=True):
    """Dampers and conicity of half and whole vehicles whose load, adhesion and wheels are unknown.

    Dampers and conicity are constant over the record.
    """

    track: Literal["uncertain", "unknown"] = quantity(
        "uncertain", unit="uncertain or unknown", source="whether track.csv is used; never without an error of its own"
    )
    structure: Literal["by about.json", "half", "whole"] = quantity(
        "by about.json",
        unit="-",
        source="whole where about.json gives a whole vehicle; else both, weighed by their evidence",
    )
    lowest: float = quantity(0.3, unit="Hz", source="half of the body's lowest lateral mode", gt=0.0)
    highest: float = quantity(7.5, unit="Hz", source="below `low_pass`", gt=0.0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """Fit the record.

        Raises
        ------
        InputError : a channel, the speed or a parameter of the vehicle is missing.
        """
        self.need(measurements)
        p = numbers(measurements.vehicle, NEEDED)
        known = self.track == "uncertain" and self.placed(measurements)
        if known and self.start is None:
            known = bool(straight_positions(measurements).sum() > 1)
        ahead = wheelsets_ahead(p, can_be_whole(measurements.vehicle))
        band = self.high_pass, self.low_pass
        record = read(measurements, self.channels, band, known, self.start, 1, ahead)
        if YAW_RATE not in record.channels:
            raise InputError(f"'{YAW_RATE}' cannot be used; check the sensor")
        closed = gates(measurements, record, p)
        closed.append(Gate(SETTLING, np.arange(len(record.time)) < round(SETTLE * record.rate)))
        within = self.lowest, self.highest
        parts, left_out = stretches(record, closed, within, band)
        curved = [one for one in closed if one.reason == CURVE and one.where.any()]
        bent = bool(curved) and sum(one.ends[1] - one.ends[0] for one in parts) < STRAIGHT
        if bent:
            parts, left_out = stretches(record, [one for one in closed if one.reason != CURVE], within, band)
        about: dict[str, Any] = {"left_out": [*record.health.left_out, *left_out], "stretches": [], "curve": bent}
        warnings = [*record.health.warnings(), *_gate_warnings(left_out)]
        if self.track == "uncertain" and not known:
            warnings.append(UNPLACED)
        if not parts:
            return self._without(measurements, record, about, [*warnings, NO_STRETCH])
        about["stretches"] = [[*one.ends, one.speed] for one in parts]
        found = self._fits(measurements, record, parts, known)
        return self._result(measurements, record, found, about, warnings)

    def _fits(
        self, measurements: Measurements, record: SuspensionRecord, parts: Sequence[Stretch], known: bool
    ) -> list[_Fitted]:
        """Modes that are about as probable as the best one, the best first."""
        found = []
        for whole in self._structures(measurements):
            likelihood = self._likelihood(measurements, record, parts, known, whole)
            for lateral, yaw in STARTS:
                start = likelihood.mean.copy()
                for i, unknown in enumerate(likelihood.vehicle.unknowns):
                    start[i] = {LATERAL: lateral, YAW: yaw}.get(unknown.name, start[i])
                found.append((likelihood, likelihood.fit(start)))
        best = min(mode.cost for _, mode in found)
        kept: list[tuple[Likelihood, Mode]] = []
        for likelihood, mode in sorted(found, key=lambda one: one[1].cost):
            count = likelihood.count
            same = [one for other, one in kept if other is likelihood]
            near = any(np.allclose(mode.values[:count], one.values[:count], atol=0.02) for one in same)
            if mode.cost - best < COMPARABLE and not near:
                kept.append((likelihood, mode))
        return [_fitted(likelihood, mode) for likelihood, mode in kept]

    def _structures(self, measurements: Measurements) -> tuple[bool, ...]:
        if self.structure != "by about.json":
            return (self.structure == "whole",)
        if not can_be_whole(measurements.vehicle):
            return (False,)
        return (True,) if is_whole(measurements.vehicle) else (False, True)

    def _likelihood(
        self,
        measurements: Measurements,
        record: SuspensionRecord,
        parts: Sequence[Stretch],
        known: bool,
        whole: bool,
    ) -> Likelihood:
        gain = blow_off_gain(measurements.vehicle, record)
        places = {name: data_sheet(measurements.about, name).position for name in record.channels}
        vehicle = nominal_vehicle(measurements.vehicle, places, record.channels, whole, self.creep, (1.0, gain))
        forces = self.forces(vehicle.p)
        forces["body.yaw"] = self.body_force * vehicle.p.get("semi_bogie_spacing", 0.0)
        noise = record.noise**2 * 2.0 / record.rate + self.model_errors(record.channels) ** 2 * 2.0 / TUNED
        track = self.tracks(self.track_error if known else self.track_level)
        if not whole:
            parts = [_front(one) for one in parts]
        return Likelihood(vehicle, parts, densities(vehicle, forces, noise, track))

    def _result(
        self,
        measurements: Measurements,
        record: SuspensionRecord,
        found: Sequence[_Fitted],
        about: dict[str, Any],
        warnings: list[str],
    ) -> Estimate:
        built = nominal(measurements.vehicle)
        mean, std = moments(found, built)
        if about["curve"]:
            mean[1:], std[1:] = np.nan, np.nan
            warnings = [*warnings, CURVED]
        first = found[0]
        about |= _explained(first.likelihood, first.mode)
        warnings = [*warnings, *(f"{text}; deviations are widened for it" for text in first.misfits)]
        doubt = UNSETTLED if first.mode.left > MOST_LEFT else ""
        entries = verdicts(mean, std, built, doubt)
        for entry, name in zip(entries, (LATERAL, YAW, CONICITY), strict=True):
            if entry["verdict"] == CANNOT_TELL:
                bent = about["curve"] and name != LATERAL
                entry["reason"] = CURVED if bent else doubt or what_would_help(first, name)
                warnings.append(f"{entry['component']}: cannot tell: {entry['reason']}")
        return self._series(record, mean, std, float(not doubt), {**about, "verdicts": entries, "warnings": warnings})

    def _without(
        self, measurements: Measurements, record: SuspensionRecord, about: dict[str, Any], warnings: list[str]
    ) -> Estimate:
        """Nothing could be fitted."""
        nothing = np.full(3, np.nan)
        why = "; ".join(one for one in warnings if one != NO_STRETCH) or NO_STRETCH
        entries = verdicts(nothing, nothing, nominal(measurements.vehicle), why)
        return self._series(record, nothing, nothing, 0.0, {**about, "verdicts": entries, "warnings": warnings})

    def _series(
        self, record: SuspensionRecord, mean: np.ndarray, std: np.ndarray, valid: float, about: dict[str, Any]
    ) -> Estimate:
        """The same values at the first and last sample."""
        values = [value for pair in zip(mean, std, strict=True) for value in pair]
        names = [name for pair in ((one, std_name(one)) for one in PARAMETERS) for name in pair]
        rows = [[at, *values, valid] for at in record.time[[0, -1]]]
        series = pd.DataFrame(rows, columns=pd.Index(["time [s]", *names, "valid [-]"]))
        return Estimate(self.name, series, {**self.model_dump(), "channels": list(record.channels), **about})


def blow_off_gain(vehicle: Mapping[str, Any], record: SuspensionRecord) -> float:
    """Share of the yaw dampers' force that is left where they blow off, by statistical linearisation (Booton 1954).

    E[v F(v)] / (c E[v^2]) with v the damper's speed by the bogie's yaw rate, less what its mount takes; 1 where
    about.json states no blow-off velocity.
    """
    limit, arm = vehicle.get("yaw_damper_blow_off_velocity"), float(vehicle.get("yaw_damper_half_spacing", 0.0))
    damping, beyond = float(vehicle.get("yaw_damper_damping", 0.0)), float(vehicle.get("yaw_damper_blow_off_share", 0))
    if not isinstance(limit, int | float) or damping <= 0.0 or arm <= 0.0:
        return 1.0
    column = record.channels.index(YAW_RATE)
    values = np.where(record.good[:, column], record.readings[:, column], 0.0) * arm
    mount = vehicle.get("yaw_damper_series_stiffness")
    if isinstance(mount, int | float):
        spectrum, frequency = np.fft.rfft(values), np.fft.rfftfreq(len(values), 1.0 / record.rate)
        values = np.fft.irfft(spectrum / (1.0 + 2j * np.pi * frequency * damping / mount), len(values))
    power = float(values @ values)
    force = np.clip(values, -limit, limit) * (1.0 - beyond) + values * beyond
    return float(values @ force) / power if power > 0.0 else 1.0


def moments(found: Sequence[_Fitted], built: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of C_sy, C_spsi and conicity over all modes, by their evidence (Laplace)."""
    means, variances, weights = [], [], []
    for fitted in found:
        names = [one.name for one in fitted.likelihood.vehicle.unknowns]
        mean, variance = np.zeros(3), np.zeros(3)
        for i, name in enumerate((LATERAL, YAW, CONICITY)):
            if name not in names:
                continue
            at = names.index(name)
            value, spread = float(fitted.mode.values[at]), float(fitted.covariance[at, at])
            if name == CONICITY:
                value = built[2] * float(np.exp(value))
                mean[i], variance[i] = value, value**2 * spread
            else:
                mean[i], variance[i] = built[i] * value, built[i] ** 2 * spread
        means.append(mean)
        variances.append(variance)
        weights.append(-fitted.mode.cost - 0.5 * np.linalg.slogdet(fitted.mode.information)[1])
    weight = np.exp(np.array(weights) - max(weights))
    weight = weight / weight.sum()
    mean = weight @ np.array(means)
    return mean, np.sqrt(weight @ (np.array(variances) + (np.array(means) - mean) ** 2))


def misfits(likelihood: Likelihood, mode: Mode) -> list[tuple[str, float]]:
    """Where whitened residuals are larger than the model allows (chi-square by channel and band): in words, and how
    many times the power.
    """
    cells = likelihood.misfit(mode)
    found = []
    for cell in cells:
        chance = len(cells) * chi2.sf(2.0 * cell.total / HANN, 2.0 * cell.number / HANN)
        if chance < IMPROBABLE:
            channel, ratio = likelihood.vehicle.channels[cell.channel], cell.total / cell.number
            name = f"'{channel.body}.{channel.kind}' {_band(cell.band)}"
            found.append((f"{name} has {ratio:.1f} times the power that the model leaves to it", ratio))
    return found


def _band(band: int) -> str:
    low, high = BANDS[band], BANDS[band + 1]
    if low == 0.0:
        return f"below {high:g} Hz"
    return f"above {low:g} Hz" if np.isinf(high) else f"from {low:g} to {high:g} Hz"


def what_would_help(fitted: _Fitted, name: str) -> str:
    """The unknown that takes most of what is not known of a damper or of the conicity, in words."""
    names = [one.name for one in fitted.likelihood.vehicle.unknowns]
    if name not in names:
        return "not fitted"
    at, covariance = names.index(name), fitted.covariance
    shares = {
        HELPS[other]: float(covariance[at, j] ** 2 / covariance[at, at] / covariance[j, j])
        for j, other in enumerate(names)
        if other in HELPS and j != at
    }
    best = max(shares, key=lambda one: shares[one])
    if shares[best] > 0.5:
        return f"its deviation is too wide; {best} would help"
    return "its deviation is too wide; a longer record or a track that is known better would help"


def _fitted(likelihood: Likelihood, mode: Mode) -> _Fitted:
    """With deviations that are as much wider as residuals are too large."""
    found = misfits(likelihood, mode)
    inflation = max((ratio for _, ratio in found), default=1.0)
    return _Fitted(likelihood, mode, likelihood.covariance(mode, inflation), [text for text, _ in found])


def _explained(likelihood: Likelihood, mode: Mode) -> dict[str, Any]:
    """Unknowns, levels and self-check, for about.json."""
    after, spread = likelihood.whiteness(mode.values)
    nominal_levels = mode.values.copy()
    nominal_levels[likelihood.count :] = 0.0
    before, _ = likelihood.whiteness(nominal_levels)
    return {
        "structure_found": "whole" if likelihood.vehicle.whole else "half",
        "unknowns": {one.name: float(x) for one, x in zip(likelihood.unknowns, mode.values, strict=True)},
        "self_check": {"before levels": before, "after": after, "std": spread},
        "yaw_damper_gain": likelihood.vehicle.dampers[1].gain,
    }


def _front(stretch: Stretch) -> Stretch:
    """Rails under the leading bogie alone."""
    count = stretch.rails.shape[1] // 2
    return stretch._replace(rails=stretch.rails[:, [0, 1, count, count + 1]])


def _gate_warnings(left_out: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line for each reason."""
    lines = []
    for reason in dict.fromkeys(str(one["reason"]) for one in left_out if one["reason"] != SETTLING):
        spans = [one for one in left_out if one["reason"] == reason]
        total = sum(float(one["end [s]"]) - float(one["start [s]"]) for one in spans)
        lines.append(
            f"{reason}: {total:.1f} s left out, from {spans[0]['start [s]']:.1f} to {spans[-1]['end [s]']:.1f} s"
        )
    return lines
