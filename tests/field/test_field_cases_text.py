"""Text tables as people have them: comments, headers, separators, decimal marks, ends of files, several sensors."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile

from railsim.errors import InputError
from tests.field.imports import SPEED, UP, csv, followed, mapped, proposed, rate, refusal, run, time, told, values

AT = np.arange(60)
TIME = AT / 100
AZ = np.round(9.8 + 0.01 * (AT % 7), 3)
PLAIN = csv({"t": TIME, "az": AZ}, numbers="%.3f")
LINES = PLAIN.splitlines()


def right(recording: Any, count: int = 60) -> bool:
    """Whether the first samples are those that were written."""
    np.testing.assert_allclose(values(recording), AZ[:count], atol=1e-9)
    np.testing.assert_allclose(time(recording), TIME[:count], atol=1e-9)
    return rate(recording) == 100.0


def whole(**options: Any) -> dict[str, Any]:
    """A map with these options of `csv`."""
    return mapped(whole={"csv": options})


@pytest.mark.parametrize("where", [0, 1, 20, 61])
def test_comment_lines_stand_anywhere(tmp_path: Path, where: int):
    lines = [*LINES[:where], "# walk", "#", *LINES[where:]]
    assert right(run(tmp_path, "\n".join(lines) + "\n", mapped()))


@pytest.mark.parametrize("tail", ["", "\t"])
def test_table_without_header(tmp_path: Path, tail: str):
    text = "".join(f"{1000 * t:.2f}\t-120\t44\t{16300 + i}{tail}\n" for i, t in enumerate(TIME))
    asked = mapped({"kind": "seconds", "column": "t", "unit": "ms"}, channel={"unit": "g", "scale": 2.0**-14})
    line = refusal(tmp_path, text, asked)
    assert "names no columns" in line
    names = proposed(line, "csv:")["csv"]["names"]
    assert names == ["a", "b", "c", "d"]
    named = mapped({"kind": "seconds", "column": "a", "unit": "ms"}, channel={"column": "d", "unit": "g"})
    by_name = run(tmp_path, text, named | {"csv": {"names": names}})
    by_number = mapped({"kind": "seconds", "column": 1, "unit": "ms"}, channel={"column": 4, "unit": "g"})
    for seen in (by_name, run(tmp_path, text, by_number), run(tmp_path, text, by_number | {"csv": {"header": "none"}})):
        np.testing.assert_allclose(values(seen) / 9.80665, 16300 + AT)
        np.testing.assert_allclose(time(seen), TIME, atol=1e-9)


def test_first_row_is_not_taken_as_names(tmp_path: Path):
    asked = mapped({"kind": "seconds", "column": "0.000"}, channel={"column": "9.800"})
    assert "names no columns" in refusal(tmp_path, "\n".join(LINES[1:]) + "\n", asked)


def test_trailing_separator_below_a_header_without_one(tmp_path: Path):
    text = "\n".join([LINES[0], *(f"{line}," for line in LINES[1:])]) + "\n"
    assert right(run(tmp_path, text, mapped()))


@pytest.mark.parametrize("stated", [{}, {"separator": ",", "decimal": ","}])
def test_quoted_decimal_commas(tmp_path: Path, stated: dict[str, str]):
    rows = [f'"{t:.2f}","{a:.3f}"'.replace(".", ",") for t, a in zip(TIME, AZ, strict=True)]
    seen = run(tmp_path, "\n".join(['"t","az"', *rows]) + "\n", whole(**stated))
    assert right(seen)
    assert stated or told(seen, "decimal mark ','")


@pytest.mark.parametrize("mark", ["\u202f", "\u00a0", "'", "\u2019", " ", "."])
def test_thousands(tmp_path: Path, mark: str):
    rows = [f"{t:.2f}".replace(".", ",") + f";1{mark}0{i:02d},5" for i, t in enumerate(TIME)]
    seen = run(tmp_path, "\n".join(["t;az", *rows]) + "\n", mapped())
    np.testing.assert_allclose(values(seen), 1000.5 + AT)
    assert told(seen, "thousands are separated by")


def test_typographers_minus(tmp_path: Path):
    seen = run(tmp_path, PLAIN.replace(",9", ",\u22129"), mapped())
    np.testing.assert_allclose(values(seen), -AZ, atol=1e-9)


@pytest.mark.parametrize("decimal", [".", ","])
def test_one_column(tmp_path: Path, decimal: str):
    text = "\n".join(["az", *(f"{a:.3f}".replace(".", decimal) for a in AZ)]) + "\n"
    seen = run(tmp_path, text, mapped({"kind": "rows"}, rate=100))
    assert right(seen)
    assert told(seen, "one column")


def test_blanks_separate_columns(tmp_path: Path):
    text = "".join(f"  {t:8.3f}   {a:10.4f}\n" for t, a in zip(TIME, AZ, strict=True))
    seen = run(tmp_path, text, mapped({"kind": "seconds", "column": 1}, channel={"column": 2}))
    assert right(seen)
    assert told(seen, "separated by blanks")


@pytest.mark.parametrize(
    ("end", "note"),
    [
        (b"\0" * 512, "512 zero bytes at the end"),
        (b"\x1a", "hold no whole row at the end"),
        (b"0.6", "hold no whole row at the end"),
        (b"0.600,9.", "fewer decimals: cut"),
        (b"EOF\n\n", "hold no whole row at the end"),
        (b"End of measurement\n3 channels\n", "hold no whole row at the end"),
    ],
)
def test_end_of_a_file_is_left_out_and_said(tmp_path: Path, end: bytes, note: str):
    seen = run(tmp_path, PLAIN.encode() + end, mapped())
    assert right(seen)
    assert told(seen, note)


def test_whole_last_line_without_a_line_end_is_kept(tmp_path: Path):
    seen = run(tmp_path, PLAIN.rstrip("\n"), mapped())
    assert right(seen)
    assert told(seen, "no line end")


@pytest.mark.parametrize("broken", [b"0.3\0\0\0\0\0\0,9.8", b"0.300", b"0.300,9.8,1,2"])
def test_broken_line_is_refused_and_left_out_where_the_map_says_so(tmp_path: Path, broken: bytes):
    data = "\n".join(LINES[:31]).encode() + b"\n" + broken + b"\n" + "\n".join(LINES[32:]).encode() + b"\n"
    line = refusal(tmp_path, data, mapped())
    assert "line 32" in line
    seen = run(tmp_path, data, mapped(whole=proposed(line, "csv:")))
    np.testing.assert_allclose(values(seen), np.delete(AZ, 30), atol=1e-9)
    assert told(seen, "line 32")


def test_row_without_its_last_text_is_taken_and_said_one_without_its_first_number_refused(tmp_path: Path):
    rows = [f'{line},"a"' for line in LINES[1:]]
    rows[20] = LINES[21]
    seen = run(tmp_path, "\n".join([f"{LINES[0]},note", *rows]) + "\n", mapped())
    assert right(seen)
    assert told(seen, "line 22")
    rows[20] = f'{LINES[21].partition(",")[2]},"a"'
    line = refusal(tmp_path, "\n".join([f"{LINES[0]},note", *rows]) + "\n", mapped())
    assert "line 22: 2 cells for 3 columns" in line and "'lost'" not in line


def test_line_that_states_the_separator_and_repeated_headers(tmp_path: Path):
    lines = [line.replace(",", ";") for line in LINES]
    seen = run(tmp_path, "\ufeff" + "\n".join(["sep=;", *lines[:30], lines[0], *lines[30:]]) + "\n", mapped())
    assert right(seen)
    assert told(seen, "as line 1 says") and told(seen, "the header stands again in line 32")


@pytest.mark.parametrize("stated", [{}, {"units_row": True}, {"units_row": 2}])
def test_names_descriptions_and_units(tmp_path: Path, stated: dict[str, Any]):
    text = "\n".join(["t;az", "Zeit seit Start;vertikal", "s;cm/s^2", *(one.replace(",", ";") for one in LINES[1:])])
    seen = run(tmp_path, text + "\n", mapped(channel={"unit": None}, whole={"csv": stated}))
    np.testing.assert_allclose(values(seen), AZ / 100, atol=1e-9)
    assert told(seen, "unit 'cm/s^2', as the file states")


@pytest.mark.parametrize("skip", [0, 6])
def test_lines_of_a_data_logger_above_the_names(tmp_path: Path, skip: int):
    head = [
        '"Format","CSV File",,,"Workbook","w"', '"Venue","line","","","Worksheet",""', '"Vehicle","tram","","",""',
        '"Log Date","03/05/2024",,,"Origin Time","0.000","s"', '"Sample Rate","100.000","Hz"', "",
        '"t","v","az"', '"s","km/h","m/s^2"', "", "",
    ]  # fmt: skip
    rows = [f'"{t:.3f}","{50 + t:.2f}","{a:.3f}"' for t, a in zip(TIME, AZ, strict=True)]
    asked = mapped(channel={"unit": None}, whole={"csv": {"skip": skip}})
    asked["tables"][0]["channels"][SPEED] = {"column": "v"}
    seen = run(tmp_path, "\n".join([*head, *rows]) + "\n", asked)
    assert right(seen)
    np.testing.assert_allclose(values(seen, SPEED), np.round(50 + TIME, 2) / 3.6)


@pytest.mark.parametrize("skip", [0, 13])
def test_labview_measurement_file(tmp_path: Path, skip: int):
    """A heading 'Comment' has no cells below it."""
    head = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t,", "Multi_Headings\tNo",
        "X_Columns\tOne", "***End_of_Header***\t", "\t", "Channels\t2\t\t", "Samples\t60\t60\t", "X0\t0,0\t0,0\t",
        "Delta_X\t0,01\t0,01\t", "***End_of_Header***\t\t\t", "X_Value\tAcc_z\tAcc_y\tComment",
    ]  # fmt: skip
    rows = [f"{t:.2f}\t{a:.3f}\t0,5".replace(".", ",") for t, a in zip(TIME, AZ, strict=True)]
    asked = mapped({"kind": "seconds", "column": "X_Value"}, channel={"column": "Acc_z"}, whole={"csv": {"skip": skip}})
    seen = run(tmp_path, "\n".join([*head, *rows]) + "\n", asked)
    assert right(seen)
    assert told(seen, "'Comment' holds nothing")


@pytest.mark.parametrize("skip", [0, 3])
def test_oscilloscope_export(tmp_path: Path, skip: int):
    """A time column for each sample time; the slow one ends early, the file with EOF."""
    slow = [f"{50 * i},{10 + 0.1 * i:.2f}" if i < 12 else "," for i in range(60)]
    rows = [f"{10 * i},{a:.3f},{late}" for i, (a, late) in enumerate(zip(AZ, slow, strict=True))]
    text = "\n".join(["Name,scope,,", "Start,638503200000000000,,", "", "fast,az,slow,v", *rows, "EOF", ""])
    asked = mapped({"kind": "seconds", "column": "fast", "unit": "ms"}, whole={"csv": {"skip": skip}})
    channel = {SPEED: {"column": "v", "unit": "m/s"}}
    asked["tables"].append(
        {"time": {"kind": "seconds", "column": "slow", "unit": "ms"}, "rows": "filled", "channels": channel}
    )
    seen = run(tmp_path, text, asked)
    assert right(seen)
    np.testing.assert_allclose(values(seen, SPEED), 10 + 0.1 * np.arange(12))
    assert rate(seen, SPEED) == 20.0


def test_columns_of_one_name_are_told_by_number(tmp_path: Path):
    text = csv({"t": TIME, "az": AZ, "b": TIME, "c": AZ - 1}).replace("t,az,b,c", "t,az,t,az")
    line = refusal(tmp_path, text, mapped({"kind": "seconds", "column": 1}))
    assert "numbers 2 and 4" in line
    cure = proposed(line, "column:")
    assert right(run(tmp_path, text, mapped({"kind": "seconds", "column": 1}, channel=cure)))
    other = run(tmp_path, text, mapped({"kind": "seconds", "column": 3}, channel={"column": 4}))
    np.testing.assert_allclose(values(other), AZ - 1)


@pytest.mark.parametrize("header", [True, False])
def test_rows_of_several_sensors(tmp_path: Path, header: bool):
    """Of different lengths, the sensor's name first."""
    rows = ["info;time;text"] if header else []
    for i, t in enumerate(TIME):
        rows.append(f"acc;{t:.3f};0.1;0.2;{AZ[i]:.3f}")
        if i % 10 == 0:
            rows.append(f"geo;{t + 0.004:.3f};24.34;60.07;gps;{12 + 0.1 * i:.2f};0;1")
    text = "\n".join(rows) + "\n"
    line = refusal(tmp_path, text, mapped())
    assert "as those of several sensors" in line
    cure = proposed(line, "rows:")
    other = {"acc": "geo", "geo": "acc"}[next(iter(cure["rows"]["where"].values()))]
    picks = {"acc": (UP, 5, "m/s2"), "geo": (SPEED, 6, "m/s")}
    tables = []
    for name, rule in ((next(iter(cure["rows"]["where"].values())), cure), (other, {"rows": {"where": {1: other}}})):
        channel, column, unit = picks[name]
        channels = {channel: {"column": column, "unit": unit}}
        tables.append({"time": {"kind": "seconds", "column": 2}, "channels": channels} | rule)
    seen = run(tmp_path, text, mapped() | {"tables": tables})
    assert right(seen)
    np.testing.assert_allclose(values(seen, SPEED), 12 + 0.1 * AT[::10])
    np.testing.assert_allclose(time(seen, SPEED), TIME[::10] + 0.004)


