"""How well each sensor finds track geometry, over speed and over its place (section 3.1 of the paper)."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from estimators.track.alignment_accelerometer import AlignmentAccelerometer
from estimators.track.alignment_displacement import AlignmentDisplacement
from estimators.track.alignment_lateral import AlignmentLateral
from estimators.track.alignment_vertical import AlignmentVertical
from estimators.track.axlebox_profile import AxleboxProfile
from experiments.figures.interface import Figure
from experiments.reporting.claims import Claim, above, at_least, at_most, near
from experiments.reporting.plots import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED
from experiments.reporting.size import Size
from experiments.runs.track import POSITIONS, SHARE, errors, gyro_at, noise_limit, run, sensor_name
from railsim.sensors.accelerometer import AXLEBOX
from railsim.sensors.accelerometer import MEMS as MEMS_ACCELEROMETER
from railsim.sensors.gyro import MEMS as MEMS_GYRO

SPEEDS = (15.0 / 3.6, 8.0, 15.0, 20.0, 30.0, 45.0)
SLOW, MIDDLE, FAST = SPEEDS[0], 20.0, 45.0  # m/s; 15 km/h is the paper's lowest
GYRO, ACCELEROMETER, DISPLACEMENT, AXLEBOXES = "pitch gyro", "accelerometer", "with displacement", "axleboxes"
PLAIN, COMPENSATED = "yaw gyro", "yaw gyro, compensated"
COLOURS = {GYRO: BLUE, ACCELEROMETER: RED, DISPLACEMENT: GREEN, AXLEBOXES: ORANGE, PLAIN: GREY, COMPENSATED: PURPLE}
APART = 0.3  # mm rms


class TrackSensors(Figure):
    """Errors of D1 and D2: MEMS gyro and accelerometer, industrial accelerometer with displacement, axleboxes."""

    def compute(self, size: Size) -> pd.DataFrame:
        parts = []
        for speed in (SLOW, MIDDLE, FAST) if size.reduced else SPEEDS:
            length, specimens = size.of((1850.0, 3), (700.0, 3), (300.0, 1))
            truth, measured = run(speed, size.reduced, length, ("mems", "industrial"), specimens)
            mems, industrial = measured["mems"], measured["industrial"]
            tables = [
                errors(AlignmentVertical(compensate=True), mems, truth, GYRO),
                errors(AlignmentAccelerometer(compensate=False), mems, truth, ACCELEROMETER),
                errors(AlignmentDisplacement(), industrial, truth, DISPLACEMENT),
                errors(AxleboxProfile(cut=70.0), mems, truth, AXLEBOXES),
                errors(AlignmentLateral(compensation=False), mems, truth, PLAIN),
                errors(AlignmentLateral(), mems, truth, COMPENSATED),
            ]
            for x in POSITIONS if speed == MIDDLE else ():
                accelerometer = AlignmentAccelerometer(sensor=sensor_name(x), compensate=False)
                tables.append(errors(accelerometer, mems, truth, ACCELEROMETER).assign(**{"place [m]": x}))
                moved = [gyro_at(x, one) for one in mems]
                tables.append(errors(AlignmentVertical(compensate=True), moved, truth, GYRO).assign(**{"place [m]": x}))
            parts.append(pd.concat(tables).assign(**{"speed [m/s]": speed}))
        table = pd.concat(parts, ignore_index=True)
        return table.loc[np.isin(table["band"].to_numpy(str), ("D1", "D2"))].reset_index(drop=True)

    def draw(self, table: pd.DataFrame) -> Picture:
        picture = Picture(figsize=(10.0, 8.6), layout="constrained")
        long, rails, over_position, lateral = picture.subplots(2, 2).ravel()
        names = (GYRO, ACCELEROMETER, DISPLACEMENT, AXLEBOXES)
        _over_speed(long, table, "vertical", "D2", names, "Vertical, waves of 25 to 70 m (D2)")
        _over_speed(rails, table, "left_vertical", "D1", (DISPLACEMENT, AXLEBOXES), "Left rail, 3 to 25 m (D1)")
        speeds = np.geomspace(SPEEDS[0], SPEEDS[-1], 60)
        limit = [1e3 * SHARE * noise_limit(AXLEBOX.noise_density, v, "vertical", "D1", 2) for v in speeds]
        rails.plot(speeds, limit, color=ORANGE, ls=":", lw=1.5, label="limit by axlebox noise")
        rails.axhline(APART, color=BLACK, lw=1.0, ls="-.", label="0.3 mm")
        _over_speed(lateral, table, "lateral", "D1", (PLAIN, COMPENSATED), "Lateral, 3 to 25 m (D1)")
        for name in (ACCELEROMETER, GYRO):
            rows = _rows(table, name, "vertical", "D1", MIDDLE, placed=True)
            over_position.plot(rows["place [m]"], rows["error [mm]"], "o-", color=COLOURS[name], label=name)
        over_position.set(title=f"Vertical D1 at {MIDDLE:g} m/s over the sensor's place", ylim=(0.0, None))
        over_position.set_xlabel("place before the bogie's centre [m]")
        for axes in (long, rails, lateral, over_position):
            axes.set_ylabel("error [mm rms]")
            axes.grid(True, which="both")
            axes.legend(frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
            axes.set_title(axes.get_title(), pad=34)
        return picture

    def check(self, table: pd.DataFrame) -> list[Claim]:
        return [
            *self._gyro(table),
            *self._by_position(table),
            *self._long_waves(table),
            *self._lateral(table),
            *self._apart(table),
        ]

    def _gyro(self, table: pd.DataFrame) -> list[Claim]:
        ratio = _error(table, ACCELEROMETER, "vertical", "D2", SLOW) / _error(table, GYRO, "vertical", "D2", SLOW)
        by_noise = noise_limit(MEMS_ACCELEROMETER.noise_density, SLOW, "vertical", "D2", 2)
        by_noise /= noise_limit(MEMS_GYRO.noise_density, SLOW, "vertical", "D2", 1)
        return [
            Claim.definite("15 km/h, D2, accelerometer's error over the gyro's, by noise alone", by_noise, above(1.0)),
            Claim.definite("15 km/h, D2, accelerometer's error over the gyro's", ratio, at_least(1.5)),
        ]

    def _by_position(self, table: pd.DataFrame) -> list[Claim]:
        spread = {}
        for name in (ACCELEROMETER, GYRO):
            found = _rows(table, name, "vertical", "D1", MIDDLE, placed=True)["error [mm]"].to_numpy(float)
            spread[name] = float(found.max() / found.min())
        text = "D1 error over places on the bogie, largest over smallest: accelerometer"
        return [
            Claim.definite(text, spread[ACCELEROMETER], at_least(1.3)),
            Claim.definite("the same: gyro", spread[GYRO], at_most(1.2)),
        ]

    def _long_waves(self, table: pd.DataFrame) -> list[Claim]:
        peak = 2e-3 * (2.0 * np.pi * FAST / 30.0) ** 2
        claims = [Claim.definite("2 mm at 30 m and 45 m/s: acceleration", peak, near(0.18, 0.005, "m/s2"))]
        for name, speed, lost in ((AXLEBOXES, SLOW, True), (AXLEBOXES, FAST, True), (DISPLACEMENT, SLOW, False),
                                  (DISPLACEMENT, FAST, False)):  # fmt: skip
            row = _rows(table, name, "vertical", "D2", speed).iloc[0]
            share = float(row["error [mm]"] / row["true [mm]"])
            what = f"{name}, {3.6 * speed:.0f} km/h: error of D2 over its true size"
            target = at_least(0.5, meaning="lost") if lost else at_most(0.5, meaning="kept")
            claims.append(Claim.definite(what, share, target))
        return claims

    def _lateral(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        for speed in sorted(set(table["speed [m/s]"])):
            ratio = _error(table, COMPENSATED, "lateral", "D1", speed) / _error(table, PLAIN, "lateral", "D1", speed)
            what = f"lateral D1, {3.6 * speed:.0f} km/h: error with compensation over without"
            claims.append(Claim.definite(what, ratio, at_most(0.5)))
        return claims

    def _apart(self, table: pd.DataFrame) -> list[Claim]:
        claims = []
        for speed in sorted(set(table["speed [m/s]"])):
            worst = max(_error(table, AXLEBOXES, f"{side}_vertical", "D1", speed) for side in ("left", "right"))
            limit = 1e3 * SHARE * noise_limit(AXLEBOX.noise_density, speed, "vertical", "D1", 2)
            what = f"axleboxes, {3.6 * speed:.0f} km/h: D1 of the worse rail (noise alone allows {limit:.2f} mm)"
            claims.append(Claim.definite(what, worst, at_most(APART, "mm rms")))
        return claims


def _rows(table: pd.DataFrame, name: str, quantity: str, band: str, speed: float, placed: bool = False) -> pd.DataFrame:
    chosen = (table["estimator"] == name) & (table["quantity"] == quantity) & (table["band"] == band)
    chosen &= np.isclose(table["speed [m/s]"], speed) & (table["place [m]"].notna() == placed)
    return table.loc[chosen]


def _error(table: pd.DataFrame, name: str, quantity: str, band: str, speed: float) -> float:
    return float(_rows(table, name, quantity, band, speed)["error [mm]"].iloc[0])


def _over_speed(axes: Axes, table: pd.DataFrame, quantity: str, band: str, names: tuple[str, ...], title: str) -> None:
    """Errors of some estimators, and the true size of the band."""
    speeds = sorted(set(table["speed [m/s]"]))
    for name in names:
        values = [_error(table, name, quantity, band, speed) for speed in speeds]
        axes.plot(speeds, values, "o-", color=COLOURS[name], label=name)
    true = [float(_rows(table, names[0], quantity, band, speed)["true [mm]"].iloc[0]) for speed in speeds]
    axes.plot(speeds, true, color=BLACK, lw=1.0, ls="--", label="true size of the band")
    axes.set(title=title, xscale="log", yscale="log", xlabel="speed [m/s]")
    axes.set_xticks([4, 8, 15, 30, 45], ["4", "8", "15", "30", "45"])
    low, high = axes.get_ylim()
    ticks = [tick for tick in (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0) if low <= tick <= high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
