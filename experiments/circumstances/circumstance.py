"""A circumstance: what differs from home, in one entry of a YAML file."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from railsim.distribution import shipped_folder
from railsim.errors import InputError
from railsim.overrides import override
from railsim.registry import Files, pick
from railsim.scenario import Scenario, digest_of, load_scenario
from railsim.sensors.errors import SensorErrors
from railsim.sensors.interface import Sensor
from railsim.settings import dump_yaml, load_yaml
from railsim.spec import Spec, quantity
from railsim.speed import Profile
from railsim.track.featured import zones
from railsim.track.files import format_track
from railsim.track.spectra import Band, spectra
from railsim.track.synthesis import Segment, Transition, design, distances, faded_irregularities
from railsim.track.track import Track

HOME = "home"
"""Group of the circumstances in which nothing differs from what an estimator is told."""
SHIPPED = shipped_folder("experiments", "circumstances") / "circumstances.yaml"
BASES = Files("circumstance_bases", "experiments/circumstances/bases", ".yaml", "base of circumstances")
FAST_SHARE = 0.6
"""Share of the duration, and of the times in it, that is run with `--fast`."""
CHOSEN = "circumstance"
SPACING = 0.2  # m
BAND = Band(shortest=1.0, longest=100.0)
FADE = 20.0  # m, over which irregularities come in
STRAIGHT, TRANSITION = 200.0, 60.0  # m, before and behind a curve; of each clothoid
CUT = 0.4
"""Bandwidth of a sensor over its rate, where the rate is lowered."""


class Line(Spec, frozen=True):
    """A track made for one circumstance: irregularities of its own seed on straight track or through one curve."""

    spectrum: str = quantity("erri_low", unit="-", source="railsim.track.spectra")
    seed: int = quantity(unit="-", source=CHOSEN, ge=0)
    roughness: float = quantity(1.0, unit="- of the spectrum's amplitudes", source=CHOSEN, gt=0.0)
    radius: float | None = quantity(None, unit="m, to the left +; none: straight", source=CHOSEN)
    cant: float = quantity(0.0, unit="m over 1.5 m, right rail higher +", source=CHOSEN)
    clean: float = quantity(60.0, unit="m at the start, without irregularities", source="the bases' start", ge=0.0)
    length: float = quantity(2000.0, unit="m", source=CHOSEN, ge=100.0)
    shortest: float = quantity(BAND.shortest, unit="m, wavelength", source=CHOSEN, ge=0.1, le=BAND.shortest)
    stiffness: float | None = quantity(None, unit="N/m under a rail; none: not stated", source=CHOSEN, gt=0.0)
    zones: tuple[tuple[float, float, float], ...] = quantity(
        (), unit="m, m, -: from, to, factor of the stiffness", source=CHOSEN
    )

    def track(self) -> Track:
        """Rows 0.2 m apart, or four in the shortest wave."""
        spacing = min(SPACING, self.shortest / 4.0)
        s = distances(self.length, spacing)
        rng = np.random.default_rng([self.seed, 50])
        waves = Band(self.shortest, BAND.longest)
        columns = faded_irregularities(spectra(self.spectrum), s, spacing, rng, waves, (self.clean, FADE))
        if self.stiffness is not None:
            columns["stiffness"] = zones(s, self.stiffness, self.zones)
        columns = {
            name: np.round(values if name == "stiffness" else self.roughness * values, 8)
            for name, values in columns.items()
        }
        if self.radius is not None:
            arc = Segment(self.length - 2.0 * (STRAIGHT + TRANSITION), 1.0 / self.radius, self.cant)
            pieces = [Segment(STRAIGHT), Transition(TRANSITION), arc, Transition(TRANSITION), Segment(STRAIGHT)]
            columns |= {name: np.round(values, 11) for name, values in design(pieces, s).items() if name != "gradient"}
        return Track(s, columns, "line", [f"Made by railsim circumstances: {self.model_dump(mode='json')}"])


class Circumstance(Spec, frozen=True):
    """What is so in a run, and what about.json says of it.

    `set` changes keys of the base scenario; keys that about.json never shows (payload, adhesion, a sensor's bias) stay
    unknown to estimators, others are known. `effects` are never known.
    """

    what: str = quantity(unit="-", source=CHOSEN, min_length=1)
    group: str = quantity(unit="-", source=CHOSEN, pattern=r"^[a-z][a-z_]*$")
    base: str = quantity("whole", unit="scenario in `bases`", source=CHOSEN)
    duration: float | None = quantity(None, unit="s; none: the base's", source=CHOSEN, gt=0.0)
    set: dict[str, Any] = quantity({}, unit="values by dotted key of the scenario", source=CHOSEN)
    effects: tuple[dict[str, Any], ...] = quantity((), unit="as in a scenario", source=CHOSEN)
    line: Line | None = quantity(None, unit="none: the scenario's track", source=CHOSEN)
    nominal: dict[str, float] = quantity({}, unit="factors on about.json's vehicle, by field", source=CHOSEN)
    noise: float = quantity(1.0, unit="- of the noise densities of the data sheets", source=CHOSEN, gt=0.0)
    rate: float | None = quantity(None, unit="Hz, in place of 256 Hz", source=CHOSEN, gt=0.0)
    lost: tuple[str, ...] = quantity((), unit="names of sensors that are not there", source=CHOSEN)

    def digest(self, fast: bool = False) -> str:
        """SHA-256 over all that shapes the recording but the program."""
        _, text = BASES.read(self.base)
        apart = {"what", "group"}
        return digest_of([self.model_dump(mode="json", exclude=apart), hashlib.sha256(text.encode()).hexdigest(), fast])

    def scenario(self, name: str, folder: Path, fast: bool = False) -> Scenario:
        """The scenario that is simulated; its sensors are those of the data sheets.

        Parameters
        ----------
        folder : where the track that is made for it is written.

        Raises
        ------
        InputError : a key or value is wrong; the line begins with the circumstance's name.
        """
        path, text = BASES.read(self.base)
        values = load_yaml(text, f"'{path}'")
        try:
            for key, value in self.set.items():
                values = override(values, key, value)
            values["effects"] = [*values.get("effects", []), *self.effects]
            values["name"] = name
            values["duration"] = self.duration or values["duration"]
            if self.line is not None:
                values["track"] = str(folder / "track.csv")
                Path(values["track"]).write_text(format_track(self.line.track()), encoding="utf-8")
            values["sensors"] = [self._sensor(dict(one)) for one in values["sensors"] if one["name"] not in self.lost]
            scenario = _read(values, folder)
        except InputError as error:
            raise InputError(f"circumstance '{name}': {error}") from None
        return _shorter(scenario) if fast else scenario

    def _sensor(self, values: dict[str, Any]) -> dict[str, Any]:
        """Settings of a sensor at the lower rate, its filter below half of that."""
        if self.rate is None or values["rate"] != 256:
            return values
        given = values.get("errors", {})
        errors: dict[str, Any] = {"preset": given} if isinstance(given, str) else dict(given)
        errors["bandwidth"] = min(float(errors.get("bandwidth", np.inf)), CUT * self.rate)
        return values | {"rate": self.rate, "errors": errors}

    def real_sensors(self, sensors: tuple[Sensor, ...]) -> tuple[Sensor, ...]:
        """The sensors as they are, by those of the data sheets."""
        if self.noise == 1.0:
            return sensors
        return tuple(one.but(errors=_noisier(one.errors, self.noise)) for one in sensors)


def read_circumstances(source: Path | str | None = None) -> dict[str, Circumstance]:
    """Circumstances by name, in the order of the file.

    Raises
    ------
    InputError : no such file, not YAML, an entry with a wrong key or value.
    """
    path = SHIPPED if source is None else Path(source)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        raise InputError(f"cannot read circumstances '{path}'; give a YAML file of them") from None
    values = load_yaml(text, f"'{path}'")
    if not isinstance(values, dict) or not values or not all(isinstance(key, str) for key in values):
        raise InputError(
            f"'{path}' must hold circumstances by name, for example 'wet: {{group: ..., what: ...}}'; "
            "put off, on, yes and no in quotes"
        )
    circumstances = {name: Circumstance.build(one, name) for name, one in values.items()}
    for name, one in circumstances.items():
        pick(BASES.paths(), one.base, f"{name}.base")
    return circumstances


def chosen(circumstances: Mapping[str, Circumstance], names: list[str]) -> dict[str, Circumstance]:
    """Those of the names or groups that are given; all where none is.

    Raises
    ------
    InputError : there is none of that name or group.
    """
    if not names:
        return dict(circumstances)
    groups = {one.group for one in circumstances.values()}
    for name in names:
        if name not in groups:
            pick(circumstances, name, "circumstance")
    return {name: one for name, one in circumstances.items() if name in names or one.group in names}


def _read(values: dict[str, Any], folder: Path) -> Scenario:
    """A scenario from plain values, by way of a file as any other one."""
    path = folder / "scenario.yaml"
    path.write_text(dump_yaml(values), encoding="utf-8")
    return load_scenario(path)


def _shorter(scenario: Scenario) -> Scenario:
    speed = scenario.speed
    if isinstance(speed, Profile):
        speed = speed.but(time=tuple(FAST_SHARE * time for time in speed.time))
    traction = tuple(one.but(time=tuple(FAST_SHARE * time for time in one.time)) for one in scenario.traction)
    return scenario.but(speed=speed, traction=traction, duration=FAST_SHARE * scenario.duration)


def _noisier(errors: SensorErrors, factor: float) -> SensorErrors:
    return errors.but(noise_density=factor * errors.noise_density, bias_instability=factor * errors.bias_instability)