def test_sensor_named_in_a_column_of_a_table_with_a_header(tmp_path: Path):
    rows = [f"{t:.3f},{name},{v:.3f}" for t, a in zip(TIME, AZ, strict=True) for name, v in (("az", a), ("v", a + 1))]
    tables = [
        {"time": {"kind": "seconds", "column": "time"}, "rows": {"where": {"sensor": name}},
         "channels": {channel: {"column": "value", "unit": unit}}}
        for name, channel, unit in (("az", UP, "m/s2"), ("v", SPEED, "m/s"))
    ]  # fmt: skip
    tables[1]["rate"] = 100
    seen = run(tmp_path, "\n".join(["time,sensor,value", *rows]) + "\n", mapped() | {"tables": tables})
    assert right(seen)
    np.testing.assert_allclose(values(seen, SPEED), AZ + 1, atol=1e-9)
    line = refusal(tmp_path, "\n".join(["time,sensor,value", *rows]) + "\n", followed(
        mapped() | {"tables": tables}, {"rows": {"where": {"sensor": "gyro"}}}))  # fmt: skip
    assert "no row holds sensor = gyro" in line


def _python_of(line: str) -> str:
    return line.partition('python -c "')[2].partition('"')[0]


@pytest.mark.parametrize("kind", ["wav", "bin", "npy"])
def test_other_container_becomes_text_by_the_line_of_python(tmp_path: Path, kind: str):
    path = tmp_path / f"log.{kind}"
    if kind == "wav":
        scipy.io.wavfile.write(path, 100, np.int16(1000 * AZ))
    elif kind == "npy":
        np.save(path, AZ)
    else:
        AZ.astype("<f4").tofile(path)
    line = refusal(tmp_path, path, mapped())
    subprocess.run([sys.executable, "-c", _python_of(line)], cwd=tmp_path, check=True)
    asked = mapped({"kind": "rows"}, rate=100, channel={"column": 1})
    if kind == "wav":
        assert "100 Hz" in line
        asked["tables"][0]["channels"][UP]["scale"] = 1e-3
    seen = run(tmp_path, tmp_path / "log.csv", asked)
    np.testing.assert_allclose(values(seen), AZ, rtol=1e-4)


