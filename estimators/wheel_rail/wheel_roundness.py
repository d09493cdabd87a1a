"""Out-of-roundness and flats of both wheels of an axle, from the accelerometers on its axleboxes."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from estimators.interface import Estimate
from estimators.speed.axleboxes import SETTLES, SIDES, Axle, AxleEstimator, Line
from estimators.speed.odometry import integrate_speed
from estimators.vehicle.wheel_on_track import WheelOnTrack, drawn_wheels, nominal_wheel
from estimators.wheel_rail.flats import find_flat, follows_up_to
from estimators.wheel_rail.turns import Orders, mean_and_scatter, order_amplitudes, refined_turn
from railsim.measurements import Measurements
from railsim.spec import quantity

FEWEST = 3
"""Windows from which a scatter is known."""
ACROSS = 0.1
"""Share of the other wheel's amplitude, times 1 - r / z, that leaks over by the axle's roll: see docs/roughness.md."""
COUNTED = 5e-4
"""Share by which a turn may differ that a tachometer on the axle has counted."""
WIDE = 40
"""Orders that tell a flat of 50 mm from a longer one: pi d over twice its length, illustrative."""
MOST = 150
"""Orders with which a flat is looked for."""


class Found(NamedTuple):
    """Amplitudes of orders in one section of the record, shape (sides, orders)."""

    mean: np.ndarray
    scatter: np.ndarray
    std: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """m; what the scatter adds on average is taken out."""
        return np.sqrt(np.maximum(np.abs(self.mean) ** 2 - 2.0 * self.scatter**2, 0.0))


class WheelRoundness(AxleEstimator, frozen=True):
    """Out-of-roundness and flats of both wheels of an axle, from its axlebox accelerometers.

    Orders of the wheels' radii come from averaging over turns. Deviations hold what rail and track leave unknown. The
    path of each wheel's centre over whole turns is taken back through the wheel on its contact and rail. What the
    orders scatter by from window to window, the rail's share of it above all, is their deviation.
    """

    slowest: float = quantity(2.0, unit="m/s", source="illustrative: slower is marked as invalid", gt=0.5)
    orders: int = quantity(10, unit="waves a turn, the highest that is given", source="illustrative", ge=1, le=40)
    section: int = quantity(100, unit="turns of a row", source="illustrative", ge=24, le=5000)
    turns: int = quantity(4, unit="turns, half a window", source="illustrative", ge=2, le=50)
    radius_range: float = quantity(0.03, unit="share of the radius", source="wear and odometry, illustrative", gt=0.0)

    def estimate(self, measurements: Measurements) -> Estimate:
        """A row each `section` turns; flats of the whole record.

        Raises
        ------
        InputError : a channel, the speed or a parameter is missing, or the vehicle does not move.
        """
        self.need(measurements)
        odometry = integrate_speed(measurements, self.speed_source, self.slowest)
        axle, vehicle = Axle.of(measurements, self.axle), measurements.vehicle
        radius = float(vehicle["wheel_radius"])
        drawn = drawn_wheels(nominal_wheel(vehicle, self.track_compliance), self.track_spread)
        moving = odometry.speed_at_knots[odometry.trusted]
        usual = max(float(np.median(moving)) if moving.size else self.slowest, self.slowest)
        nominal, share = self._turn(measurements, odometry.source, radius)
        highest = int(np.clip(axle.reach * nominal / usual, self.orders, MOST))
        line = Line.of(axle, odometry, nominal / (4.0 * highest), SETTLES)
        paths = line.at(axle, axle.paths(self.slowest / nominal / 2.0))
        turn = refined_turn(paths * line.good, line.spacing, nominal, share, self.orders)
        found = order_amplitudes(paths, line.spacing, turn, self.turns, highest)
        half = round(self.turns * turn / line.spacing)
        good = np.array([line.good[i - half : i + half].all() for i in found.middle], dtype=bool)
        speed = line.speed[found.middle]
        reached = axle.reach * turn / usual
        series = self._series(line, found, good, speed, turn, (axle, drawn))
        whole = self._orders(found, good, speed, turn, (axle, drawn), highest)
        limit = follows_up_to(float(vehicle["design_wheel_load"]), float(vehicle["wheelset_mass"]) / 2.0, radius)
        about: dict[str, Any] = {
            "settings": self.model_dump(mode="json"),
            "turn [m]": turn,
            "reach": {"highest frequency [Hz]": axle.reach, "highest order": int(reached)},
            "wheels follow a flat up to [m/s]": limit,
            "flats told": bool(usual <= limit and reached >= WIDE),
            "flats": self._flats(whole, radius, usual <= limit and reached >= WIDE),
            "bound by noise [m]": self._bound(axle, turn, usual, int(good.sum()) * self.turns * turn / usual),
            **odometry.stated(),
        }
        return Estimate(self.name, series, about | {"warnings": self._warnings(series, about["flats"], usual, limit)})

    def _turn(self, measurements: Measurements, source: str, radius: float) -> tuple[float, float]:
        """Length of a turn in the odometer's metres, and the share by which it may be another.

        A tachometer on this axle counts the turns themselves, whatever radius its speed was made with.
        """
        own = f"wheelset{self.axle}"
        if source == f"{own}.wheel_speed [rad/s]":
            return 2.0 * np.pi * radius, COUNTED
        if source == f"{own}.speed [m/s]" and f"{own}.wheel_speed [rad/s]" in measurements:
            speed, spin = measurements[source], measurements[f"{own}.wheel_speed [rad/s]"]
            if len(speed) == len(spin) and np.nanmax(spin) > 0.0:
                turning = spin > 0.5 * np.nanmedian(spin)
                return float(2.0 * np.pi * np.nanmedian(speed[turning] / spin[turning])), COUNTED
        return 2.0 * np.pi * radius, self.radius_range

    def _series(
        self, line: Line, found: Orders, good: np.ndarray, speed: np.ndarray, turn: float, on: tuple[Axle, WheelOnTrack]
    ) -> pd.DataFrame:
        size = max(FEWEST, self.section // self.turns)
        count = max(1, len(good) // size) if len(good) else 0
        rows = []
        for part in np.array_split(np.arange(len(good)), count) if count else []:
            kept = Orders(found.amplitude[:, part], found.middle[part])
            orders = self._orders(kept, good[part], speed[part], turn, on, self.orders)
            last = int(found.middle[part[-1]])
            row: dict[str, float] = {"s [m]": float(line.s[last]), "time [s]": float(line.time[last])}
            for side, name in enumerate(SIDES):
                for m in range(self.orders):
                    row[f"{name}_order_{m + 1} [m]"] = float(orders.amplitude[side, m])
                    row[f"{name}_order_{m + 1}_std [m]"] = float(orders.std[side, m])
            rows.append(row | {"valid [-]": float(good[part].sum() >= FEWEST)})
        names = ["s [m]", "time [s]"]
        for m in range(self.orders):
            names += [f"{name}_order_{m + 1}{what} [m]" for name in SIDES for what in ("", "_std")]
        return pd.DataFrame(rows, columns=[*names, "valid [-]"])

    def _orders(
        self,
        found: Orders,
        good: np.ndarray,
        speed: np.ndarray,
        turn: float,
        on: tuple[Axle, WheelOnTrack],
        highest: int,
    ) -> Found:
        """Amplitudes of the radius, by orders that the windows' speeds reach; NaN beyond."""
        axle, drawn = on
        shape = len(SIDES), highest
        mean, scatter, std = np.full(shape, np.nan + 0j), np.full(shape, np.nan), np.full(shape, np.nan)
        for m in range(highest):
            frequency = (m + 1) * speed / turn
            kept = good & (frequency <= axle.reach)
            if kept.sum() < FEWEST:
                continue
            omega = 2.0 * np.pi * frequency[kept]
            over = drawn.roughness_over_path(omega)  # (draws, windows)
            path = found.amplitude[:, kept, m]  # (sides, windows)
            draws = np.mean(over[:, None, :] * path, axis=-1)  # (draws, sides)
            one, spread = mean_and_scatter((over.mean(axis=0) * path)[..., None])
            mean[:, m], scatter[:, m] = one[:, 0], spread[:, 0]
            unsure = float(np.mean(axle.unsure(frequency[kept])))
            across = (ACROSS * float(np.mean(np.abs(over - 1.0))) + unsure) * np.abs(path.mean(axis=-1))[::-1]
            parts = [spread[:, 0], np.abs(draws).std(axis=0), unsure * np.abs(one[:, 0]), across]
            std[:, m] = np.sqrt(np.sum(np.square(parts), axis=0))
        return Found(mean, scatter, std)

    def _flats(self, whole: Found, radius: float, sure: bool) -> list[dict[str, Any]]:
        """Flats of both wheels; sure: whether the wheel follows its flat and enough orders show it."""
        flats = []
        for row, side in enumerate(SIDES):
            flat = find_flat(whole.mean[row], whole.std[row], radius)
            if flat is None:
                continue
            entry: dict[str, Any] = {"side": side, "angle [rad]": flat.angle, "evidence": flat.evidence}
            entry["length [m]"] = flat.length if sure else None
            entry["length_std [m]"] = flat.length_std if sure else None
            flats.append(entry)
        return flats

    def _bound(self, axle: Axle, turn: float, usual: float, duration: float) -> list[float | None]:
        """Cramer-Rao bound of each order's amplitude by the data sheet's noise alone: sqrt(S / T), m."""
        omega = 2.0 * np.pi * np.arange(1, self.orders + 1) * usual / turn
        bound = axle.noise / omega**2 / np.sqrt(duration) if duration > 0.0 else np.full(self.orders, np.nan)
        return [float(one) if np.isfinite(one) else None for one in bound]

    def _warnings(self, series: pd.DataFrame, flats: list[dict[str, Any]], usual: float, limit: float) -> list[str]:
        found: list[str] = []
        if not len(series):
            found.append("the record is shorter than a window: nothing is given")
        if usual > limit:
            found.append(
                f"wheels leave the rail over a flat above {limit:.1f} m/s: flats may be missed, and have no length"
            )
        for one in flats:
            found.append(f"a flat on the {one['side']} wheel: that wheel unloads, its orders are less sure than stated")
        return found
