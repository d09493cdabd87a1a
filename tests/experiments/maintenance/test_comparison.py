"""Changes since earlier passes: found where they are, and none called where the errors allow for it."""

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.maintenance.comparison import changed_places, changed_sections, changes_at, laid, with_changes
from experiments.maintenance.condition import defects
from experiments.maintenance.line_speed import line_speed
from experiments.maintenance.sections import section_rows
from railsim.errors import InputError
from tests.experiments.maintenance.made_passes import ride


def test_passes_are_laid_on_each_other_in_spite_of_their_odometers():
    latest = ride(seed=1, scale=0.006)
    one = laid(ride(seed=2, scale=-0.005), latest)
    difference = latest.series["vertical_d1 [m]"] - one.values["vertical_d1 [m]"]
    middle = difference.to_numpy()[400:-800]
    assert np.std(middle) < 2.5e-4 and one.slip < 0.15


def test_a_dip_that_grew_is_found_and_nothing_else():
    latest = ride(seed=1, scale=0.004, dip=3e-3)
    found = changed_places(latest, [laid(ride(seed=seed, scale=0.002 * seed), latest) for seed in (2, 3)])
    assert len(found) == 1
    row = found.iloc[0]
    assert row["s [m]"] == pytest.approx(550.0 / 1.004, abs=0.5)
    assert row["change [mm]"] < -1.5 and row["change over error [-]"] < -3.0 and row["changed"] == "grown"


@pytest.mark.parametrize("seed", range(6))
def test_no_change_is_called_where_there_is_none(seed: int):
    latest = ride(seed=10 + seed, scale=0.005)
    earlier = [laid(ride(seed=30 + seed, scale=-0.004), latest)]
    assert changed_places(latest, earlier).empty
    for length in (100.0, 200.0):
        assert set(changed_sections(latest, earlier, length)["changed"]) <= {"no", ""}


def test_a_change_inside_the_errors_is_not_called_one():
    for error, called in ((1e-4, True), (1.5e-3, False)):
        latest = ride(seed=1, dip=3e-3, rough=1.5, error=1e-4)
        latest.series["vertical_d1_std [m]"] = error
        earlier = [laid(ride(seed=2), latest)]
        assert (len(changed_places(latest, earlier)) > 0) == called
        sections = changed_sections(latest, earlier, 200.0)
        grown = sections.loc[sections["changed"] == "grown", "from [m]"].tolist()
        assert (800.0 in grown) == called and 200.0 not in grown


def test_the_size_of_a_section_s_change():
    latest = ride(seed=1, rough=1.5)
    rows = with_changes(section_rows(latest, 200.0), changed_sections(latest, [laid(ride(seed=2), latest)], 200.0))
    assert len(rows) == 6
    grown = rows[rows["from [m]"] == 800.0].iloc[0]
    assert grown["before [mm or mm/m]"] == pytest.approx(1.0, abs=0.15)
    assert grown["change [mm or mm/m]"] == pytest.approx(0.5 * grown["before [mm or mm/m]"], rel=0.1)
    assert grown["change error [mm or mm/m]"] == pytest.approx(0.1 * np.sqrt(2.0), rel=0.1)


def test_defects_say_what_was_there_before():
    latest = ride(seed=1, dip=14e-3)
    found = defects(latest, speed=line_speed("120"))
    said = changes_at(latest, [laid(ride(seed=2, dip=12e-3), latest)], found)
    assert said["changed"].tolist() == ["grown"] and said["change [mm or mm/m]"].iloc[0] == pytest.approx(-2.0, abs=0.6)
    same = changes_at(latest, [laid(ride(seed=2, dip=14e-3), latest)], found)
    assert same["changed"].tolist() == ["no"]


def test_without_stated_errors_nothing_is_said():
    latest = Estimate("mine", ride(seed=1, dip=4e-3).series.drop(columns="vertical_d1_std [m]"))
    earlier = [laid(ride(seed=2), latest)]
    assert changed_places(latest, earlier).empty
    assert set(changed_sections(latest, earlier, 200.0)["changed"]) == {""}


def test_what_cannot_be_compared_is_told():
    latest = ride(seed=1)
    other = latest.series.copy()
    other["vertical_d1 [m]"] = np.random.default_rng(1).permutation(other["vertical_d1 [m]"].to_numpy())
    with pytest.raises(InputError, match="no stretch of the earlier pass"):
        laid(Estimate("mine", other), latest)
    with pytest.raises(InputError, match="no band D1 in common"):
        laid(Estimate("mine", latest.series.rename(columns={"vertical_d1 [m]": "x_d1 [m]"})), latest)
    with pytest.raises(InputError, match="rows at other distances"):
        laid(Estimate("mine", pd.DataFrame(latest.series.iloc[::2])), latest)
