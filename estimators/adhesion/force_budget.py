"""What a half vehicle by data sheet does not know of the forces on a bogie, sized by what was measured.

Each is an unknown force of the filter (`creep_model.UnknownForce`), so that the estimates lean on what is known better,
and the stated deviations hold what cannot be told:

- the other end of the body: half a body is not what a bogie feels. With m the mass, I the yaw inertia, L the bogies'
  distance from the centre and k = I / (m L^2), the force of this pivot is m a / (1 + 1/k) for its acceleration a, and
  (1 - k) / (1 + k) times the force at the other pivot: both differ from m a / 2 by the share (1 - k) / (1 + k);
- payload, which is not weighed;
- dampers of the secondary suspension, which may be gone or blow off;
- springs within the tolerance of their data sheets;
- bushes of trailing arms, which stand nearer to the bogie's centre than the axle by a lever that is not stated: the
  lateral primary force turns the wheelset by that lever, and the angle between wheelset and bogie adds to its stretch.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from estimators.adhesion.channels import LateralRecord, high_pass
from estimators.adhesion.creep_model import SECONDARY_FORCE, Shaping, UnknownForce
from estimators.vehicle.linear_model import Kinematics, Row
from estimators.vehicle.plan_view import COORDINATES
from estimators.vehicle.suspension import LEVEL, YAW_GYRATION, half_vehicle_bogies, primary_shear
from railsim.analysis.statistics import root_mean_square

PAYLOAD = 0.15
"""Standard deviation of the body's mass over its nominal one (illustrative: 0 to 40 % of payload)."""
DAMPER = 1.0
"""Standard deviation of a damper's force over its nominal one: where it is gone or blows off, all of it is wrong."""
SECONDARY_SPRING, PRIMARY_SPRING = 0.15, 0.06
"""Standard deviation of springs over their data sheets (illustrative)."""
LEVER = 0.5
"""Standard deviation of the lever of a bush where the data sheet states none, m (illustrative: the length of arms)."""


def budgeted(p: Mapping[str, float], record: LateralRecord, shaping: Shaping, lever: float | None = None) -> Shaping:
    """The shaping with all that is unknown.

    Parameters
    ----------
    p : parameters of the half vehicle. record : of the bogie. lever : of the primary bushes, m, where it is stated.
    """
    seen = Seen.of(p, record)
    force = max(shaping.force, seen.force)
    moment = max(shaping.moment, seen.moment)
    time = shaping.time
    others = (
        UnknownForce(SECONDARY_FORCE, _secondary(p, seen), time),
        UnknownForce(_direction({"body.y": 1.0}), _rest(p, seen), time),
        UnknownForce(_direction({"bogie.yaw": 1.0}), _turning(p, seen), time),
        *_primary(p, force, moment, LEVER if lever is None else lever, time),
    )
    return replace(shaping, force=force, moment=moment, others=others)


@dataclass(frozen=True)
class Seen:
    """Root mean squares of what the channels of a bogie show, high-passed; 0 where no channel does.

    Attributes
    ----------
    body : lateral acceleration of the body over the bogie, m/s2.
    shear, shear_rate : lateral stretch of the secondary suspension, m and m/s, without roll.
    yaw, yaw_rate : of the bogie, rad and rad/s.
    force : of the rails on one wheelset, N, by the accelerations. moment : the same about
        the vertical axis, N m, by the primary springs.
    """

    body: float
    shear: float
    shear_rate: float
    yaw: float
    yaw_rate: float
    force: float
    moment: float

    @classmethod
    def of(cls, p: Mapping[str, float], record: LateralRecord) -> Self:
        """From the channels of a record; a body without accelerometer is taken to stand still."""
        body, bogie = _mean(record, "body", False), _mean(record, "bogie", False)
        axles = [_mean(record, name, False) for name in ("wheelset1", "wheelset2")]
        turning = _mean(record, "bogie", True)
        corner = record.corner
        shear_rate = high_pass(body - bogie, corner, integrate=True)
        yaw = high_pass(turning, corner, integrate=True)
        steering = [
            root_mean_square(yaw - high_pass(rate, corner, integrate=True)) if rate.any() else 0.0
            for rate in (_mean(record, name, True) for name in ("wheelset1", "wheelset2"))
        ]
        pushing = p["wheelset_mass"] * (axles[0] + axles[1]) + p["bogie_mass"] * bogie + p["body_mass"] * body
        return cls(
            body=root_mean_square(body),
            shear=root_mean_square(high_pass(shear_rate, corner, integrate=True)),
            shear_rate=root_mean_square(shear_rate),
            yaw=root_mean_square(yaw),
            yaw_rate=root_mean_square(turning),
            force=root_mean_square(pushing) / np.sqrt(2.0),
            moment=_primary_yaw(p) * max(steering),
        )


