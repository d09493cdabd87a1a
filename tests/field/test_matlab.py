"""MATLAB files of version 5 and 7.3, and HDF5: what people save, and what cannot be read."""

import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from railsim.errors import InputError
from railsim.field.guard import Guard
from railsim.field.readers import hdf5, mat, tree
from railsim.field.readers.interface import Wanted
from tests.field.imports import SPEED, UP, mapped, rate, refusal, run, told, values
from tests.field.matlab import five, seven

TIME = np.arange(200) / 100
AZ = np.sin(7 * TIME)


@pytest.fixture(params=[five, seven], ids=["5", "7.3"])
def save(request: pytest.FixtureRequest) -> Any:
    """Either version."""
    return request.param


def test_vectors(tmp_path: Path, guard: Guard, save: Any):
    for t, az in ((TIME, AZ), (TIME[:, None], AZ[None, :]), (TIME[None, :], AZ[:, None])):
        seen = run(tmp_path, save(tmp_path / "x.mat", {"t": t, "az": az, "fs": 100.0}), mapped(), guard)
        np.testing.assert_array_equal(values(seen), AZ)
        assert rate(seen) == 100.0 and told(seen, "format MATLAB, by the file's first bytes")


def test_structs_with_units(tmp_path: Path, guard: Guard, save: Any):
    imu = {"t": TIME, "az": AZ / 9.80665, "units": {"az": "g", "t": "s"}}
    path = save(tmp_path / "x.mat", {"imu": imu, "deep": {"acc": {"data": AZ, "unit": "m/s2", "time": TIME}}})
    asked = mapped(group="imu", channel={"unit": None})
    np.testing.assert_allclose(values(run(tmp_path, path, asked, guard)), AZ, rtol=1e-14)
    asked = mapped({"kind": "seconds", "column": "imu.t"}, channel={"column": "imu.az", "unit": "g"})
    np.testing.assert_allclose(values(run(tmp_path, path, asked, guard)), AZ, rtol=1e-14)
    asked = mapped({"kind": "seconds", "column": "time"}, group="acc", channel={"column": "data", "unit": None})
    np.testing.assert_array_equal(values(run(tmp_path, path, asked, guard)), AZ)
    line = refusal(tmp_path, path, mapped(group="gyro"), guard)
    assert "no group 'gyro'; there are: " in line and "'imu'" in line
    line = refusal(tmp_path, path, mapped(group="imu", channel={"column": "a"}), guard)
    assert "no column 'a'; there are: 'az'" in line


@pytest.mark.parametrize("titles", ["names", "spalten"])
def test_matrix_with_a_list_of_names(tmp_path: Path, guard: Guard, save: Any, titles: str):
    data = np.column_stack([TIME, AZ, 3 * AZ])
    path = save(tmp_path / "x.mat", {"data": data, titles: ["t", "az", "v"], "units": ["s", "m/s2", "km/h"]})
    seen = run(tmp_path, path, mapped(channel={"unit": None}), guard)
    np.testing.assert_array_equal(values(seen), AZ)
    numbered = mapped({"kind": "seconds", "column": 1}, channel={"column": 2})
    np.testing.assert_array_equal(values(run(tmp_path, path, numbered, guard)), AZ)
    written = mapped({"kind": "seconds", "column": "data(:,1)"}, channel={"column": "data(:,2)"})
    np.testing.assert_array_equal(values(run(tmp_path, path, written, guard)), AZ)
    grouped = mapped({"kind": "seconds", "column": 1}, group="data", channel={"column": "az"})
    np.testing.assert_array_equal(values(run(tmp_path, path, grouped, guard)), AZ)
    line = refusal(tmp_path, path, mapped(channel={"column": "data"}), guard)
    assert "'data' is no single column; name one of 't', 'az', 'v'" in line


def test_channels_in_rows(tmp_path: Path, guard: Guard, save: Any):
    path = save(tmp_path / "x.mat", {"m": np.vstack([TIME, AZ])})
    asked = mapped({"kind": "seconds", "column": "m(1,:)"}, channel={"column": "m(2,:)"})
    np.testing.assert_array_equal(values(run(tmp_path, path, asked, guard)), AZ)


def test_texts_and_datenum(tmp_path: Path, guard: Guard, save: Any):
    days = 719_529.0 + 19_846.0 + TIME / 86_400
    stamps = [str(np.datetime64("2024-05-03T10:00:00.000") + np.timedelta64(10 * n, "ms")) for n in range(200)]
    path = save(tmp_path / "x.mat", {"when": days, "az": AZ, "stamps": stamps})
    seen = run(tmp_path, path, mapped({"kind": "epoch", "column": "when"}, rate=100, repair=["snap"]), guard)
    assert seen.measurements.about["start"].startswith("2024-05-03T00:00:00")
    assert told(seen, "counts datenum since 1970")
    line = refusal(tmp_path, path, mapped({"kind": "seconds", "column": "when"}), guard)
    assert "unit: datenum}" in line
    seen = run(tmp_path, path, mapped({"kind": "iso", "column": "stamps"}), guard)
    assert seen.measurements.about["start"].startswith("2024-05-03T10:00:00") and rate(seen) == 100.0


