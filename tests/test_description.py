"""about.json is checked as a whole: what is wrong is named in one line, before anything computes with it."""

import copy
from typing import Any

import pytest

from railsim.description import check_description
from railsim.errors import InputError

SHEET: dict[str, Any] = {
    "name": "bogie", "kind": "gyro", "body": "bogie", "position": [0.0, 0.1, -0.2], "rate": 256.0,
    "channels": ["bogie.rate_yaw [rad/s]"], "errors": {"noise_density": 1e-4, "range": None, "latency": 0.004},
}  # fmt: skip
ABOUT: dict[str, Any] = {
    "origin": "test",
    "vehicle": {"name": "test", "body_mass": 3e4, "conicity_function": [[0.0, 0.1], [1e-3, 0.2]]},
    "sensors": [SHEET],
    "track": {"errors": {"vertical_std": 1e-4, "survey": None}},
    "mine": {"any": ["thing", 1, None]},
}


def test_what_is_usual_and_what_is_unknown_may_stand():
    check_description(ABOUT)
    check_description({"origin": "", "vehicle": {}, "sensors": []})


@pytest.mark.parametrize(
    ("path", "value", "line"),
    [
        (("sensors", 0, "position"), [0.0, []], "sensors.0.position"),
        (("sensors", 0, "position", 1), "left", "sensors.0.position.1"),
        (("sensors", 0, "position", 1), float("nan"), "sensors.0.position.1 is not a finite number"),
        (("sensors", 0, "channels"), 3.5, "sensors.0.channels"),
        (("sensors", 0, "channels"), [1], "sensors.0.channels.0"),
        (("sensors", 0, "errors"), "good", "sensors.0.errors"),
        (("sensors", 0, "errors", "latency"), [1], "latency"),
        (("sensors", 0, "errors", "noise_density"), -1.0, "noise_density"),
        (("sensors", 0, "rate"), 0, "sensors.0.rate"),
        (("sensors", 0, "name"), None, "sensor 1 has no"),
        (("track",), [], "track"),
        (("track", "errors", "vertical_std"), {"a": 1}, "track.errors.vertical_std"),
        (("vehicle", "body_mass"), float("inf"), "vehicle.body_mass is not a finite number"),
        (("vehicle", "body_mass"), 10**400, "vehicle.body_mass is not a finite number"),
        (("vehicle",), [1], '"vehicle" is missing or of the wrong kind'),
        (("start",), 2024, "start"),
    ],
)
def test_what_cannot_be_used_is_named_in_one_line(path: tuple[Any, ...], value: Any, line: str):
    about = copy.deepcopy(ABOUT)
    place: Any = about
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(InputError) as caught:
        check_description(about)
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_nesting_without_end_is_refused():
    deep: Any = 1
    for _ in range(10_000):
        deep = [deep]
    with pytest.raises(InputError, match="nested or filled beyond use"):
        check_description(ABOUT | {"mine": deep})