@pytest.mark.parametrize(
    ("head", "line"),
    [
        (b"PK\x03\x04" + b"\0" * 26 + b"[Content_Types].xml", "is a spreadsheet .*save its sheet as CSV"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 50, "is an old spreadsheet"),
        (b"|CF,2,1,1;|CK,1,3,1,1;|NO,1,5", "is an imc FAMOS file; export it as CSV"),
        (b"SQLite format 3\0" + b"\0" * 50, "is a SQLite database; export the table"),
        (b"LOGG" + b"\x90\0\0\0" * 9, "is a CAN log"),
        (b'<?xml version="1.0"?><kml version="2.2">', "is XML or HTML, no table"),
        (b'[{"t": 0, "az": 1}]', "is JSON, no table"),
        (b"\x1f\x8b\x08" + b"\0" * 40, "is an archive; unpack it"),
    ],
)  # fmt: skip
def test_other_container_is_named(tmp_path: Path, head: bytes, line: str):
    path = tmp_path / "log.dat"
    path.write_bytes(head)
    with pytest.raises(InputError, match=line):
        run(tmp_path, path, mapped())


@pytest.mark.parametrize("names", [("acc", "gyro"), ("17", "18")])
def test_mixed_rows_are_said_and_taken_apart_by_the_line_of_the_message(tmp_path: Path, names: tuple[str, str]):
    """Both sensors have the same stamps: spreading their rows would mix them."""
    rows = [
        f"{t:.3f},{name},{v:.3f}" for t, a in zip(TIME, AZ, strict=True) for name, v in zip(names, (a, 0), strict=True)
    ]
    text = "\n".join(["time,sensor,az", *rows]) + "\n"
    asked = mapped({"kind": "seconds", "column": "time"})
    line = refusal(tmp_path, text, asked)
    assert "rows of several sensors" in line and "'spread'" not in line
    assert refusal(tmp_path, text, followed(asked, {"repair": ["spread"]})) == line
    assert right(run(tmp_path, text, followed(asked, proposed(line, "rows:"))))


