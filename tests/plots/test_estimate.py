"""Pictures of estimates: what is in them, and what is said of the rest."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimators.interface import Estimate
from experiments.cli import main
from railsim.plots import estimate as estimate_picture_module
from railsim.plots.estimate import PICTURE, estimate_picture, panels_of
from railsim.plots.style import MOST_PANELS

S = np.linspace(0.0, 1000.0, 400)


def estimate(columns: dict[str, np.ndarray], **about: object) -> Estimate:
    return Estimate("thing", pd.DataFrame({"s [m]": S, "time [s]": S / 20.0, **columns}), dict(about))


def test_quantities_with_a_deviation_have_a_panel_each_and_others_share_one() -> None:
    names = ["s [m]", "time [s]", "a [m]", "a_std [m]", "b [-]", "c [-]", "valid [-]"]
    assert [panel.columns for panel in panels_of(names)] == [("a [m]",), ("b [-]", "c [-]")]


def test_band_is_two_deviations_in_the_units_of_the_picture() -> None:
    wave = 2e-3 * np.sin(S / 10.0)
    figure = estimate_picture(estimate({"vertical_d1 [m]": wave, "vertical_d1_std [m]": np.full(400, 1e-4)}))
    axes = figure.axes[0]
    assert axes.get_ylabel() == "vertical d1\n[mm]"
    drawn = np.asarray(axes.lines[0].get_ydata(), dtype=float)
    assert drawn == pytest.approx(1e3 * wave)
    band = axes.collections[0].get_paths()[0].vertices
    assert np.asarray(band)[:, 1].max() == pytest.approx(1e3 * wave.max() + 0.2, rel=1e-6)


def test_what_does_not_fit_is_named_and_warnings_are_shown() -> None:
    many = {f"q{i} [m]": S for i in range(MOST_PANELS + 2)}
    many |= {f"q{i}_std [m]": S for i in range(MOST_PANELS + 2)}
    title = estimate_picture(estimate(many, warnings=["the wheels slide"])).get_suptitle()
    assert f"not drawn: q{MOST_PANELS} [m], q{MOST_PANELS + 1} [m]" in title
    assert "warning: the wheels slide" in title


def test_events_are_marked_where_they_are() -> None:
    figure = estimate_picture(estimate({"snr [-]": np.ones(400)}, events=[{"s [m]": 250.0}, {"s [m]": 500.0}]))
    marked = [line.get_xdata()[0] for line in figure.axes[0].lines if len(line.get_xdata()) == 2]  # pyright: ignore
    assert marked == [250.0, 500.0]


def test_an_empty_estimate_and_one_of_lost_values_can_be_drawn(tmp_path: Path) -> None:
    nothing = Estimate("thing", pd.DataFrame({"time [s]": [], "a [-]": []}))
    estimate_picture(nothing).savefig(tmp_path / "a.png")
    lost = {"a [m]": np.full(400, np.nan), "a_std [m]": np.full(400, np.nan), "valid [-]": np.zeros(400)}
    estimate_picture(estimate(lost)).savefig(tmp_path / "b.png")


def test_estimate_draws_what_was_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "jointed", "--set", "duration=8", "--out", str(tmp_path / "r")]) == 0
    assert main(["estimate", "dipped_joints", str(tmp_path / "r"), "--out", str(tmp_path / "e")]) == 0
    assert PICTURE in capsys.readouterr().out
    assert (tmp_path / "e" / PICTURE).read_bytes().startswith(b"\x89PNG")


def test_many_rows_are_drawn_by_their_outline(monkeypatch: pytest.MonkeyPatch) -> None:
    wave, valid = 2e-3 * np.sin(S / 10.0), np.ones(400)
    wave[333], valid[150] = 9e-3, 0.0
    long = estimate({"a [m]": wave, "a_std [m]": np.full(400, 1e-4), "valid [-]": valid}, events=[{"s [m]": 7.0}] * 30)
    whole = estimate_picture(long).axes[0]
    monkeypatch.setattr(estimate_picture_module, "MANY_ROWS", 40)
    monkeypatch.setattr(estimate_picture_module, "MANY_EVENTS", 20)
    thinned = estimate_picture(long).axes[0]
    outlines = [np.asarray(axes.collections[0].get_paths()[0].vertices) for axes in (whole, thinned)]
    assert len(outlines[1]) < 0.3 * len(outlines[0])
    assert outlines[1][:, 1].max() == outlines[0][:, 1].max() == pytest.approx(9.2)
    assert len(thinned.collections[1].get_paths()) == 1  # the row that is not valid is still there
    assert len(whole.lines) == 31 and len(thinned.lines) == 1 and len(thinned.collections) == 3


def test_a_value_that_stands_alone_bears_its_deviation() -> None:
    one = pd.DataFrame({"s [m]": [10.0], "depth [m]": [1e-3], "depth_std [m]": [2e-4]})
    axes = estimate_picture(Estimate("thing", one, {})).axes[0]
    paths = [np.array(path.vertices, dtype=float) for each in axes.collections for path in each.get_paths()]
    assert [path[:, 1] for path in paths if path.shape[0] == 2] == [pytest.approx([0.6, 1.4])]
    assert axes.get_ylim()[0] < 0.6 < 1.4 < axes.get_ylim()[1]


def test_what_is_withheld_throughout_has_no_panel() -> None:
    columns = {"a [m]": S, "a_std [m]": S, "b [m]": np.full(400, np.nan), "b_std [m]": np.full(400, np.nan)}
    assert [axes.get_ylabel() for axes in estimate_picture(estimate(columns)).axes] == ["a\n[mm]"]
