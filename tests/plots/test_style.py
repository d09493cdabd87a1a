"""One look: figures made in `styled` and the panels of `frame` have the same grid, and lines the same colours."""

from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from railsim.plots.style import COLOURS, frame, styled


def test_panels_of_both_ways_have_one_grid():
    with styled():
        inside = Figure().subplots()
        assert inside.xaxis.get_gridlines()[0].get_visible()
    outside = frame((1.0,), "title")[1][0, 0]
    for panel in (inside, outside):
        line = panel.xaxis.get_gridlines()[0]
        assert (to_hex(str(line.get_color())), line.get_linewidth()) == ("#dddddd", 0.6)
        assert panel.get_axisbelow() is True
        assert [panel.spines[side].get_visible() for side in ("top", "right", "left")] == [False, False, True]


def test_lines_take_the_colours_in_their_order():
    with styled():
        axes = Figure().subplots()
        lines = [axes.plot([0.0, 1.0], [0.0, 1.0])[0] for _ in COLOURS]
    assert [line.get_color() for line in lines] == list(COLOURS)
    assert len(set(COLOURS)) == len(COLOURS)
