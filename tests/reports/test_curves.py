"""Curves over a setting: that points, intervals and marks are where the table says."""

import numpy as np
import pandas as pd
import pytest

from reports.curves import curve_plot
from reports.palette import colour


def points(panel, label, values):
    return pd.DataFrame(
        {
            "panel": panel,
            "label": label,
            "setting": [400.0, 15.0, 60.0],
            "value": values,
            "low": np.array(values) - 0.1,
            "high": np.array(values) + 0.2,
        }
    )


def test_every_panel_has_its_lines_in_order_of_the_setting():
    table = pd.concat([points("x", "b", [0.9, 0.2, 0.5]), points("y", "a", [0.3, 0.1, 0.2])])
    left, right = curve_plot(table, "T", "particles", "share", ["a", "b"]).axes
    assert [axes.get_title() for axes in (left, right)] == ["x", "y"]
    assert left.get_ylabel() == "share"
    none, line = (container[0] for container in left.containers)
    assert len(none.get_xdata()) == 0
    assert line.get_xdata().tolist() == [15, 60, 400]
    assert line.get_ydata().tolist() == [0.2, 0.5, 0.9]
    assert line.get_color() == colour(1)
    (bars,) = left.containers[1][2]
    assert bars.get_segments()[0][:, 1] == pytest.approx([0.1, 0.4])
    assert right.containers[0][0].get_ydata().tolist() == [0.1, 0.2, 0.3]
    assert left.get_ylim()[0] == right.get_ylim()[0] == 0
    assert left.get_xscale() == "log"


def test_marks_stand_at_their_settings():
    table = points("x", "a", [3.0, 1.0, 2.0])
    options = {"marks": [60.0], "logarithmic": True}
    (axes,) = curve_plot(table, "T", "particles", "ms", ["a"], **options).axes
    assert [text.get_text() for text in axes.get_xticklabels()] == ["15", "60", "400"]
    assert axes.lines[-1].get_xdata() == [60.0, 60.0]
    assert axes.get_yscale() == "log"


def test_ticks_make_the_abscissa_linear():
    (axes,) = curve_plot(
        points("x", "a", [3.0, 1.0, 2.0]), "T", "samples", "error", ["a"], ticks=[0, 200, 400]
    ).axes
    assert axes.get_xscale() == "linear"
    assert [text.get_text() for text in axes.get_xticklabels()] == ["0", "200", "400"]
