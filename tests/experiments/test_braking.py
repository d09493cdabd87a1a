"""Item 9: braking section of the validation report."""

import numpy as np

from experiments.reporting.size import Size
from experiments.validation.braking import CONDITIONS, Braking


def test_tachometer_fails_where_the_wheels_slide_and_the_bogie_knows_the_speed() -> None:
    section = Braking()
    table = section.compute(Size.FAST)
    assert set(table["adhesion"]) == set(CONDITIONS)
    rows = section.rows(table)
    assert {row.what for row in rows if row.held is False} == {
        "very low: tachometer error and slip, largest sum",  # waits for a pulse as the wheel stops
    }
    sliding = ((table["adhesion"] == "very low") & (table["slip [-]"] > 0.5)).to_numpy(bool)
    tachometer, speed = table["tachometer [m/s]"].to_numpy(float), table["speed [m/s]"].to_numpy(float)
    assert np.all(tachometer[sliding] < 0.6 * speed[sliding])
    assert sliding.sum() > 500
