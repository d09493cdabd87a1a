"""A vehicle by its name, with changed parameters, or from a file that changes another one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from railsim.errors import InputError
from railsim.profiles.files import shipped_profiles
from railsim.registry import pick
from railsim.settings import load_yaml
from railsim.vehicles.interface import PARAMETER_SETS, VEHICLES, Vehicle

PROFILES = ("wheel", "rail", "right_wheel", "right_rail")
"""Keys of a wheel-rail pair that name profiles."""


def vehicle_names() -> list[str]:
    """Names of all vehicles: of classes and of parameter sets in files.

    Raises
    ------
    InputError : a class and a file have the same name; or a plug-in cannot be read.
    """
    classes, files = VEHICLES.classes(), PARAMETER_SETS.paths()
    for name in classes.keys() & files.keys():
        raise InputError(f"vehicle '{name}' stands in '{classes[name].__module__}' and in '{files[name]}'; rename one")
    return sorted([*classes, *files])


def build_vehicle(given: Any, folder: Path = Path()) -> Vehicle:
    """The vehicle that a scenario names.

    Parameters
    ----------
    given : a name; a path of a YAML file that changes a vehicle (`base: manchester`, and the fields that differ); or a
        mapping with the name or path as `name`, and further fields. With `base` in the mapping, it is itself what such
        a file holds, under a name of its own.
    folder : in which the paths of the vehicle and of its profiles are looked for before the working folder.

    Raises
    ------
    InputError : no such vehicle, an unknown field, a value out of bounds.
    """
    if isinstance(given, Vehicle):
        return given
    values = {"name": given} if isinstance(given, str) else dict(given) if isinstance(given, Mapping) else {}
    values = _with_profiles(values, folder)
    name = values.pop("name", None)
    if not isinstance(name, str):
        raise InputError(f"vehicle: give a name, or a name and parameters; there are: {', '.join(vehicle_names())}")
    if name.endswith(".py"):
        cure = "put it into FOLDER/vehicles, name it without .py, and add --plugins FOLDER"
        raise InputError(f"vehicle '{name}': a vehicle in Python has no path in a scenario; {cure}")
    if "base" not in values:
        file = _file(name, folder)
        if file is None:
            known = VEHICLES.classes()
            pick(known if name in known else dict.fromkeys(vehicle_names()), name, "vehicle")
            return known[name].build(values, "vehicle")
        name, values = file.stem, _contents(file) | values
    return _changed(name, values)


def _file(name: str, folder: Path) -> Path | None:
    """File of a parameter set."""
    if not name.endswith(PARAMETER_SETS.suffix):
        return PARAMETER_SETS.paths().get(name)
    beside = folder / name
    return beside if beside.is_file() else Path(name)


def _contents(file: Path) -> dict[str, Any]:
    path, text = PARAMETER_SETS.read(file)
    values = load_yaml(text, f"vehicle '{path}'")
    if not isinstance(values, dict) or not isinstance(values.get("base"), str):
        raise InputError(f"vehicle '{path}': say what it changes, for example 'base: manchester', then the fields")
    return _with_profiles(values, path.parent)


def _with_profiles(values: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Profiles of a wheel-rail pair that lie in the folder, by their whole path."""
    pair = values.get("pair")
    if not isinstance(pair, Mapping):
        return values
    shipped = shipped_profiles()
    named = {key: one for key, one in pair.items() if key in PROFILES and isinstance(one, str) and one not in shipped}
    found = {key: str((folder / one).resolve()) for key, one in named.items() if (folder / one).is_file()}
    return {**values, "pair": {**pair, **found}}


def _changed(name: str, values: dict[str, Any]) -> Vehicle:
    """A vehicle of a class with changed parameters; those that are not given are noted."""
    base = VEHICLES.pick(str(values.pop("base")))
    nominal = [field for field in base.model_fields if field not in Vehicle.model_fields]
    assumed = values.pop("assumed", [field for field in nominal if field not in values])
    return base.build({**values, "label": name, "assumed": assumed}, f"vehicle '{name}'")
