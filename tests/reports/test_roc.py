"""Receiver operating characteristics."""

import pandas as pd

from reports.curves import roc_plot


def test_every_line_has_its_rates_and_a_mark_at_the_threshold_in_use():
    points = pd.DataFrame(
        {
            "label": ["a"] * 3 + ["b"] * 3,
            "false_rate": [0.0, 0.1, 1.0, 0.0, 0.4, 1.0],
            "hit_rate": [0.2, 0.9, 1.0, 0.1, 0.5, 1.0],
            "marked": [False, True, False] * 2,
        }
    )
    figure = roc_plot(points, "T", ["a", "b"], "in use")
    (axes,) = figure.axes
    a, mark, b, other_mark, _ = axes.lines
    assert a.get_ydata().tolist() == [0.2, 0.9, 1.0]
    assert b.get_xdata().tolist() == [0.0, 0.4, 1.0]
    assert [line.get_xdata().tolist() for line in (mark, other_mark)] == [[0.1], [0.4]]
    assert mark.get_color() == a.get_color() != b.get_color() == other_mark.get_color()
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["a", "b", "in use"]
