"""Runs whose recordings are spoilt on purpose: speeds, tracks and events of service, one suite of sensors."""

from typing import Any

from railsim import simulate
from railsim.scenario import Scenario
from railsim.truth import Truth

LENGTH = 30.0  # s
SUITE: list[dict[str, Any]] = [
    {"kind": "accelerometer", "name": "bogie", "body": "bogie", "rate": 256},
    {"kind": "gyro", "name": "bogie", "body": "bogie", "rate": 256},
    {"kind": "accelerometer", "name": "bogie_lead", "body": "bogie", "position": [1.2, 1.0, 0], "rate": 256},
    *(
        {
            "kind": "accelerometer",
            "name": f"axlebox{i}_{side}",
            "body": f"wheelset{i}",
            "axes": ["y", "z"],
            "rate": 1024,
        }
        | {"position": [0, 1.0 if side == "left" else -1.0, 0], "errors": "axlebox"}
        for i, side in ((1, "left"), (1, "right"), (2, "left"))
    ),
    {"kind": "displacement", "name": "primary1_left", "rate": 256, "errors": "transducer"},
    {"kind": "displacement", "name": "primary1_right", "rate": 256, "errors": "transducer"},
    {"kind": "tachometer", "name": "wheelset1", "body": "wheelset1", "rate": 64, "radius_error": 0.012},
    {"kind": "tachometer", "name": "wheelset2", "body": "wheelset2", "rate": 64, "radius_error": -0.006},
    {"kind": "gnss", "name": "gnss", "body": "body", "rate": 8, "position": [0, 0, 3.8]},
]
"""Two accelerometers and a gyro on the bogie, three axleboxes, two transducers, two tachometers, GNSS."""

RUNS: dict[str, dict[str, Any]] = {
    "good, 20 m/s": {"track": "straight_erri_low", "vehicle": "manchester", "speed": 20.0},
    "good, 35 m/s": {"track": "straight_erri_low", "vehicle": "class175", "speed": 35.0},
    "good, 8 m/s": {"track": "straight_erri_low", "vehicle": "class175", "speed": 8.0},
    "poor, 50 m/s": {"track": "straight_erri_high", "vehicle": "manchester", "speed": 50.0},
    "poor, 25 m/s": {"track": "straight_erri_high", "vehicle": "manchester", "speed": 25.0},
    "curve, 14 m/s": {"track": "curve_r400", "vehicle": "class175", "speed": 14.0, "start": 60.0},
    "curve, 18 m/s": {"track": "curve_r400", "vehicle": "manchester", "speed": 18.0, "start": 60.0},
    "joints, 17 m/s": {"track": "jointed_60ft", "vehicle": "class175", "speed": 17.0},
    "crossover, 6 m/s": {"track": "crossover_1in13", "vehicle": "class175", "speed": 6.0},
    "speeding up": {"track": "straight_erri_low", "vehicle": "class175", "speed": [[0, 4, 26, 30], [16, 16, 32, 32]]},
    "nearly a stop": {"track": "straight_erri_low", "vehicle": "manchester"}
    | {"speed": [[0, 2, 11, 17, 26, 30], [11, 11, 2, 2, 11, 11]]},
    "a stop": {
        "track": "straight_erri_low",
        "vehicle": "class175",
        "speed": [[0, 2, 10, 18, 26, 30], [9, 9, 0, 0, 10, 10]],
    },
    "slide": {"track": "straight_erri_low", "vehicle": "class175", "speed": [[0, 5, 25, 30], [28, 28, 20, 20]]}
    | {"traction": [{"wheelset": 1, "time": [0, 9, 10, 20, 21, 60], "slip": [0, 0, 0.2, 0.2, 0, 0]}]},
}
"""By name: what a scenario of that run states."""


_SPEEDS = (12.0, 20.0, 30.0, 16.0, 24.0, 36.0)
_VEHICLES = ("class175", "manchester", "class175_whole", "manchester_whole")
_TRACKS = ("straight_erri_low", "straight_erri_high", "curve_r400", "jointed_60ft", "crossover_1in13")
_TRACKS += ("paddington_bristol_like",)
_SLOWER = {"curve_r400": 18.0, "crossover_1in13": 6.0, "jointed_60ft": 17.0}
"""m/s that the track allows: the radius of the curve, the crossover, the length of the jointed track."""
PLACES: dict[str, dict[str, Any]] = {
    f"{vehicle} on {track}": {"track": track, "vehicle": vehicle}
    | {"speed": min(_SPEEDS[(number + place) % len(_SPEEDS)], _SLOWER.get(track, 40.0))}
    | ({"start": 60.0} if track == "curve_r400" else {})
    for number, vehicle in enumerate(_VEHICLES)
    for place, track in enumerate(_TRACKS)
}
"""Four vehicles on six tracks, each at another speed."""
RUNS |= PLACES


def scenario(name: str, grade: str, shift: float = 0.0) -> Scenario:
    """The run of that name with sensors of a grade ("industrial", "mems"), `shift` metres further on."""
    values = dict(RUNS[name])
    speed = values.pop("speed")
    profile = {"kind": "constant", "speed": speed}
    if isinstance(speed, list):
        profile = {"kind": "profile", "time": speed[0], "speed": speed[1]}
    start = values.pop("start", 25.0) + shift
    sensors = [({"errors": grade} if _graded(one) else {}) | one for one in SUITE]
    return Scenario.build(
        {**values, "speed": profile, "start": start, "duration": LENGTH, "output_rate": 1024, "sensors": sensors}
    )


def truth_of(name: str, fast: bool, shift: float = 0.0) -> Truth:
    """The simulated run; `fast` by the compiled engine."""
    return simulate(scenario(name, "industrial", shift), engine="compiled" if fast else "exudyn")


def _graded(sensor: dict[str, Any]) -> bool:
    """Whether a sensor comes in grades: those on the bogie's frame."""
    return sensor["kind"] in ("accelerometer", "gyro") and "errors" not in sensor
