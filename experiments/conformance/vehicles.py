"""What every vehicle must do, one from a file included."""

from collections.abc import Iterable
from functools import cache

import numpy as np

from experiments.conformance.interface import Check, described, fields_with_unit_and_source
from railsim.constants import GRAVITY
from railsim.dynamics.channels import channel_names
from railsim.model import AXES, Model
from railsim.scenario import Scenario
from railsim.simulation import build_run, load_engine
from railsim.vehicles.interface import VEHICLES, Vehicle
from railsim.vehicles.lookup import build_vehicle

MOVED = 1e-4  # m, of a body that stands on smooth straight track
CARRIED = 1e-3  # of the weight
SAME = 1e-9  # of the largest entry of a matrix
ODD = ("y", "roll", "yaw")
"""Coordinates that change their sign in a mirror along the track."""


def class_is_described(vehicle: Vehicle) -> Iterable[str]:
    """The class has a docstring, and fields with unit and source."""
    yield from described(type(vehicle))
    yield from fields_with_unit_and_source(type(vehicle))


def rebuilt_from_its_settings(vehicle: Vehicle) -> Iterable[str]:
    """What a scenario holds of it makes the same vehicle."""
    settings = vehicle.settings()
    if vehicle.label or VEHICLES.find(vehicle.kind):
        made = build_vehicle(settings)
    else:  # a file outside of the plug-in folders, which no scenario can name yet
        made = type(vehicle).build({key: value for key, value in settings.items() if key != "name"}, "vehicle")
    if made != vehicle:
        yield "is not rebuilt from its own settings"


def model_fits_together(vehicle: Vehicle) -> Iterable[str]:
    """Bodies, elements and wheelsets refer to each other, and to the nominal wheel radius."""
    model = vehicle.model()
    model.check()
    names = [body.name for body in model.bodies]
    if wrong := sorted({wheelset.body for wheelset in model.wheelsets} - set(names)):
        yield f"wheelset '{wrong[0]}' has no body"
    if vehicle.nominal().get("wheel_radius") != model.wheelsets[0].radius:
        yield "wheel_radius of its nominal parameters is not that of its wheelset"
    for element in model.elements:
        for name, matrix in (("stiffness", element.stiffness), ("damping", element.damping)):
            if not np.allclose(matrix, matrix.T) or np.linalg.eigvalsh(matrix).min() < -1e-6:
                yield f"{name} of element '{element.name}' is not symmetric, or gives energy"


def mirror_symmetric(vehicle: Vehicle) -> Iterable[str]:
    """Mass, stiffness and damping are the same in a mirror along the track."""
    model = vehicle.model()
    sign = np.tile([-1.0 if axis in ODD else 1.0 for axis in AXES], len(model.bodies))
    for name, matrix in (("stiffness", model.stiffness), ("damping", model.damping)):
        mirrored = sign[:, None] * matrix * sign
        if np.abs(mirrored - matrix).max() > SAME * np.abs(matrix).max():
            yield f"{name} is not the same in a mirror along the track"
    off = [body.name for body in model.bodies if body.position[1] != 0.0]
    if off:
        yield f"{', '.join(off)}: centre of gravity beside the track's centre line"


def stands_on_its_rails(vehicle: Vehicle) -> Iterable[str]:
    """On smooth straight track nothing moves, and the rails carry its weight."""
    model, channels = _second(vehicle)
    for body in model.bodies:
        for axis in ("y", "z"):
            values = channels[f"{body.name}.{axis} [m]"]
            if np.abs(values - values[0]).max() > MOVED:
                yield f"{body.name} moves by {np.abs(values - values[0]).max():.2g} m along {axis}"
    wheels = [name for name in channels if name.startswith("wheel") and name.endswith(".normal_force [N]")]
    carried = sum(float(channels[name][-1]) for name in wheels)
    free = [body.mass for body in model.bodies if "z" in body.free]
    weight = sum(free) * GRAVITY + sum(model.vertical_load.values())
    if abs(carried / weight - 1.0) > CARRIED + _slope(channels):
        yield f"the rails carry {carried:.0f} N of its {weight:.0f} N"


CHECKS: tuple[Check[Vehicle], ...] = (
    class_is_described,
    rebuilt_from_its_settings,
    model_fits_together,
    mirror_symmetric,
    stands_on_its_rails,
)


@cache
def _second(vehicle: Vehicle) -> tuple[Model, dict[str, np.ndarray]]:
    """A second at 20 m/s over smooth straight track."""
    settings = {"name": "conformance", "track": "smooth", "speed": {"kind": "constant", "speed": 20.0}}
    run = build_run(Scenario.build({**settings, "vehicle": vehicle, "start": 60.0, "duration": 1.0}))
    rows = np.concatenate(list(load_engine("compiled")(run)))
    return run.model, dict(zip(channel_names(run.model), rows.T, strict=True))


def _slope(channels: dict[str, np.ndarray]) -> float:
    """Share by which normal forces exceed the loads, as they lean with the contacts."""
    angles = [values[-1] for name, values in channels.items() if name.endswith(".contact_angle [rad]")]
    return float(1.0 / np.cos(np.abs(angles).max()) - 1.0)
