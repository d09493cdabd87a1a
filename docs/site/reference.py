"""Reference pages, generated from the code: commands, keys of a scenario, plug-ins, Python."""

import io
from collections.abc import Iterable, Mapping
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any

from estimators.interface import ESTIMATORS
from experiments import commands
from experiments.cli import build_parser
from experiments.reporting.text import first_sentence
from railsim.effects.interface import EFFECTS
from railsim.scenario import Scenario, described_scenarios
from railsim.sensors.errors import SensorErrors
from railsim.sensors.interface import SENSORS
from railsim.sensors.logger import LoggerErrors
from railsim.spec import Spec
from railsim.speed import Constant, Driven, Profile
from railsim.track.files import TRACKS, read_track
from railsim.track.flexible import FlexibleTrack
from railsim.track.survey import TrackErrors
from railsim.vehicles.interface import PARAMETER_SETS, VEHICLES

PUBLIC: Mapping[str, tuple[str, ...]] = {
    "Describe and run": (
        "railsim.scenario.load_scenario",
        "railsim.scenario.Scenario",
        "railsim.simulation.simulate",
        "railsim.many.simulate_many",
        "railsim.simulation.measure",
    ),
    "Read what came out": (
        "railsim.truth.Truth",
        "railsim.recording.Recording",
        "railsim.recording.read_measurements",
        "railsim.measurements.Measurements",
        "railsim.errors.InputError",
    ),
    "Estimate and score": (
        "estimators.interface.Estimator",
        "estimators.interface.Estimate",
        "estimators.interface.Online",
        "experiments.scoring.score.score",
    ),
    "Bases of plug-ins": (
        "railsim.spec.Spec",
        "railsim.spec.quantity",
        "railsim.sensors.interface.Sensor",
        "railsim.effects.interface.Effect",
        "railsim.effects.interface.Setup",
        "railsim.vehicles.interface.Vehicle",
        "experiments.scoring.interface.Scorer",
        "experiments.figures.interface.Figure",
    ),
}
"""Public names of Python, by what they are for: a check of their docstrings goes by this table too."""


WRITTEN: Mapping[str, tuple[str, str]] = {
    "track": ("curve_r400", "name of a [track](scenarios.md#tracks), or path of a CSV file"),
    "track_errors": ("{vertical_std: 0.0002}", "errors of the surveyed track in the recording, below"),
    "vehicle": ("{name: manchester, body_mass: 18000}", "[vehicle](vehicles.md) and its parameters, or its name alone"),
    "flexible_track": ("{}", "rails that give, below"),
    "effects": ("[{kind: weak_yaw_damper, factor: 0.2}]", "list of [effects](effects.md), unknown to estimators"),
    "sensors": (
        "[{kind: gyro, name: bogie, body: bogie, axes: [pitch], rate: 256, errors: mems}]",
        "list of [sensors](sensors.md)",
    ),
    "speed": ("{kind: constant, speed: 20}", "one of three kinds, below"),
    "traction": (
        "[{wheelset: 1, time: [0, 10], torque: [0, 2000]}]",
        "`torque`, `brake` or `slip` of wheelsets over time",
    ),
}
"""Keys of a scenario that hold more than a number: an example, and what it is."""


def pages() -> dict[str, str]:
    """Text of every generated reference page, by its path in the site."""
    return {
        "reference/commands.md": commands_page(),
        "reference/scenario.md": scenario_page(),
        "reference/python.md": python_page(),
        "reference/estimators.md": estimators_page(),
        "reference/sensors.md": sensors_page(),
        "reference/effects.md": effects_page(),
        "reference/vehicles.md": vehicles_page(),
        "reference/scenarios.md": scenarios_page(),
    }


def commands_page() -> str:
    """What `railsim COMMAND --help` prints, for each command."""
    names = [path.stem.rstrip("_").replace("_", "-") for path in Path(commands.__path__[0]).glob("[!_]*.py")]
    parts = ["# Commands", "Every command and all its options, as `--help` prints them."]
    for name in sorted(names):
        text = io.StringIO()
        with redirect_stdout(text), suppress(SystemExit):
            build_parser().parse_args([name, "--help"])
        parts += [f"## {name}", f"```text\n{text.getvalue().strip()}\n```"]
    return "\n\n".join(parts)


def scenario_page() -> str:
    """Every key of a scenario file, and of what stands in it."""
    parts = [
        "# Scenario keys",
        "A scenario is a YAML file. `railsim run SCENARIO --set KEY=VALUE` changes any key; a dot goes deeper: "
        "`--set vehicle.body_mass=20000`. Units are SI. A key without a default must be given.",
        "Keys that hold more than a number:",
        "\n".join(
            ["| key | for example | what it is |", "|---|---|---|"]
            + [f"| `{key}` | `{example}` | {text} |" for key, (example, text) in WRITTEN.items()]
        ),
        "All keys:",
        fields_table(Scenario),
    ]
    for title, part in (
        ("speed: {kind: constant}", Constant),
        ("speed: {kind: profile}", Profile),
        ("speed: {kind: driven}", Driven),
        ("track_errors", TrackErrors),
        ("flexible_track", FlexibleTrack),
        ("errors of a sensor", SensorErrors),
        ("logger, among the errors of a sensor", LoggerErrors),
    ):
        parts += [f"## {title}", first_line(part), fields_table(part)]
    return "\n\n".join(parts)


