"""Densities: every panel shows what it is given, and marks are where they belong."""

import numpy as np
import pytest

from reports.densities import Densities, density_plot

GRIDS = np.linspace(0, 1, 11), np.linspace(-1, 1, 21)
MARKS = {"true": (0.25, -0.5), "seen": (0.75, 0.5)}


def densities(level):
    return Densities(np.full(11, level), np.full(21, 2 * level), np.full((21, 11), level), MARKS)


@pytest.fixture(scope="module")
def axes():
    times = {"before": densities(1.0), "after": densities(3.0)}
    return density_plot("T", times, GRIDS, ("colour", "position")).axes


def test_a_time_is_a_row_of_both_alone_and_together(axes):
    assert len(axes) == 6
    assert [one.get_xlabel() for one in axes[:3]] == ["colour", "position", "colour"]
    assert axes[2].get_ylabel() == "position"
    assert axes[0].get_ylabel().startswith("before")
    assert axes[3].get_ylabel().startswith("after")
    for row, level in ((0, 1.0), (3, 3.0)):
        assert set(axes[row].lines[0].get_ydata()) == {level}
        assert set(axes[row + 1].lines[0].get_ydata()) == {2 * level}
        assert axes[row + 2].images[0].get_extent() == [0, 1, -1, 1]
        assert axes[row + 2].images[0].origin == "lower"


def test_marks_stand_in_every_panel_with_a_marker_a_time(axes):
    for row, marker in ((0, "x"), (3, "o")):
        points = [
            [(line.get_xdata()[0], line.get_ydata()[0]) for line in panel.lines[-2:]]
            for panel in axes[row : row + 3]
        ]
        assert points == [
            [(0.25, 0), (0.75, 0)],
            [(-0.5, 0), (0.5, 0)],
            [(0.25, -0.5), (0.75, 0.5)],
        ]
        assert {line.get_marker() for line in axes[row + 2].lines} == {marker}


def test_the_legend_names_all_marks(axes):
    (legend,) = axes[0].figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["true", "seen"] * 2
