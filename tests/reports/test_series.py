"""Plots over frames: that lines are medians, bands quartiles, and shades where they belong."""

import numpy as np
import pandas as pd
import pytest

from trackmark.reports.palette import colour
from trackmark.reports.series import appearance_plot, series_grid, series_plot


def series(values, label="a", repetition=0, first=3):
    frames = np.arange(first, first + len(values))
    return pd.DataFrame(
        {"label": label, "repetition": repetition, "frame": frames, "value": values}
    )


def five(label="a", **more):
    """Repetitions whose median is 2, 4 and whose quartiles are 1 and 3, 3 and 5."""
    runs = [series([i, i + 2.0], label, i) for i in range(5)]
    return pd.concat(runs).assign(**more)


def extent(collection):
    (path,) = collection.get_paths()
    by_frame = pd.DataFrame(path.vertices).groupby(0)[1]
    return by_frame.min().tolist(), by_frame.max().tolist()


def words(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def spans(axes):
    return [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]


def appearances(counts, modes, first=0):
    frames = np.arange(first, first + len(modes[0]))
    runs = [
        {"repetition": i, "frame": frames, "positive_appearances": counts, "mode": mode}
        for i, mode in enumerate(modes)
    ]
    return pd.concat(map(pd.DataFrame, runs), ignore_index=True)


def test_a_line_is_the_median_and_its_band_the_quartiles():
    (axes,) = series_plot(five(), "T", "Hx [px]", ["a"]).axes
    (line,) = axes.lines
    assert line.get_xdata().tolist() == [3, 4]
    assert line.get_ydata().tolist() == [2.0, 4.0]
    assert extent(axes.collections[0]) == ([1.0, 3.0], [3.0, 5.0])
    assert axes.get_ylabel() == "Hx [px]"
    (axes,) = series_plot(series([1.0, 2.0]), "T", "Hx [px]", ["a"]).axes
    assert not axes.collections


def test_the_legend_says_what_quartiles_are_over():
    for plot in (
        series_plot(five(), "T", "Hx [px]", ["a"], over="scenes"),
        series_grid(five(reading="z", scene="s"), "T", "Hx [px]", ["a"], {}, over="scenes"),
    ):
        assert plot.legends[0].get_title().get_text() == "median and quartiles over scenes"


def test_the_legend_names_every_line_once_whichever_panel_has_it():
    shown = [five("a", reading="x"), five("a", reading="y"), five("b", reading="y")]
    figure = series_grid(pd.concat(shown).assign(scene="s"), "T", "Hx [px]", ["a", "b"], {})
    assert words(figure) == ["a", "b"]


def test_a_label_keeps_its_colour_and_the_truth_begins_at_frame_0():
    figure = series_plot(five("b"), "T", "Hx [px]", ["a", "b"], np.array([7.0, 8.0, 9.0, 9.5]))
    truth, line = figure.axes[0].lines
    assert truth.get_xdata().tolist() == [0, 1, 2, 3]
    assert line.get_color() == colour(1)
    assert words(figure) == ["truth", "b"]


def test_frames_without_a_value_are_gaps():
    table = series([1.0, np.nan, 3.0, 4.0])
    (axes,) = series_plot(table[table["frame"] != 5], "T", "Hx [px]", ["a"]).axes
    assert np.flatnonzero(np.isnan(axes.lines[0].get_ydata())).tolist() == [1, 2]


def test_small_multiples_have_a_row_a_reading_and_a_column_a_scene():
    tables = [
        five(reading=reading, scene=scene).assign(
            value=lambda runs, plus=10 * row + column: runs["value"] + plus
        )
        for row, reading in enumerate(("z", "y"))
        for column, scene in enumerate(("scene 0", "scene 2", "scene 1"))
    ]
    truths = {"scene 2": np.zeros(9)}
    figure = series_grid(pd.concat(tables), "T", "Hx [px]", ["a"], truths)
    grid = np.reshape(figure.axes, (2, 3))
    assert [axes.get_title() for axes in grid[0]] == ["scene 0", "scene 2", "scene 1"]
    assert [axes.get_ylabel().split("\n")[0] for axes in grid[:, 0]] == ["z", "y"]
    begins = [[axes.lines[-1].get_ydata()[0] for axes in row] for row in grid]
    assert begins == [[2.0, 3.0, 4.0], [12.0, 13.0, 14.0]]
    assert [[len(axes.lines) for axes in row] for row in grid] == [[1, 2, 1]] * 2
    figure.draw_without_rendering()
    for axes in figure.axes:
        assert not figure.legends[0].get_window_extent().overlaps(axes.get_tightbbox())


def test_small_multiples_have_their_level_and_the_shades_of_their_scene():
    tables = [five(reading="z", scene=scene) for scene in ("s", "t")]
    shades = {"s": {"dark": np.isin(np.arange(9), [2, 3, 7])}}
    figure = series_grid(pd.concat(tables), "T", "u", ["a"], {}, shades=shades, level=("γ", 3.5))
    left, right = figure.axes
    assert spans(left) == [(1.5, 3.5), (6.5, 7.5)]
    assert not right.patches
    assert set(right.lines[-1].get_ydata()) == {3.5}
    assert words(figure) == ["a", "γ", "dark"]


def test_appearances_have_their_threshold_their_mode_and_shaded_occlusions():
    runs = appearances([90, 50, 5, 4, 60, 90], [[1.0, 1, 1, i % 2, 0, 1] for i in range(4)], 2)
    runs.loc[runs["frame"] == 2, "positive_appearances"] += runs["repetition"]
    hidden = np.isin(np.arange(8), [0, 4, 5, 7])
    shades = {"half": hidden, "all": np.arange(8) == 4, "never": np.zeros(8, bool)}
    figure = appearance_plot(runs, "T", 10.0, shades)
    upper, lower = figure.axes
    counts, threshold = upper.lines
    assert counts.get_ydata().tolist() == [91.5, 50, 5, 4, 60, 90]
    assert set(threshold.get_ydata()) == {10.0}
    assert threshold.get_linestyle() == "--"
    assert spans(upper) == [(-0.5, 0.5), (3.5, 5.5), (6.5, 7.5), (3.5, 4.5)]
    greys = [patch.get_facecolor()[0] for patch in upper.patches]
    assert greys[0] == greys[2] > greys[3]
    assert len(lower.patches) == 4
    assert words(figure) == ["positive appearances", "threshold b·N", "half", "all"]
    assert lower.get_yticklabels()[-1].get_text() == "4"


@pytest.mark.parametrize("n_modes", [0, 1, 3])
def test_the_mode_is_the_share_of_the_runs_that_initialise(n_modes):
    runs = appearances(9.0, [[1.0, float(i >= n_modes), 1.0] for i in range(3)])
    _, lower = appearance_plot(runs, "T", 10.0, {}).axes
    heights = lower.collections[0].get_paths()[0].vertices[:, 1]
    assert heights.max() == pytest.approx(n_modes / 3)
