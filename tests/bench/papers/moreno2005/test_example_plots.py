"""Densities: every panel shows what it is given, and marks are where they belong."""

import numpy as np

from trackmark.bench.papers.moreno2005.example_plots import Densities, density_plot

GRIDS = np.linspace(0, 1, 11), np.linspace(-1, 1, 21)
MARKS = {"true": (0.25, -0.5), "seen": (0.75, 0.5)}


def densities(level):
    return Densities(np.full(11, level), np.full(21, 2 * level), np.full((21, 11), level), MARKS)


def test_a_time_is_a_row_of_both_alone_and_together_with_its_marks():
    times = {"before": densities(1.0), "after": densities(3.0)}
    figure = density_plot("T", times, GRIDS, ("colour", "position"))
    axes = np.reshape(figure.axes, (2, 3))
    assert [one.get_xlabel() for one in axes[0]] == ["colour", "position", "colour"]
    assert axes[0, 2].get_ylabel() == "position"
    for row, when, level, marker in zip(axes, times, (1, 3), "xo", strict=True):
        first, second, both = row
        assert first.get_ylabel().startswith(when)
        assert set(first.lines[0].get_ydata()) == {level}
        assert set(second.lines[0].get_ydata()) == {2 * level}
        assert both.images[0].get_extent() == [0, 1, -1, 1]
        assert both.images[0].origin == "lower"
        marks = [[line.get_xydata()[0].tolist() for line in one.lines[-2:]] for one in row]
        assert marks[:2] == [[[0.25, 0], [0.75, 0]], [[-0.5, 0], [0.5, 0]]]
        assert marks[2] == [list(pair) for pair in MARKS.values()]
        assert {line.get_marker() for line in both.lines} == {marker}
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["true", "seen"] * 2
