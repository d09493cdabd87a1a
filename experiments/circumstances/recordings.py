"""Recordings of circumstances: simulated and measured once, kept in a folder, found again by what they hold."""

from pathlib import Path
from typing import Any

from experiments.circumstances.circumstance import Circumstance
from railsim.digests import write_marker
from railsim.errors import InputError
from railsim.files import read_json, write_folder_atomically, write_json
from railsim.recording import Recording
from railsim.scratch import scratch_folder
from railsim.simulation import about_recording, measure, simulate

ENGINE = "compiled"
RECORDING, ABOUT = "recording", "circumstance.json"


def folder_of(name: str, circumstance: Circumstance, fast: bool, folder: Path) -> Path:
    """Where the recording of a circumstance stands: another digest is another folder."""
    return folder / f"{name}-{circumstance.digest(fast)[:12]}"


def recorded(name: str, circumstance: Circumstance, fast: bool, folder: Path) -> Recording:
    """The recording of a circumstance, made where it is not there yet; it appears whole or not at all.

    Raises
    ------
    InputError : the circumstance cannot be run, or the folder not be written.
    """
    target = folder_of(name, circumstance, fast, folder)
    if not target.is_dir():
        try:
            with write_folder_atomically(target) as aside:
                _make(name, circumstance, fast, aside)
        except InputError as error:
            raise InputError(str(error) if name in str(error) else f"circumstance '{name}': {error}") from None
    return Recording.open(target / RECORDING)


def check(name: str, circumstance: Circumstance, fast: bool, folder: Path) -> None:
    """Raise `InputError` where a circumstance that is not recorded yet has a wrong key or value."""
    if not folder_of(name, circumstance, fast, folder).is_dir():
        with scratch_folder() as scratch:
            scenario = circumstance.scenario(name, Path(scratch), fast)
            try:
                _nominal(circumstance, about_recording(scenario)["vehicle"])
                _ = scenario.setup
            except InputError as error:
                raise InputError(f"circumstance '{name}': {error}") from None


def _make(name: str, circumstance: Circumstance, fast: bool, aside: Path) -> None:
    with scratch_folder(parent=aside) as scratch:
        stated = circumstance.scenario(name, Path(scratch), fast)
        real = stated.but(sensors=circumstance.real_sensors(stated.sensors))
        truth = simulate(real, ENGINE, Path(scratch) / "truth", cache=False)
        measure(truth, real, folder=aside / RECORDING)
        _state(aside / RECORDING / "about.json", circumstance, [one.data_sheet() for one in stated.sensors])
    write_json(aside / ABOUT, {"name": name, "fast": fast, **circumstance.model_dump(mode="json")})


def _state(path: Path, circumstance: Circumstance, sheets: list[dict]) -> None:
    """Write into about.json what an engineer believes: the data sheets, and nominal parameters that may be wrong."""
    about = read_json(path, "a recording")
    about["vehicle"] = _nominal(circumstance, about["vehicle"])
    about["sensors"] = sheets
    write_json(path, about)
    write_marker(path.parent)


def _nominal(circumstance: Circumstance, vehicle: dict[str, Any]) -> dict[str, Any]:
    """The vehicle's parameters as the engineer believes them; raises `InputError` where there is no such number."""
    believed = dict(vehicle)
    for field, factor in circumstance.nominal.items():
        if not isinstance(vehicle.get(field), int | float):
            known = ", ".join(vehicle)
            raise InputError(f"nominal.{field}: about.json has no such number; there are: {known}")
        believed[field] *= factor
    return believed
