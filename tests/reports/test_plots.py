"""Plots: their lines are the data, and all parts are inside the image."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.reports.charts import Chart, Line
from trackmark.reports.figures import fold, save_figure
from trackmark.reports.palette import LIGHT, colour
from trackmark.reports.plots import chart_plot
from trackmark.reports.printable import printable

LONG = "multipart:preset=robust:particles=400:half_width=3.5:resampling=systematic"
DOT = {"x": [0.5], "y": [0.5]}


def chart(labels, x=(0.0, 1.0), y=(1.0, 0.5), **options):
    lines = [Line(label, number, x, y) for number, label in enumerate(labels)]
    return Chart("C", "x", "y", lines, "words", top=1.0, **options)


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_chart_has_lines_with_bands_and_figures():
    lines = [
        Line("a", 0, [0, 1], [1, 0.5], [1, 0.2], [1, 0.8], value="0.750"),
        Line("b", 2, [0, 1], [1, 1]),
    ]
    chart = Chart("C", "overlap", "share", lines, "", "step", top=1.0, value_name="area")
    figure = chart_plot(chart, "T", ["a", "x", "b"])
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_ylim()) == (
        "overlap",
        "share",
        (0, 1.02),
    )
    assert legend(figure) == ["a (0.750)", "x (incomplete)", "b"]
    assert [line.get_color() for line in axes.lines] == [colour(0), colour(1), colour(2)]
    assert axes.lines[0].get_ydata().tolist() == [1, 0.5]
    assert np.isnan(axes.lines[1].get_ydata()).all()
    (band,) = axes.collections
    assert band.get_paths()[0].vertices[:, 1].min() == 0.2


def test_chart_of_dots_has_intervals():
    lines = [Line("a", 0, [2.0], [0.5], [0.4], [0.6]), Line("b", 1, [3.0], [0.5], [np.nan])]
    figure = chart_plot(Chart("", "ms", "y", lines, "", "dots", logarithmic=True), "T")
    (axes,) = figure.axes
    assert axes.get_xscale() == "log"
    (bar,) = axes.collections
    np.testing.assert_array_equal(bar.get_segments()[0], [[2, 0.4], [2, 0.6]])


@pytest.mark.parametrize("name", ["a$\\frac{$", "$a$ and $b$", "_mine.py:Mine", "\x1b[2J"])
def test_legend_shows_names_with_dollar_signs(name, tmp_path):
    figure = chart_plot(chart([name]), name)
    save_figure(tmp_path / "plot.png", figure)
    assert (tmp_path / "plot.png").stat().st_size
    (label,) = legend(figure)
    assert label.replace("\\$", "$").strip().startswith(printable(name))


@pytest.mark.parametrize("labels", [["a", LONG], [f"{LONG}:seed={i}" for i in range(12)]])
def test_long_labels_lie_inside_and_leave_room(labels):
    title = "a headline of some length over a sequence: " + LONG
    figure = chart_plot(chart(labels), title)
    figure.draw_without_rendering()
    width, height = figure.bbox.size
    for axes in figure.axes:
        assert axes.bbox.width > (0.5 if len(figure.axes) <= 2 else 0.25) * width
        assert axes.bbox.height > 100
        assert not any(artist.get_window_extent().overlaps(axes.bbox) for artist in figure.legends)
    for artist in (*figure.axes, *figure.legends, *figure.texts):
        drawn = artist.get_tightbbox()
        assert min(drawn.x0, drawn.y0) >= -1
        assert drawn.x1 <= width + 1
        assert drawn.y1 <= height + 1


def test_legend_uses_columns_that_fit():
    def lines(label):
        figure = chart_plot(chart([f"{label}{i}" for i in range(4)]), "T")
        figure.draw_without_rendering()
        texts = figure.legends[0].get_texts()
        return len({round(text.get_window_extent().y0) for text in texts})

    assert [lines("a"), lines("a" * 32), lines(LONG)] == [1, 2, 4]


def test_lines_after_the_sixth_are_grey():
    labels = [f"t{number}" for number in range(9)]
    figure = chart_plot(chart(labels), "title", labels)
    (axes,) = figure.axes
    shades = [line.get_color() for line in axes.get_lines()]
    assert shades == [*LIGHT, LIGHT[-1], LIGHT[-1]]
    assert legend(figure) == labels
    assert len({line.get_marker() for line in axes.get_lines()[6:]}) == 3


def test_single_point_is_seen():
    figure = chart_plot(Chart("", "x", "y", [Line("a", 0, **DOT)], ""), "T", ["a"])
    (axes,) = figure.axes
    axes.set_axis_off()
    (line,) = axes.get_lines()
    line.set_visible(False)
    figure.draw_without_rendering()
    figure.canvas.draw()
    without = np.asarray(figure.canvas.buffer_rgba()).copy()
    line.set_visible(True)
    figure.canvas.draw()
    assert (np.asarray(figure.canvas.buffer_rgba()) != without).any()


@given(st.text("ab:/ ", max_size=60), st.integers(1, 30))
def test_folding_loses_only_spaces_at_line_ends(text, width):
    folded = fold(text, width)
    assert folded.replace("\n", "").replace(" ", "") == text.replace(" ", "")
    for line in folded.split("\n"):
        assert len(line) <= width or not any(sign in line.rstrip(":/ ") for sign in ":/ ")


@pytest.mark.parametrize(
    ("suffix", "start"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")]
)
def test_equal_figures_have_equal_bytes(tmp_path, suffix, start):
    files = [tmp_path / f"{name}{suffix}" for name in "ab"]
    for file in files:
        save_figure(file, chart_plot(chart(["a"]), "T"))
    first, second = (file.read_bytes() for file in files)
    assert first.startswith(start)
    assert first == second
