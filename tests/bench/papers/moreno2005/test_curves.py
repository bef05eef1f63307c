"""Fig. 1 and 2, and J over frames, from numbers that are known."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.papers.moreno2005.figures import (
    FILTERS,
    METHODS,
    PLOTS,
    density_figure,
    error_plot,
    similarity_plots,
)
from reports.palette import colour


def test_fig_1_has_three_densities_before_and_after():
    figure = density_figure()
    assert len(figure.axes) == 6
    assert figure.axes[0].get_ylabel().startswith("t - 1")
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[:3] == ["true, t - 1", "estimated, t - 1", "observed, t - 1"]


def test_fig_2_has_a_panel_a_set_and_a_line_a_filter():
    errors = pd.DataFrame(
        {
            "set": name,
            "samples": number,
            "filter": kind,
            "repetition": repetition,
            "error": 0.1 * place + 1 / number + 0.01 * repetition,
        }
        for name in "AG"
        for number in (10, 500)
        for place, kind in enumerate(FILTERS)
        for repetition in (0, 1)
    )
    left, right = error_plot({"one-dimensional-errors": errors}).axes
    assert left.get_title() == "A: λ = 1, σ_obs = 0.1"
    assert right.get_title() == "G: λ = 0.2, σ_obs = 0.2"
    assert left.get_xscale() == "linear"
    for place, container in enumerate(left.containers):
        assert container[0].get_xdata().tolist() == [10, 500]
        expected = np.array([0.1, 0.002]) + 0.1 * place + 0.005
        np.testing.assert_allclose(np.asarray(container[0].get_ydata(), float), expected)


class Stored:
    """Runs on two scenes of every sequence of a plot; J is .1 by scene and repetition."""

    def __init__(self, experiments, absent=()):
        self.experiments, self.absent = experiments, absent

    def sequences(self, experiment):
        known = [s for e, s in self.experiments if e == experiment]
        return [f"{name}:scene={scene}" for name in known for scene in (0, 1)]

    def of(self, experiment, sequence, tracker):
        if tracker in self.absent:
            return []
        scene = int(sequence[-1])
        values = [np.array([np.nan, 0.4, 0.4 + 0.2 * scene + 0.1 * r]) for r in (0, 1)]
        return [
            SimpleNamespace(segmentation=SimpleNamespace(region_similarity=one)) for one in values
        ]


def test_j_over_frames_is_the_median_over_scenes_of_means_over_repetitions():
    columns = PLOTS["similarity-figures"]
    stored = Stored(columns.values(), absent=["moreno2005:association=uniform"])
    found = similarity_plots(stored)
    assert found["similarity-ellipse"] is None
    axes = found["similarity-figures"].axes
    assert [one.get_title() for one in axes] == list(columns)
    present = [label for label in METHODS if label != "uniform association"]
    lines = {line.get_label(): line for line in axes[0].lines}
    assert list(lines) == present
    for position, label in enumerate(METHODS):
        if label in lines:
            values = lines[label].get_ydata()
            assert np.isnan(values[0])
            assert values[1:] == pytest.approx([0.4, 0.55])
            assert lines[label].get_color() == colour(position)


def test_only_the_sequences_of_a_column_are_in_it():
    where = dict(PLOTS["similarity-ellipse"])
    experiment, sequence = where["one jump"]
    figure = similarity_plots(Stored([(experiment, sequence)]))["similarity-ellipse"]
    assert [one.get_title() for one in figure.axes] == ["one jump"]
