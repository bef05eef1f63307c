"""Curves over a setting, and of hits against false alarms: that they are what the table says."""

import numpy as np
import pandas as pd
import pytest

from trackmark.reports.curves import curve_plot
from trackmark.reports.palette import colour


def points(panel, label, values):
    values = np.array(values)
    limits = {"value": values, "low": values - 0.1, "high": values + 0.2}
    return pd.DataFrame({"panel": panel, "label": label, "setting": [400.0, 15, 60], **limits})


def test_every_panel_has_its_lines_in_order_of_the_setting():
    table = pd.concat([points("x", "b", [0.9, 0.2, 0.5]), points("y", "a", [0.3, 0.1, 0.2])])
    left, right = curve_plot(table, "T", "particles", "share", ["a", "b"]).axes
    assert [axes.get_title() for axes in (left, right)] == ["x", "y"]
    assert left.get_ylabel() == "share"
    none, line = (container[0] for container in left.containers)
    assert len(none.get_xdata()) == 0
    assert line.get_xydata().tolist() == [[15, 0.2], [60, 0.5], [400, 0.9]]
    assert line.get_color() == colour(1)
    (bars,) = left.containers[1][2]
    assert bars.get_segments()[0][:, 1] == pytest.approx([0.1, 0.4])
    assert right.containers[0][0].get_ydata().tolist() == [0.1, 0.2, 0.3]
    assert left.get_ylim()[0] == right.get_ylim()[0] == 0
    assert left.get_xscale() == "log"


@pytest.mark.parametrize(
    ("options", "ticks", "scales"),
    [
        ({"marks": [60.0], "logarithmic": True}, ["15", "60", "400"], ("log", "log")),
        ({"ticks": [0, 200, 400]}, ["0", "200", "400"], ("linear", "linear")),
    ],
)
def test_marks_stand_at_their_settings_and_ticks_make_the_abscissa_linear(options, ticks, scales):
    (axes,) = curve_plot(points("x", "a", [3.0, 1, 2]), "T", "n", "ms", ["a"], **options).axes
    assert [text.get_text() for text in axes.get_xticklabels()] == ticks
    assert (axes.get_xscale(), axes.get_yscale()) == scales
    for value in options.get("marks", []):
        assert axes.lines[-1].get_xdata() == [value, value]