def test_columns_of_different_rates(tmp_path: Path, guard: Guard, save: Any):
    path = save(tmp_path / "x.mat", {"t": TIME, "az": AZ, "t1": TIME[::20], "v": AZ[::20] + 10})
    line = refusal(tmp_path, path, mapped(channel={"column": "v"}), guard)
    assert "'v' 10, 't' 200" in line and "put those of each rate in a table" in line
    both = mapped()
    slow = {"time": {"kind": "seconds", "column": "t1"}, "channels": {SPEED: {"column": "v", "unit": "m/s"}}}
    both["tables"].append(slow)
    seen = run(tmp_path, path, both, guard)
    np.testing.assert_array_equal(values(seen, SPEED), AZ[::20] + 10)


def test_struct_arrays_and_cells_of_version_5(tmp_path: Path, guard: Guard):
    rows = np.zeros((200, 1), dtype=[("t", object), ("az", object)])
    for n in range(200):
        rows[n, 0] = (TIME[n], AZ[n])
    both = np.zeros((1, 2), dtype=[("t", object), ("az", object)])
    both[0, 1] = (TIME, AZ)
    both[0, 0] = (TIME[:3], AZ[:3])
    mixed = np.empty((1, 2), dtype=object)
    mixed[0, 0], mixed[0, 1] = TIME, AZ
    path = tmp_path / "x.mat"
    scipy.io.savemat(path, {"rows": rows, "both": both, "mixed": mixed})
    for group in ("rows", "both(2)"):
        np.testing.assert_array_equal(values(run(tmp_path, path, mapped(group=group), guard)), AZ)
    asked = mapped({"kind": "seconds", "column": "mixed{1}"}, channel={"column": "mixed{2}"})
    np.testing.assert_array_equal(values(run(tmp_path, path, asked, guard)), AZ)


@pytest.mark.parametrize(
    ("value", "line"),
    [
        (AZ + 1j, "holds complex numbers"),
        (scipy.sparse.csc_matrix(AZ), "is a sparse matrix; in MATLAB: az = full(az)"),
        (np.zeros((4, 5, 6)), "no column 'az'"),
    ],
)
def test_what_is_no_vector_of_version_5(tmp_path: Path, guard: Guard, value: Any, line: str):
    path = tmp_path / "x.mat"
    scipy.io.savemat(path, {"t": TIME, "az": value})
    assert line in refusal(tmp_path, path, mapped(), guard)


def test_version_4(tmp_path: Path, guard: Guard):
    path = tmp_path / "x.mat"
    scipy.io.savemat(path, {"t": TIME[:, None], "az": AZ[:, None]}, format="4")
    np.testing.assert_array_equal(values(run(tmp_path, path, mapped(), guard)), AZ)


def test_files_that_are_not_whole_are_named(tmp_path: Path, guard: Guard):
    path = seven(tmp_path / "x.mat", {"t": TIME, "az": AZ})
    path.write_bytes(path.read_bytes()[:700])
    line = refusal(tmp_path, path, mapped(), guard)
    assert "a MATLAB file (version 7.3, HDF5) that is not whole" in line and "save('x.mat', '-v7')" in line
    path = tmp_path / "x.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(50))
    assert "an HDF5 file that is not whole" in refusal(tmp_path, path, mapped(), guard)
    octave = "# Created by Octave 8.4.0\n# name: t\n# type: matrix\n# rows: 1\n# columns: 3\n 0 1 2\n"
    assert "is a text file of Octave; save it there by save('-v7', 'data.mat'" in refusal(
        tmp_path, octave, mapped(), guard
    )


@pytest.mark.parametrize("ending", [".mat", ".h5"])
def test_without_h5py(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str):
    path = seven(tmp_path / f"x{ending}", {"t": TIME})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match=r"pip install 'railsim\[field\]'; or, from MATLAB, save\('x"):
        (mat if ending == ".mat" else hdf5).read(path, [Wanted(None, ("t",))])


@pytest.mark.parametrize(("kind", "cure"), [("timetable", "writetimetable(x, 'x.csv')"), ("mine", "save its numbers")])
def test_objects_of_matlab_are_named(tmp_path: Path, guard: Guard, kind: str, cure: str):
    path = seven(tmp_path / "x.mat", {"t": TIME})
    with h5py.File(path, "r+") as file:
        held = file.create_dataset("az", data=np.zeros((1, 6), np.uint32))
        held.attrs["MATLAB_class"], held.attrs["MATLAB_object_decode"] = np.bytes_(kind), 3
    line = refusal(tmp_path, path, mapped(), guard)
    assert f"'az' is an object of MATLAB's class {kind}, which MATLAB alone reads" in line and cure in line


