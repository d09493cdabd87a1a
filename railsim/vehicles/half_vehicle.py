"""Half vehicle: half a car body on one bogie with two wheelsets; the missing half holds the body's yaw and pitch."""

import numpy as np

from railsim.constants import GRAVITY
from railsim.contact.functions import ContactTable
from railsim.model import Body, LinearElement, LongitudinalPath, Model, Wheelset
from railsim.spec import quantity
from railsim.vehicles.running_gear import IWNICKI, RunningGear, contact_law, sides

HALF = f"{IWNICKI}; half of the whole body"


class HalfVehicle(RunningGear, frozen=True):
    """Parameters per axlebox (primary) and per side (secondary) unless the name says otherwise."""

    body_mass: float = quantity(16000.0, unit="kg", source=HALF, gt=0.0)
    body_roll_inertia: float = quantity(28400.0, unit="kg m2", source=HALF, gt=0.0)

    def model(self) -> Model:
        """Bodies `body`, `bogie`, `wheelset1` (leading), `wheelset2`: 16 free coordinates and two spins."""
        left, right = self.pair.sides(self.wheel_radius, self.half_gauge)
        return Model(
            bodies=self._bodies(),
            elements=(self._secondary(), *(self._primary(i) for i in (1, 2))),
            nonlinear=(self.bump_stop("bump_stop", "bogie", 0.0),),
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
            path=LongitudinalPath("bogie", self.secondary_height),
        )

    @property
    def wheel_load(self) -> float:
        """Static vertical force of one wheel [N]."""
        return (self.body_mass + self.bogie_mass + 2.0 * self.wheelset_mass) * GRAVITY / 4.0

    def _bodies(self) -> tuple[Body, ...]:
        wheelset_free = ("y", "z", "roll", "yaw")
        inertia = (self.wheelset_yaw_inertia, self.wheelset_spin_inertia, self.wheelset_yaw_inertia)
        pitch = (
            self.body_mass * self.semi_bogie_spacing**2 / 3.0
        )  # held: serves only the absolute engine's holding forces
        return (
            Body(
                "body",
                self.body_mass,
                (self.body_roll_inertia, pitch, pitch),
                (0.0, 0.0, self.body_height),
                ("y", "z", "roll"),
            ),
            Body(
                "bogie",
                self.bogie_mass,
                (self.bogie_roll_inertia, self.bogie_pitch_inertia, self.bogie_yaw_inertia),
                (0.0, 0.0, self.bogie_height),
                ("y", "z", "roll", "pitch", "yaw"),
            ),
            *(
                Body(f"wheelset{i}", self.wheelset_mass, inertia, (x, 0.0, self.wheel_radius), wheelset_free)
                for i, x in ((1, self.semi_wheelbase), (2, -self.semi_wheelbase))
            ),
        )

    def _secondary(self) -> LinearElement:
        springs = (
            self.secondary_longitudinal_stiffness,
            self.secondary_lateral_stiffness,
            self.secondary_vertical_stiffness,
        )
        dampers = (0.0, self.secondary_lateral_damping, self.secondary_vertical_damping)
        stiffness = both_sides(springs, self.secondary_half_spacing)
        stiffness[3, 3] += self.roll_bar_stiffness
        damping = both_sides(dampers, self.secondary_half_spacing)
        damping += both_sides((self.yaw_damper_damping, 0.0, 0.0), self.yaw_damper_half_spacing)
        load = self.body_mass * GRAVITY
        return LinearElement(
            "secondary",
            "body",
            "bogie",
            (0.0, 0.0, self.secondary_height),
            stiffness,
            damping,
            (0.0, 0.0, load),
            finite=True,
        )

    def _primary(self, number: int) -> LinearElement:
        springs = (self.primary_longitudinal_stiffness, self.primary_lateral_stiffness, self.primary_vertical_stiffness)
        dampers = (self.primary_longitudinal_damping, self.primary_lateral_damping, self.primary_vertical_damping)
        x = self.semi_wheelbase if number == 1 else -self.semi_wheelbase
        load = 0.5 * (self.body_mass + self.bogie_mass) * GRAVITY
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
    """`sides` for bodies that are held along the track.

    Along x only the couple that turns the bodies in yaw is kept: every body is held at its place along the track,
    and against that holding the springs' common longitudinal stiffness would resist the bogie's pitch, which
    wheelsets that are free to roll do not. The force that they carry along the track follows from the holding and
    pitches the bogie by `model.LongitudinalPath`.
    """
    total = sides(values, half_spacing)
    total[0, :] = total[:, 0] = 0.0
    return total
