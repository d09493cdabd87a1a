"""Units as loggers write them, and latitude and longitude, from file to recording."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from railsim import Recording
from railsim.constants import GRAVITY
from railsim.errors import InputError
from railsim.field.importing import import_file
from railsim.field.units import converter


def imported(folder: Path, text: str, channels: dict[str, Any], **more: Any) -> Recording:
    """Import a table with a column of time 't'."""
    table = {"time": {"kind": "seconds", "column": "t"}, "channels": channels}
    (folder / "data.csv").write_text(text)
    (folder / "map.yaml").write_text(
        yaml.safe_dump({"origin": "test", "vehicle": "manchester", "tables": [table]} | more)
    )
    import_file(folder / "data.csv", folder / "map.yaml", folder / "out")
    return Recording.open(folder / "out")


@pytest.mark.parametrize(
    ("given", "wanted", "factor"),
    [
        ("m·s⁻²", "m/s2", 1.0),
        ("m s⁻²", "m/s2", 1.0),
        ("mm·s⁻²", "m/s2", 1e-3),
        ("rad·s⁻¹", "rad/s", 1.0),
        ("m/sec^2", "m/s2", 1.0),
        ("m/s**2", "m/s2", 1.0),
        ("m/(s^2)", "m/s2", 1.0),
        ("m.s-2", "m/s2", 1.0),
        ("M/S2", "m/s2", 1.0),
        ("G", "m/s2", 9.80665),
        ("mG", "m/s2", 9.80665e-3),
        ("milli-g", "m/s2", 9.80665e-3),
        ("g", "kg", 1e-3),
        ("G", "T", 1e-4),
        ("µT", "T", 1e-6),
        ("dps", "rad/s", np.pi / 180),
        ("mdps", "rad/s", np.pi / 180e3),
        ("º/s", "rad/s", np.pi / 180),
        ("RPM", "rad/s", np.pi / 30),
        ("1/min", "rad/s", np.pi / 30),
        ("min⁻¹", "rad/s", np.pi / 30),
        ("r/min", "rad/s", np.pi / 30),
        ("RPS", "rad/s", 2 * np.pi),
        ("mdeg/s", "rad/s", np.pi / 180e3),
        ("[m/s2]", "m/s2", 1.0),
        ("g's", "m/s2", 9.80665),
        ("mGal", "m/s2", 1e-5),
        ("feet", "m", 0.3048),
        ("U/min", "rad/s", np.pi / 30),
        ("Km/h", "m/s", 1 / 3.6),
        ("km/hr", "m/s", 1 / 3.6),
        ("kts", "m/s", 1852 / 3600),
        ("MPH", "m/s", 0.44704),
        ("mm/s", "m/s", 1e-3),
        ("µm", "m", 1e-6),
        ("μm", "m", 1e-6),
        ("um", "m", 1e-6),
        ("µε", "-", None),
        ("10000/m", "1/m", 1e-4),
        ("1/10000m", "1/m", 1e-4),
        ("rad/km", "1/m", 1e-3),
        ("deg/100ft", "1/m", np.pi / 180 / 30.48),
    ],
)
def test_loggers_names(given: str, wanted: str, factor: float | None):
    if factor is None:
        with pytest.raises(InputError, match="unknown unit"):
            converter(given, wanted, "x")
    else:
        assert converter(given, wanted, "x").factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("given", "wanted", "line", "cure"),
    [
        ("ms⁻²", "m/s2", "write 'm s⁻²'", "m s⁻²"),
        ("m/s⁻²", "m/s2", r"correct the unit \(m/s2, g", "m/s2"),
        ("1/s", "rad/s", "'rev/s' where it counts revolutions", "rev/s"),
        ("knotts", "m/s", r"did you mean 'knots'\?", "knots"),
        ("deg/sek", "rad/s", r"did you mean 'sec'\?", "deg/sec"),
        ("deg", "1/m", "deg/100ft", "deg/100ft"),
        ("count", "m/s2", r"counts need 'scale'", "mg"),
    ],
)
def test_the_cure_that_is_named_works(given: str, wanted: str, line: str, cure: str):
    with pytest.raises(InputError, match=line):
        converter(given, wanted, "x")
    assert converter(cure, wanted, "x").factor > 0


def test_counts_with_a_scale(tmp_path: Path):
    rows = "t,az\n" + "".join(f"{i / 10},16384\n" for i in range(30))
    name = "bogie.acceleration_z [m/s2]"
    recording = imported(tmp_path, rows, {name: {"column": "az", "unit": "mg", "scale": 0.061}})
    assert recording.measurements[name] == pytest.approx(16384 * 0.061e-3 * 9.80665)


def test_capital_g_of_the_file(tmp_path: Path):
    rows = '"t","Vert [G]","Speed [km/h]"\n' + "".join(f"{i / 10},1.0,36\n" for i in range(30))
    channels = {"bogie.acceleration_z [m/s2]": {"column": "Vert [G]"}, "gnss.speed [m/s]": {"column": "Speed [km/h]"}}
    measured = imported(tmp_path, rows, channels).measurements
    assert measured["bogie.acceleration_z [m/s2]"] == pytest.approx(GRAVITY, rel=1e-3)
    assert measured["gnss.speed [m/s]"] == pytest.approx(10.0)


def test_latitude_and_longitude_stay_in_degrees(tmp_path: Path):
    rows = "t,lat,lon,v\n" + "".join(f"{i},{48.8 + 1e-4 * i:.6f},{2.3 - 1e-4 * i:.6f},12\n" for i in range(20))
    wrong = {"gnss.position_north [m]": {"column": "lat", "unit": "deg"}}
    with pytest.raises(InputError, match=r"keep degrees as '<sensor>.latitude \[deg\]'"):
        imported(tmp_path, rows, wrong)
    channels = {
        "gnss.latitude [deg]": {"column": "lat", "unit": "deg"},
        "gnss.longitude [deg]": {"column": "lon", "unit": "°"},
        "gnss.speed [m/s]": {"column": "v", "unit": "m/s"},
    }
    measured = imported(tmp_path, rows, channels).measurements
    assert measured["gnss.latitude [deg]"] == pytest.approx(48.8 + 1e-4 * np.arange(20), abs=1e-9)
    assert measured["gnss.longitude [deg]"][-1] == pytest.approx(2.3 - 19e-4, abs=1e-9)
    assert measured.about["speed_source"] == "gnss.speed [m/s]"


def test_exponents_with_a_d(tmp_path: Path):
    rows = "t,az\n" + "".join(f"{i / 10},{'9.8D+00' if i % 3 else '9.8'}\n" for i in range(30))
    name = "bogie.acceleration_z [m/s2]"
    assert imported(tmp_path, rows, {name: {"column": "az", "unit": "m/s2"}}).measurements[name] == pytest.approx(9.8)


def test_what_a_vehicle_takes_from_its_base_is_listed(tmp_path: Path):
    rows = "t,az\n" + "".join(f"{i / 10},9.8\n" for i in range(30))
    channels = {"bogie.acceleration_z [m/s2]": {"column": "az", "unit": "m/s2"}}
    vehicle = {"name": "manchester", "body_mass": 17000.0}
    about = imported(tmp_path, rows, channels, vehicle=vehicle).measurements.about
    listed = next(text for text in about["assumptions"] if text.startswith("vehicle: as of 'manchester'"))
    assert "bogie_mass" in listed and "body_mass" not in listed


@pytest.mark.parametrize("form", ["{:.6f}° {}", "{}{:.6f}°", "{:.0f}°{:.0f}'{:.4f}\"{}"])
def test_latitude_as_text(tmp_path: Path, form: str):
    values = 48.8 + 1e-3 * np.arange(20)

    def text(value: float) -> str:
        if "'" not in form:
            return form.format(value, "S") if form.startswith("{:") else form.format("S", value)
        whole, minutes = divmod(value * 60.0, 60.0)
        return form.format(whole, int(minutes), 60.0 * (minutes % 1.0), "S")

    rows = "t;lat\n" + "".join(f"{i};{text(value)}\n" for i, value in enumerate(values))
    rows = rows.replace("3;" + text(values[3]), "3;")
    measured = imported(tmp_path, rows, {"gnss.latitude [deg]": {"column": "lat", "unit": "deg"}}).measurements
    found = measured["gnss.latitude [deg]"]
    assert np.isnan(found[3])
    assert np.delete(found, 3) == pytest.approx(np.delete(-values, 3), abs=1e-6)
    with pytest.raises(InputError, match="no angle as 48.8566"):
        imported(
            tmp_path,
            rows.replace("5;" + text(values[5]), "5;north"),
            {"gnss.latitude [deg]": {"column": "lat", "unit": "deg"}},
        )
