"""Weak secondary dampers: estimated health over the true one, a damper that fails on the way, and false alarms.

The sweep and the steps are on `straight_erri_low`; every healthy minute is on other irregularities of ERRI B176 low
than those that the model's noise was chosen on. Bogie and body sensors only.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Picture

from estimators.suspension.suspension_rbpf import SuspensionRbpf
from estimators.suspension.verdicts import damper, std_name
from estimators.vehicle.affine import PARAMETERS, nominal
from experiments.figures.parted import PartedFigure, Parts
from experiments.reporting import intervals
from experiments.reporting.claims import Claim, at_most, exactly
from experiments.reporting.plots import BLUE, RED
from experiments.reporting.size import Size
from experiments.runs.suspension import write_other
from railsim import load_scenario, measure, simulate
from railsim.plots.style import OPAQUE
from railsim.scratch import scratch_folder

TIME = "time [s]"
SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
EFFECTS = ("weak_lateral_damper", "weak_yaw_damper")
NAMES = ("lateral dampers", "yaw dampers")
SETTLED = 15.0  # s; before, a verdict is not asked for
ONSET, FOLLOWED = 30.0, 30.0  # s
CLOSE = 0.15  # of the nominal damping: a step has been followed
LENGTH = 2400.0  # m: more than a vehicle runs in that minute and before
MINUTES, FAST_MINUTES = 100, 1
SHORTEST = 35.0  # s of a run that shows no more than that all works
EVERY = 4  # samples of 256 Hz: enough for verdicts (C_spsi comes out a few per cent smaller), at a quarter of the work
FIRST_SEED = 7100
TOGETHER = 10  # healthy minutes in a part


class SuspensionFaults(PartedFigure):
    """Sweep of the damping, steps, and healthy running."""

    def parts(self, size: Size) -> Parts:
        """Sweeps and steps of each pair of dampers; healthy minutes."""
        shares = size.of(SHARES, (1.0, 0.5), (0.5,))
        steps, minutes = size.of((0.5, 0.0), (0.5,)), size.of(MINUTES, FAST_MINUTES)
        found: dict[str, list[dict[str, Any]]] = {}
        for component in range(size.of(2, 2, 1)):
            jobs = [("sweep", share) for share in shares] + [("step", share) for share in steps]
            found[EFFECTS[component]] = [{"what": what, "component": component, "share": share} for what, share in jobs]
        for minute in range(minutes):
            healthy = {"what": "healthy", "component": 0, "share": 1.0, "seed": FIRST_SEED + minute}
            found.setdefault(f"healthy_{minute // TOGETHER}", []).append(healthy)
        shortest = size.of(None, None, SHORTEST)
        return {name: partial(_runs, jobs, shortest) for name, jobs in found.items()}

    def draw(self, table: Any) -> Picture:
        picture = Picture(figsize=(10.0, 4.0), layout="constrained")
        axes = picture.subplots(1, 3)
        for component, colour in enumerate((BLUE, RED)):
            rows = last(table, "sweep", component)
            axes[0].errorbar(
                100 * rows["share"], 100 * rows["health"], 200 * rows["std"], fmt="o-", color=colour, ms=4, capsize=2
            )
            steps = table[(table["what"] == "step") & (table["component"] == component)]
            for share, run_rows in steps.groupby("share"):
                style = "-" if share > 0 else "--"
                label = f"{NAMES[component]}, to {100 * float(str(share)):.0f} %"
                axes[1].plot(run_rows[TIME], 100 * run_rows["health"], style, color=colour, lw=1.2, label=label)
            healthy = table[table["what"] == "healthy"]
            values = 100 * healthy.loc[healthy[TIME] >= SETTLED, ["health", "health of yaw dampers"][component]]
            axes[2].hist(values, bins=np.arange(50, 151, 2).tolist(), color=colour, alpha=0.5, label=NAMES[component])
        axes[0].plot([0, 100], [0, 100], color="black", lw=0.7, ls="--")
        axes[0].set(
            xlabel="true damping [% of new]",
            ylabel="estimated, with two deviations [% of new]",
            title="60 s of running",
        )
        axes[1].axvline(ONSET, color="black", lw=0.7)
        axes[1].set(
            xlabel="time [s]", ylabel="estimated damping [% of new]", title="a damper fails at 30 s", ylim=(0, 150)
        )
        axes[1].legend(loc="lower left", **OPAQUE)
        axes[2].axvline(75, color="black", lw=0.7, ls="--", label="called worn")
        axes[2].set(xlabel="estimated damping [% of new]", ylabel="time [s]", title="healthy running, other tracks")
        axes[2].set_ylim(0.0, 1.3 * axes[2].get_ylim()[1])
        axes[2].legend(loc="upper right")
        return picture

    def check(self, table: Any) -> list[Claim]:
        claims = []
        for component, name in enumerate(NAMES):
            rows = last(table, "sweep", component).sort_values("share")
            wrong = int((np.diff(rows["health"]) <= 0).sum())
            text = f"{name}: pairs of neighbours in the wrong order of health"
            claims.append(Claim.definite(text, wrong, exactly(0.0), len(rows)))
            half = table[(table["what"] == "sweep") & (table["component"] == component) & (table["share"] == 0.5)]
            found = half[TIME][(half["verdict"] != "healthy") & (half["verdict"] != "unknown")]
            after = float(found.min()) if len(found) else float("inf")
            claims.append(Claim.definite(f"{name}: 50 % loss detected after, s", after, at_most(60.0, "s")))
            steps = table[(table["what"] == "step") & (table["component"] == component)]
            for share, run_rows in steps.groupby("share"):
                error = np.abs(run_rows["health"].to_numpy() - float(str(share)))
                time, far = run_rows[TIME].to_numpy(), np.flatnonzero(error > CLOSE)
                first = int(far[-1]) + 1 if len(far) else 0  # of the rows that stay close
                took = float(time[first] - ONSET) if first < len(time) else float("inf")
                text = f"{name}: step to {100 * float(str(share)):.0f} % followed to 15 % of new after, s"
                claims.append(Claim.definite(text, took, at_most(FOLLOWED, "s")))
        healthy = table[(table["what"] == "healthy") & (table[TIME] >= SETTLED)]
        alarms = np.array([_alarms(run) for _, run in healthy.groupby("seed")])
        low, high, minutes = intervals.of_share(alarms)
        text = f"false alarms in {minutes} healthy minutes after the first {SETTLED:g} s, a minute a track"
        interval = intervals.Interval(low * minutes, high * minutes, minutes)
        claims.append(Claim.sampled(text, float(alarms.sum()), at_most(minutes / 100), interval))
        return claims

    def notes(self) -> list[str]:
        return ["An alarm is a verdict 'degraded' or 'failed' on either pair of dampers; one a run counts once."]


def _runs(jobs: Sequence[dict[str, Any]], seconds: float | None) -> pd.DataFrame:
    with scratch_folder() as folder:
        return pd.concat([run(job, Path(folder), seconds) for job in jobs], ignore_index=True)


def run(job: dict[str, Any], folder: Path, seconds: float | None = None) -> pd.DataFrame:
    """One run and its estimate: health of the job's component and of the other over time; `seconds`: if not whole."""
    changes: dict[str, Any] = {"duration": seconds or (SETTLED + 60.0 if job["what"] == "healthy" else 65.0)}
    if "seed" in job:
        changes["track"] = str(write_other(folder, job["seed"], LENGTH))
    if job["share"] < 1.0:
        onset = {"onset": ONSET} if job["what"] == "step" else {}
        changes["effects"] = [{"kind": EFFECTS[job["component"]], "factor": job["share"], **onset}]
    scenario = load_scenario("suspension", changes)
    measurements = measure(simulate(scenario, engine="compiled"), scenario, seed=job.get("seed", 1)).measurements
    series = SuspensionRbpf(wheelset_sensors=False, keep_every=EVERY, track="exact").estimate(measurements).series
    built = nominal(measurements.vehicle).tolist()
    health_rows = pd.DataFrame({TIME: series[TIME], **job, "seed": job.get("seed", 1)})
    for i, (health, std, verdict) in enumerate((("health", "std", "verdict"), (*_OTHER,))):
        index = job["component"] if i == 0 else 1 - job["component"]
        mean, spread = series[PARAMETERS[index]].to_numpy(), series[std_name(PARAMETERS[index])].to_numpy()
        health_rows[health], health_rows[std] = mean / built[index], spread / built[index]
        health_rows[verdict] = [damper(m, s, built[index]) for m, s in zip(mean, spread, strict=True)]
    return health_rows


_OTHER = ("health of yaw dampers", "std of yaw dampers", "verdict on yaw dampers")


def last(table: Any, what: str, component: int) -> Any:
    """The last row of every run of a kind."""
    rows = table[(table["what"] == what) & (table["component"] == component)]
    return rows.sort_values(TIME).groupby("share", as_index=False).last()


def _alarms(run_rows: Any) -> int:
    wrong = [run_rows[name].isin(["degraded", "failed"]).any() for name in ("verdict", "verdict on yaw dampers")]
    return int(any(wrong))