def test_objects_of_version_5_are_named(tmp_path: Path, guard: Guard):
    """A variable of class table as MATLAB writes it: an opaque element of type 17."""
    path = five(tmp_path / "x.mat", {"t": TIME})
    with path.open("ab") as handle:
        handle.write(_opaque("az", "table") + _opaque("other", "timetable"))
    line = refusal(tmp_path, path, mapped(), guard)
    assert "'az' is an object of MATLAB's class table" in line and "writetable(x, 'x.csv')" in line


def _opaque(name: str, kind: str) -> bytes:
    def element(code: int, data: bytes) -> bytes:
        return np.array([code, len(data)], "<u4").tobytes() + data + bytes(-len(data) % 8)

    flags = element(6, np.array([17, 0], "<u4").tobytes())
    numbers = np.array([[0xDD000000], [2], [1], [1], [1], [1]], "<u4")
    array = element(6, np.array([13, 0], "<u4").tobytes()) + element(5, np.array([6, 1], "<i4").tobytes())
    array += element(1, b"") + element(6, numbers.tobytes())
    texts = b"".join(element(1, one.encode()) for one in (name, "MCOS", kind))
    return element(14, flags + texts + element(14, array))


def test_hdf5_of_other_programs(tmp_path: Path, guard: Guard):
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        one = file.create_group("run 7/imu")
        one["t"], one["az"] = TIME, AZ / 9.80665
        one["az"].attrs["units"] = "g"
        file["run 7/table"] = np.rec.fromarrays([TIME, AZ], dtype=[("t", "f8"), ("az", "f8")])
        file["run 7/matrix"] = np.column_stack([TIME, AZ])
    asked = mapped(group="run 7/imu", channel={"unit": None})
    seen = run(tmp_path, path, asked, guard)
    np.testing.assert_allclose(values(seen), AZ, rtol=1e-14)
    assert seen.measurements.about["import"]["format"] == "hdf5"
    for group in ("imu", "table", "run 7/table"):
        asked = mapped(group=group, channel={"unit": "g" if group == "imu" else "m/s2"})
        np.testing.assert_allclose(values(run(tmp_path, path, asked, guard)), AZ, rtol=1e-14)
    asked = mapped({"kind": "seconds", "column": 1}, group="matrix", channel={"column": 2})
    np.testing.assert_array_equal(values(run(tmp_path, path, asked, guard)), AZ)
    assert "has no numbered groups; name one" in refusal(tmp_path, path, mapped(group=0), guard)
    assert "no time axis of its own; name the column" in refusal(
        tmp_path, path, mapped({"kind": "own"}, group="imu"), guard
    )


def test_what_lies_in_other_files_is_left_alone(tmp_path: Path, guard: Guard):
    secret = tmp_path / "secret.h5"
    with h5py.File(secret, "w") as file:
        file["az"] = AZ
    (tmp_path / "raw.bin").write_bytes(AZ.tobytes())
    path = tmp_path / "x.h5"
    with h5py.File(path, "w") as file:
        file["t"] = TIME
        file["az"] = h5py.ExternalLink(str(secret), "/az")
        file["loop"] = h5py.SoftLink("/")
        layout = h5py.VirtualLayout((200,), "f8")
        layout[:] = h5py.VirtualSource(str(secret), "az", (200,))
        file.create_virtual_dataset("virtual", layout)
        file.create_dataset("outside", (200,), "f8", external=[(str(tmp_path / "raw.bin"), 0, 1600)])
        file["again"] = file["/"]
    assert "no column 'az'" in refusal(tmp_path, path, mapped(), guard)
    for name in ("virtual", "outside"):
        line = refusal(tmp_path, path, mapped(channel={"column": name}), guard)
        assert f"'{name}' lies in another file" in line


def test_nesting_without_end_is_refused():
    branch = tree.Branch({})
    for _ in range(30):
        branch = tree.Branch({"a": branch})
    with pytest.raises(InputError, match="levels deep"):
        tree.columns_of(branch, "a file", ".")


def test_scaled_up_to_up(tmp_path: Path, guard: Guard):
    """Whole numbers and flags come as they are."""
    path = five(tmp_path / "x.mat", {"t": TIME, "az": np.arange(200, dtype=np.int16), "on": AZ > 0})
    np.testing.assert_array_equal(values(run(tmp_path, path, mapped(), guard), UP), np.arange(200))
    asked = mapped(channel={"column": "on"})
    np.testing.assert_array_equal(values(run(tmp_path, path, asked, guard), UP), (AZ > 0).astype(float))
