"""Arrays come back from the disk bit by bit, each where a processor likes it."""

from pathlib import Path

import numpy as np
import pytest

from experiments.discrepancy.fit.stored import read_arrays, stored_arrays, write_arrays

RNG = np.random.default_rng(4)
ARRAYS = {
    "one": RNG.standard_normal((3, 5)),
    "none of them": np.zeros(0),
    "number": np.array(3.5),
    "turned": (RNG.standard_normal((4, 3)) + 1j).astype(np.complex64).T,
    "masks": np.array([True, False, True]),
}


def test_all_come_back(tmp_path: Path):
    write_arrays(tmp_path / "a", ARRAYS)
    found = read_arrays(tmp_path / "a")
    assert list(found) == list(ARRAYS)
    for name, one in ARRAYS.items():
        assert found[name].dtype == one.dtype and found[name].shape == one.shape
        assert np.array_equal(found[name], one) and found[name].flags.aligned
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_what_comes_in_the_place_of_a_file_does_not_change_what_was_opened(tmp_path: Path):
    write_arrays(tmp_path / "a", ARRAYS)
    before = stored_arrays(tmp_path / "a")
    write_arrays(tmp_path / "a", {"one": np.zeros(3)})
    assert np.array_equal(np.asarray(before["one"]), ARRAYS["one"])
    assert np.array_equal(read_arrays(tmp_path / "a")["one"], np.zeros(3))


@pytest.mark.parametrize("kept", [0, 5, 100, 500, -1])
def test_what_is_torn_is_nothing(tmp_path: Path, kept: int):
    write_arrays(tmp_path / "a", ARRAYS)
    whole = (tmp_path / "a").read_bytes()
    (tmp_path / "a").write_bytes(whole[:kept])
    assert read_arrays(tmp_path / "a") == {}
    assert read_arrays(tmp_path / "b") == {}


def test_a_changed_bit_is_seen(tmp_path: Path):
    write_arrays(tmp_path / "a", ARRAYS)
    whole = bytearray((tmp_path / "a").read_bytes())
    for place in RNG.integers(len(whole), size=40):
        spoilt = whole.copy()
        spoilt[place] ^= 1 << int(RNG.integers(8))
        (tmp_path / "a").write_bytes(spoilt)
        assert read_arrays(tmp_path / "a") == {}
