"""Kalker's coefficients at the points of his table, between them, and beyond."""

import csv
from pathlib import Path

import pytest

from railsim.contact.kalker import kalker_coefficients

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "kalker_coefficients.csv"


@pytest.mark.parametrize(
    ("ratio", "expected"),
    [
        (1.0, (4.12, 3.67, 1.47)),
        (0.5, (3.62, 3.01, 0.929)),
        (0.1, (3.31, 2.52, 0.473)),
        (2.0, (5.10, 4.90, 2.62)),
        (10.0, (11.7, 12.8, 14.6)),
    ],
)
def test_table_points(ratio: float, expected: tuple[float, float, float]) -> None:
    assert kalker_coefficients(ratio, 0.25) == pytest.approx(expected, rel=1e-9)


def test_between_table_points_and_beyond_them() -> None:
    low, middle, high = (kalker_coefficients(ratio, 0.28) for ratio in (0.5, 0.55, 0.6))
    assert all(a < b < c for a, b, c in zip(low, middle, high, strict=True))
    assert kalker_coefficients(30.0) == kalker_coefficients(10.0)
    for name in range(3):
        by_poisson = [kalker_coefficients(0.7, poisson)[name] for poisson in (0.25, 0.28, 0.5)]
        assert by_poisson[0] < by_poisson[1] < by_poisson[2]


@pytest.mark.skipif(not REFERENCE.exists(), reason="../shared/reference is not there")
def test_whole_table() -> None:
    rows = list(csv.DictReader(REFERENCE.read_text().splitlines()))
    assert len(rows) >= 57
    for row in rows:
        value = float(row["value [-]"])
        ratio = value if row["ratio"] == "a/b" else 1.0 / value
        expected = [float(row[name]) for name in ("C11 [-]", "C22 [-]", "C23 [-]")]
        assert kalker_coefficients(ratio, float(row["nu [-]"])) == pytest.approx(expected, rel=1e-9), row
