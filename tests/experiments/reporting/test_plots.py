"""Pictures: thinned lines keep their extremes; every panel says what it shows."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from experiments.reporting.plots import PLOTS, Results, thin
from experiments.runs.estimation import estimate_all
from experiments.scoring.speed import all_speed_errors
from railsim import Recording


def test_thinned_line_keeps_order_peaks_and_gaps():
    x = np.linspace(0.0, 1.0, 100_003)
    y = np.sin(40.0 * x)
    y[77_777], y[20_000] = 9.0, -9.0
    y[30_000:40_000] = np.nan
    thin_x, thin_y = thin(x, y, 1000)
    assert thin_x.size <= 1000
    assert np.all(np.diff(thin_x) >= 0)
    assert (np.nanmax(thin_y), np.nanmin(thin_y)) == (9.0, -9.0)
    inside = (thin_x > 0.302) & (thin_x < 0.398)
    assert inside.any()
    assert np.isnan(thin_y[inside]).all()


def test_short_line_is_left_alone():
    x = np.arange(10.0)
    assert thin(x, -x, 1000) == (pytest.approx(x), pytest.approx(-x))


@pytest.fixture(scope="module")
def results(recording) -> Results:
    """Everything that `railsim run` draws."""
    opened = Recording.open(recording)
    assert opened.truth is not None
    errors = all_speed_errors(estimate_all(opened.measurements).given, opened.truth)
    return Results("name", "what it is about", opened.truth, opened.measurements, errors)


@pytest.mark.parametrize("name", list(PLOTS))
def test_axes_have_labels_with_units_and_legends_cover_no_data(name: str, results: Results):
    figure = PLOTS[name](results)
    assert isinstance(figure, Figure)
    figure.draw_without_rendering()
    assert figure.get_suptitle() == "name: what it is about"
    panels = figure.axes
    assert any("distance [m]" in panel.get_xlabel() or "time [s]" in panel.get_xlabel() for panel in panels)
    labelled = [panel for panel in panels if panel.get_ylabel()]
    assert all("[" in panel.get_ylabel() for panel in labelled)
    assert len(labelled) == len({panel.get_subplotspec().rowspan.start for panel in panels})  # pyright: ignore
    for panel in panels:
        legend = panel.get_legend()
        if legend is not None:
            assert legend.get_window_extent().y0 >= panel.get_window_extent().y1 - 1.0