def test_oscilloscope_with_columns_for_its_settings(tmp_path: Path):
    """Numbers in columns 4 and 5, beside settings in the first three of some rows."""
    settings = ["Record Length,6.0e+01,", "Sample Interval,1.0e-02,", "Source,CH1,", *[",,"] * 57]
    rows = [f"{head},{t:.4f},{a:.3f}" for head, t, a in zip(settings, TIME, AZ, strict=True)]
    asked = mapped({"kind": "seconds", "column": 4}, channel={"column": 5})
    assert right(run(tmp_path, "\n".join(rows) + "\n", asked))


@pytest.mark.parametrize("head", [
    ["X,CH1,Start,Increment,", "Sequence,Volt,-6.0e-03,1.0e-02,"], ["X,CH1", "second,Volt"],
    ["SCOPE WR,2,x", "Segments,1,SegmentSize,60", "Segment,TrigTime,Since", "X,CH1"],
])  # fmt: skip
def test_lines_of_oscilloscopes_above_the_data(tmp_path: Path, head: list[str]):
    tail = ",," if head[0].endswith(",") else ""
    rows = [f"{t:.4f},{a:.3f}{tail}" + ("," if tail else "") for t, a in zip(TIME, AZ, strict=True)]
    asked = mapped({"kind": "seconds", "column": "X"}, channel={"column": "CH1"})
    assert right(run(tmp_path, "\n".join([*head, *rows]) + "\n", asked))


def test_thousands_of_whole_numbers_beside_decimal_commas(tmp_path: Path):
    text = "t;az\n" + "".join(f"{t:.2f}".replace(".", ",") + f";1.2{i:02d}\n" for i, t in enumerate(TIME))
    np.testing.assert_allclose(values(run(tmp_path, text, mapped())), 1200 + AT)


def test_column_of_where_that_is_not_there_is_named(tmp_path: Path):
    line = refusal(tmp_path, PLAIN, followed(mapped(), {"rows": {"where": {"sensr": "acc"}}}))
    assert line.endswith("no column 'sensr'; there are: 't', 'az'")


def test_quoted_cell_over_several_lines(tmp_path: Path):
    rows = [f'{line},"{"wet" + chr(10) + "rail" if number == 7 else "dry"}"' for number, line in enumerate(LINES[1:])]
    rows[30] = rows[30].replace(",9", ",x9")
    line = refusal(tmp_path, "\n".join([f"{LINES[0]},note", *rows]) + "\n", mapped())
    assert "row 33 holds 'x9" in line  # the line of the file
    rows[30] = rows[30].replace(",x9", ",9")
    assert right(run(tmp_path, "\n".join([f"{LINES[0]},note", *rows]) + "\n", mapped()))