def _mean(record: LateralRecord, body: str, turning: bool) -> np.ndarray:
    """Mean of a body's channels of one kind, 0 where there is none, (n,)."""
    columns = [column for column, one in enumerate(record.placements) if (one.body, one.turning) == (body, turning)]
    values = record.samples[:, columns]
    there = np.isfinite(values)
    return np.where(there, values, 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)


def _secondary(p: Mapping[str, float], seen: Seen) -> float:
    """Lateral force of the secondary suspension that its data sheet does not give, N."""
    spring = SECONDARY_SPRING * 2.0 * p["secondary_lateral_stiffness"] * seen.shear
    return float(np.hypot(spring, DAMPER * 2.0 * p["secondary_lateral_damping"] * seen.shear_rate))


def _turning(p: Mapping[str, float], seen: Seen) -> float:
    """The same of its yaw moment, N m."""
    square = p["secondary_half_spacing"] ** 2
    spring = SECONDARY_SPRING * 2.0 * p["secondary_longitudinal_stiffness"] * square * seen.yaw
    yaw_dampers = p.get("yaw_damper_damping", 0.0) * p.get("yaw_damper_half_spacing", 0.0) ** 2
    damping = 2.0 * (yaw_dampers + p.get("secondary_longitudinal_damping", 0.0) * square)
    return float(np.hypot(spring, DAMPER * damping * seen.yaw_rate))


def _rest(p: Mapping[str, float], seen: Seen) -> float:
    """Lateral force on the half body by the other half and by what it carries, N."""
    gyration = YAW_GYRATION
    if "body_yaw_inertia" in p and "semi_bogie_spacing" in p:
        gyration = p["body_yaw_inertia"] / (2.0 * p["body_mass"] * p["semi_bogie_spacing"] ** 2)
    other = (1.0 - gyration) / (1.0 + gyration)
    return float(np.sqrt(2.0 * other**2 + PAYLOAD**2)) * p["body_mass"] * seen.body


def _primary(p: Mapping[str, float], force: float, moment: float, lever: float, time: float) -> list[UnknownForce]:
    """Lateral forces and yaw moments of the primary suspension on both wheelsets."""
    (bogie,) = half_vehicle_bogies(p)
    bent = 2.0 * p["primary_lateral_stiffness"] * lever * moment / _primary_yaw(p)
    unknown = []
    for number, name in enumerate(bogie.wheelsets):
        unknown += [
            UnknownForce(
                _direction(primary_shear(bogie, name, LEVEL)), float(np.hypot(PRIMARY_SPRING * force, bent)), time
            ),
            UnknownForce(
                _direction({f"{name}.yaw": 1.0, "bogie.yaw": -1.0}),
                float(np.hypot(PRIMARY_SPRING * moment, lever * force)),
                time,
                within=2 * number + 1,
            ),
        ]
    return unknown


def _primary_yaw(p: Mapping[str, float]) -> float:
    """Stiffness of the primary springs between bogie and wheelset in yaw, N m/rad."""
    return 2.0 * p["primary_longitudinal_stiffness"] * p["primary_half_spacing"] ** 2


def _direction(row: Row) -> np.ndarray:
    """Generalised forces (7,) of a force along a direction."""
    return Kinematics(COORDINATES).row(row)[0]