def python_page() -> str:
    """The public names, which mkdocstrings fills in."""
    parts = [
        "# Python",
        "Names that a program of yours may rely on. All numbers are SI units unless a name says otherwise.",
    ]
    for title, names in PUBLIC.items():
        parts += [f"## {title}", *(f"::: {name}\n    options:\n      heading_level: 3" for name in names)]
    return "\n\n".join(parts)


def estimators_page() -> str:
    """Each estimator: what it needs, what more brings, its settings."""
    parts = [
        "# Estimators",
        "For each estimator: the channels that it needs, what more channels bring, and its settings.",
    ]
    for name, found in ESTIMATORS.classes().items():
        parts += [f"## {name}", first_line(found)]
        parts += [bullets("Needs", (f"`{channel}`" for channel in found.requires))] if found.requires else []
        parts += [bullets("With more channels", more(found.adds))] if found.adds else []
        parts += [fields_table(found)]
    return "\n\n".join(part for part in parts if part)


def more(adds: Mapping[str, str]) -> Iterable[str]:
    """What channels add, one line each thing."""
    for text in dict.fromkeys(adds.values()):
        yield f"{text}: " + ", ".join(f"`{key}`" for key, what in adds.items() if what == text)


def sensors_page() -> str:
    """Each kind of sensor and the presets of its errors."""
    parts = ["# Sensors", "Kinds that a scenario's `sensors` may name. Fields of `errors` are in the scenario keys."]
    for name, found in SENSORS.classes().items():
        presets = ", ".join(f"`{preset}`" for preset in found.presets)
        parts += [f"## {name}", first_line(found), fields_table(found)]
        parts += [f"Presets of `errors`: {presets}."] if presets else []
    return "\n\n".join(parts)


def effects_page() -> str:
    """Each effect with its fields, and how it shows."""
    parts = ["# Effects, all fields", "A scenario lists effects as `effects: [{kind: NAME, FIELD: VALUE}]`."]
    for name, found in EFFECTS.classes().items():
        parts += [f"## {name}", first_line(found), f"How it shows: {found.signature}.", fields_table(found)]
    return "\n\n".join(parts)


def vehicles_page() -> str:
    """Each vehicle with all its parameters."""
    parts = ["# Vehicles", "Names that a scenario's `vehicle` may have, with their parameters."]
    for name, found in VEHICLES.classes().items():
        parts += [f"## {name}", first_line(found), fields_table(found)]
    parts += [
        "## Parameter sets",
        bullets("YAML files that change one of them", (f"`{n}`" for n in PARAMETER_SETS.paths())),
    ]
    return "\n\n".join(parts)


def scenarios_page() -> str:
    """Shipped scenarios and tracks."""
    scenarios = [f"| `{name}` | {cell(text)} |" for name, text in described_scenarios().items()]
    comments = {name: "\n".join(read_track(name).comments) for name in TRACKS.paths()}
    tracks = [f"| `{name}` | {cell(first_sentence(text))} |" for name, text in comments.items()]
    head = "| name | what it is |\n|---|---|"
    return "\n".join(
        ["# Scenarios and tracks\n", "## Scenarios\n", head, *scenarios, "", "## Tracks\n", head, *tracks, ""]
    )


def fields_table(spec: type[Spec]) -> str:
    """Fields of a `Spec`: default, unit, bounds, source. Empty where it has none."""
    rows = []
    for name, field in spec.model_fields.items():
        unit, source = spec.about(name)
        low, high = spec.limits(name)
        bounds = " to ".join("…" if bound is None else f"{bound:g}" for bound in (low, high))
        default = "must be given" if field.is_required() else _shown(field.default)
        rows.append(
            f"| `{name}` | {cell(default)} | {cell(unit)} | {'' if low is high is None else bounds} | {cell(source)} |"
        )
    return "\n".join(["| key | default | unit | bounds | source |", "|---|---|---|---|---|", *rows]) if rows else ""


def _shown(value: Any) -> str:
    if isinstance(value, Spec):
        return "its own defaults"
    if value is None or value == ():
        return "none"
    text = f"{value:g}" if isinstance(value, float) else str(value).lower() if isinstance(value, bool) else str(value)
    return f"`{text if len(text) <= 60 else text[:57] + '...'}`" if text else "empty"


def first_line(found: type) -> str:
    """First paragraph of a class's docstring."""
    return " ".join((found.__doc__ or "").strip().partition("\n\n")[0].split())


def bullets(title: str, items: Iterable[str]) -> str:
    """A titled list."""
    return "\n".join([f"{title}:\n", *(f"- {item}" for item in items)])


def cell(text: str) -> str:
    """Text that may stand in a cell of a table."""
    return text.replace("|", "\\|").replace("\n", " ")
