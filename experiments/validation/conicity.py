"""Item 3: equivalent conicity of the EN 15302 benchmark, and of the Manchester profiles from their files."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from experiments.reporting.plots import BLUE, GREY, RED
from experiments.reporting.size import Size
from experiments.validation.contact_benchmark import PROFILES, profiles
from experiments.validation.interface import Row, Section
from experiments.validation.reference import read
from experiments.validation.tables import of, values, where
from railsim.profiles.conicity import equivalent_conicity
from railsim.profiles.wheelset import WheelsetOnTrack

CASES = ("E1", "E2", "E3", "E4", "E5", "E8")
KINDS = ("rolling_radius_difference", "equivalent_conicity")
CHAIN = "profiles"
AMPLITUDE, COMPUTED, TABLED = "amplitude [mm]", "found [-]", "tabled [-]"
BANDS = ("upper_1 [-]", "lower_1 [-]", "upper_2 [-]", "lower_2 [-]")
SHIFT = np.arange(-65, 66, 5) * 1e-4
"""Lateral shifts of the chain from profiles [m]."""

FROM_CONTACT = {3.0: 0.18, 4.0: 0.166}
"""Conicity over the amplitude [mm] that follows from CONTACT's contact places in case A-2.2."""


class Conicity(Section):
    """Six functions of the rolling-radius difference, and the chain from two profile files."""

    item = 3
    title = "Equivalent conicity, EN 15302"
    about = (
        "The wheelset's free wave in the given function of the rolling-radius difference, about the centre at "
        "which the integral is equal at both turning points; no amplitude beyond the given range of y. The "
        "tables' two tolerance bands must hold at every amplitude. 'profiles' is the whole chain: profile files, "
        "contact search on both rails with the wheelset's roll, rolling-radius difference, conicity; the values "
        "to reach follow from CONTACT's contact places in case A-2.2."
    )
    source = "EN 15302 / UIC 519 benchmark (conicity/*.csv, criogenox/B_ECC-Equivalent-Conicity-Calculation)"
    needs = (
        *(f"conicity/{kind}_{case}.csv" for case in CASES for kind in KINDS),
        *PROFILES,
    )
    size = (12.0, 6.5)

    def compute(self, size: Size) -> pd.DataFrame:
        del size
        return pd.concat([*(benchmark_case(case) for case in CASES), _chain()], ignore_index=True)

    def rows(self, table: pd.DataFrame) -> list[Row]:
        rows = []
        for case in CASES:
            part = _reached(table, case)
            low, high = band(part)
            ours = values(part, COMPUTED)
            room = np.minimum(high - ours, ours - low) / (0.5 * (high - low))
            at = int(np.argmin(room))
            amplitudes = values(part, AMPLITUDE)
            words = f"{case}: amplitude {amplitudes[0]:g} … {amplitudes[-1]:g} mm, "
            words += f"nearest to the band's edge at {amplitudes[at]:g} mm"
            rows.append(self.bounded(words, ours[at], low[at], high[at]))
            row = part.iloc[int(np.argmin(np.abs(amplitudes - 3.0)))]
            rows.append(
                self.agrees(f"{case}: at 3 mm", row[COMPUTED], row[TABLED], 0.006 if case == "E2" else 0.004, "-")
            )
        source = "CONTACT open r2707, A-2.2, from its contact places"
        for amplitude, expected in FROM_CONTACT.items():
            part = table[(table["case"] == CHAIN) & np.isclose(table[AMPLITUDE], amplitude)]
            words = f"from the two profile files, at {amplitude:g} mm"
            rows.append(self.agrees(words, part[COMPUTED].item(), expected, 0.02, "-", source))
        return rows

    def draw(self, table: pd.DataFrame, picture: FigureBase) -> None:
        panels = picture.subplots(2, 4).flat
        for axes, case in zip(panels, (*CASES, CHAIN), strict=False):
            _panel(axes, of(table, "case", case), case)
        axes = panels[-1]
        axes.axis("off")
        axes.fill_between([], [], color=GREY, alpha=0.25, label="both tolerance bands")
        axes.plot([], [], color=GREY, lw=3.0, alpha=0.6, label="EN 15302 / CONTACT")
        axes.plot([], [], color=BLUE, lw=1.4, label="railsim")
        axes.legend(frameon=False, loc="center")


def benchmark_case(case: str) -> pd.DataFrame:
    """Found (NaN where y is not given far enough) and tabled conicity of one case, with its tolerance bands."""
    shift, difference = read(f"conicity/rolling_radius_difference_{case}.csv").to_numpy(float).T
    table = read(f"conicity/equivalent_conicity_{case}.csv").rename(columns={"tan_gamma_e [-]": TABLED})
    computed = equivalent_conicity(shift, difference, table[AMPLITUDE].to_numpy(float))
    table.insert(0, "case", case)
    table.insert(2, COMPUTED, computed)
    return table


def band(part: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value inside both tolerance bands."""
    upper, lower = (part[[f"{side}_{i} [-]" for i in (1, 2)]].to_numpy(float) for side in ("upper", "lower"))
    return lower.max(axis=1), upper.min(axis=1)


def manchester_conicity(amplitude: np.ndarray) -> np.ndarray:
    """Equivalent conicity over the amplitude [m] from the benchmark's two profile files."""
    return equivalent_conicity(SHIFT, WheelsetOnTrack(profiles()).radius_difference(SHIFT), amplitude)


def _chain() -> pd.DataFrame:
    amplitude = np.arange(1.0, 6.01, 0.25)
    table = pd.DataFrame({"case": CHAIN, AMPLITUDE: amplitude, COMPUTED: manchester_conicity(1e-3 * amplitude)})
    return table.merge(pd.DataFrame({AMPLITUDE: FROM_CONTACT.keys(), TABLED: FROM_CONTACT.values()}), how="left")


def _reached(table: pd.DataFrame, case: str) -> pd.DataFrame:
    return where(table, (table["case"] == case) & np.isfinite(table[COMPUTED]))


def _panel(axes: Axes, part: pd.DataFrame, case: str) -> None:
    amplitude = values(part, AMPLITUDE)
    if case == CHAIN:
        axes.errorbar(amplitude, part[TABLED], 0.02, fmt="o", color=GREY, capsize=3, ms=4)
        axes.set(title="S1002 on UIC60, from files", ylim=(0.0, 0.4))
    else:
        axes.fill_between(amplitude, *band(part), color=GREY, alpha=0.25, lw=0)
        axes.plot(amplitude, part[TABLED], color=GREY, lw=3.0, alpha=0.6)
        axes.set(title=case, ylim=(0.0, None))
        last = amplitude[np.isfinite(values(part, COMPUTED))][-1]
        axes.axvline(last, color=RED, lw=0.8, ls=":")
        axes.annotate("end of\ngiven y ", (last, 0.02), ha="right", va="bottom", color=RED, fontsize=7)
    axes.plot(amplitude, part[COMPUTED], color=BLUE, lw=1.4)
    axes.set(xlabel="amplitude in mm", ylabel="tan γe")
