"""Half vehicle: half a car body on one bogie with two wheelsets; the missing half holds the body's yaw and pitch."""

import numpy as np

from railsim.constants import GRAVITY
from railsim.contact.functions import ContactTable
from railsim.errors import InputError
from railsim.model import Body, LinearElement, LongitudinalPath, Model, Wheelset
from railsim.spec import quantity
from railsim.vehicles.payload import LoadedBody
from railsim.vehicles.running_gear import ILLUSTRATIVE, IWNICKI, RunningGear, contact_law
from railsim.vehicles.secondary import SecondarySprings, secondary_springs, sides

HALF = f"{IWNICKI}; half of the whole body"


class HalfVehicle(RunningGear, frozen=True):
    """Half a vehicle: one bogie, two wheelsets and half of the body.

    Parameters are per axlebox (primary) and per side (secondary) unless the name says otherwise.
    """

    body_mass: float = quantity(16000.0, unit="kg", source=HALF, gt=0.0)
    body_roll_inertia: float = quantity(28400.0, unit="kg m2", source=HALF, gt=0.0)

    seats: float = quantity(32.0, unit="- on half a body", source=ILLUSTRATIVE, ge=0.0)
    standing_area: float = quantity(10.0, unit="m2 of half a body", source=ILLUSTRATIVE, ge=0.0)

    def model(self) -> Model:
        """Bodies `body`, `bogie`, `wheelset1` (leading), `wheelset2`: 16 free coordinates and two spins.

        Raises
        ------
        InputError : a payload before or behind the bogie, which half a body does not carry.
        """
        if self.payload.ahead != 0.0:
            raise InputError("payload.ahead: half a body stands on one bogie; give its mass alone, or a whole vehicle")
        load, empty = self.loaded_body.mass * GRAVITY, self.body_mass * GRAVITY
        bogie, body = self.sinks(load - empty)
        springs = secondary_springs(self, load, empty, body)
        left, right = self.pair.sides(self.wheel_radius, self.half_gauge)
        return Model(
            bodies=self._bodies(bogie, bogie + body),
            elements=(self._secondary(springs, self.secondary_height - bogie), *(self._primary(i) for i in (1, 2))),
            nonlinear=(
                self.bump_stop("bump_stop", "bogie", 0.0, self.secondary_height - bogie),
                *springs.elements(self, "", "bogie", 0.0, self.secondary_height - bogie),
            ),
            wheelsets=tuple(
                Wheelset(
                    f"wheelset{i}", self.wheelset_spin_inertia, self.wheel_radius, self.primary_half_spacing, "bogie"
                )
                for i in (1, 2)
            ),
            contact=ContactTable.build(left, right),
            law=contact_law(
                self.adhesion, left.stiffness(), self.wheel_load, self.wheelset_mass, self.contact_damping_ratio
            ),
            reference="bogie",
            trailing_pivot=2.0 * self.semi_bogie_spacing,
            chord_yaw="body",
            path=LongitudinalPath("bogie", self.secondary_height - bogie),
        )

    @property
    def empty_body(self) -> LoadedBody:
        """Half of a body. Its pitch and yaw are held; their inertia only serves what holds them in Exudyn."""
        held = self.body_mass * self.semi_bogie_spacing**2 / 3.0
        return LoadedBody(self.body_mass, (self.body_roll_inertia, held, held), 0.0, 0.0, self.body_height)

    @property
    def wheel_load(self) -> float:
        """Static vertical force of one wheel [N]."""
        return (self.body_mass + self.bogie_mass + 2.0 * self.wheelset_mass) * GRAVITY / 4.0

    def _bodies(self, bogie_sunk: float, body_sunk: float) -> tuple[Body, ...]:
        wheelset_free = ("y", "z", "roll", "yaw")
        inertia = (self.wheelset_yaw_inertia, self.wheelset_spin_inertia, self.wheelset_yaw_inertia)
        body = self.loaded_body
        return (
            Body(
                "body",
                body.mass,
                body.inertia,
                (0.0, body.left, body.height - body_sunk),
                ("y", "z", "roll"),
                sunk=body_sunk,
            ),
            Body(
                "bogie",
                self.bogie_mass,
                (self.bogie_roll_inertia, self.bogie_pitch_inertia, self.bogie_yaw_inertia),
                (0.0, 0.0, self.bogie_height - bogie_sunk),
                ("y", "z", "roll", "pitch", "yaw"),
                sunk=bogie_sunk,
            ),
            *(
                Body(f"wheelset{i}", self.wheelset_mass, inertia, (x, 0.0, self.wheel_radius), wheelset_free)
                for i, x in ((1, self.semi_wheelbase), (2, -self.semi_wheelbase))
            ),
        )

    def _secondary(self, springs: SecondarySprings, height: float) -> LinearElement:
        dampers = (0.0, self.secondary_lateral_damping, self.secondary_vertical_damping)
        damping = both_sides(dampers, self.secondary_half_spacing)
        damping += both_sides((self.yaw_damper_damping, 0.0, 0.0), self.yaw_damper_half_spacing)
        return LinearElement(
            "secondary",
            "body",
            "bogie",
            (0.0, 0.0, height),
            couple_alone(springs.stiffness),
            damping,
            (0.0, 0.0, springs.force),
            finite=True,
        )

    def _primary(self, number: int) -> LinearElement:
        springs = (self.primary_longitudinal_stiffness, self.primary_lateral_stiffness, self.primary_vertical_stiffness)
        dampers = (self.primary_longitudinal_damping, self.primary_lateral_damping, self.primary_vertical_damping)
        x = self.semi_wheelbase if number == 1 else -self.semi_wheelbase
        load = 0.5 * (self.loaded_body.mass + self.bogie_mass) * GRAVITY
        return LinearElement(
            f"primary{number}",
            "bogie",
            f"wheelset{number}",
            (x, 0.0, self.wheel_radius),
            both_sides(springs, self.primary_half_spacing),
            both_sides(dampers, self.primary_half_spacing),
            (0.0, 0.0, load),
        )


def both_sides(values: tuple[float, float, float], half_spacing: float) -> np.ndarray:
    """`sides` for bodies that are held along the track."""
    return couple_alone(sides(values, half_spacing))


def couple_alone(matrix: np.ndarray) -> np.ndarray:
    """A stiffness or damping (6, 6) for bodies that are held along the track.

    Along x only the couple that turns the bodies in yaw is kept: every body is held at its place along the track,
    and against that holding the springs' common longitudinal stiffness would resist the bogie's pitch, which
    wheelsets that are free to roll do not. The force that they carry along the track follows from the holding and
    pitches the bogie by `model.LongitudinalPath`.
    """
    total = matrix.copy()
    total[0, :] = total[:, 0] = 0.0
    return total
