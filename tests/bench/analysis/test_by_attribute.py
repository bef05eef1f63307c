"""Scores by attributes: bins, correlations, tables and plots."""

from itertools import pairwise
from math import isnan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import spearmanr

from trackmark.bench.analysis.attribute_plot import plot_attributes
from trackmark.bench.analysis.by_attribute import (
    attribute_curves,
    attribute_table,
    bins_of,
)
from trackmark.bench.analysis.run_tables import SUMMARY
from trackmark.bench.statistics.correlation import rank_correlation
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.datasets import attributes
from trackmark.reports.renderers import terminal_lines, to_text

OVERLAP = SUMMARY[0]


@given(st.lists(st.integers(0, 12), max_size=60))
@settings(max_examples=100, deadline=None)
def test_bins_partition_sequences_and_keep_ties_together(places):
    values = np.array(places, float)
    bins = bins_of(values)
    if not bins:
        assert len(values) < 12 or len(set(places)) < 12
        return
    assert sorted(np.concatenate(bins).tolist()) == list(range(len(values)))
    assert 2 <= len(bins) <= 5
    assert min(map(len, bins)) >= MIN_UNITS
    for low, high in pairwise(bins):
        assert values[low].max() < values[high].min()


def test_bin_has_mean_and_interval():
    generator = np.random.default_rng(1)
    places, scores = generator.random(24), generator.random(24)
    (curve,) = attribute_curves({"a": scores}, {"blur": places})
    order = np.argsort(places)
    for entry, chosen in zip(curve.bins, order.reshape(4, 6), strict=True):
        assert entry.mean == pytest.approx(scores[chosen].mean())
        assert (entry.low, entry.high) == pytest.approx(mean_interval(scores[chosen]))
        assert (entry.first, entry.last) == (places[chosen].min(), places[chosen].max())
    assert curve.correlation == pytest.approx(spearmanr(places, scores).statistic)


def test_correlation_finds_only_dependent_attributes():
    generator = np.random.default_rng(2)
    measured = {f"a{k}": generator.random(30) for k in range(10)}
    differences = measured["a3"] ** 2 + generator.normal(0, 0.05, 30)
    curves = attribute_curves({"x - y": differences}, measured)
    (significant,) = (curve for curve in curves if curve.interval.low > 0)
    assert significant.attribute == "a3"
    assert all(curve.interval.high > 0 for curve in curves)
    assert (np.diff([entry.mean for entry in significant.bins]) > 0).all()
    corrected = rank_correlation(significant.attribute_values, significant.scores, 1 - 0.05 / 10)[1]
    assert significant.interval == pytest.approx(corrected)


def test_sequences_without_attribute_are_omitted():
    measured = {"visibility": [np.nan] * 5, "size": [1, 2, np.nan, 4, 5], "one": [1] + [np.nan] * 4}
    (curve,) = attribute_curves({"a": [0.1, 0.2, 0.3, 0.4, np.nan]}, measured)
    assert curve.attribute == "size"
    assert curve.attribute_values.tolist() == [1, 2, 4]
    assert curve.interval == (-1, 1)
    (curve,) = attribute_curves({"a": [0.5] * 12}, {"size": np.arange(12)})
    assert isnan(curve.correlation)  # all scores are equal
    assert "—" in to_text(attribute_table([curve], OVERLAP))


def new_curve(n, trackers=("camshift:window=adaptive", "opencv-mil")):
    generator = np.random.default_rng(n)
    scores = {name: generator.random(n) for name in trackers}
    names = ("brightness_change", "border", "size")
    measured = {name: generator.normal(-1.1, 3, n) for name in names}
    return attribute_curves(scores, measured)


def test_table_has_both_ends_and_a_row_of_data_per_bin():
    curves = new_curve(20)
    table = attribute_table(curves, OVERLAP)
    lines = terminal_lines(table)
    assert max(map(len, lines)) <= 100
    text = " ".join(lines)
    assert all(word in text for word in ("lowest", "highest", "Bonferroni"))
    assert len(table.records) == 3 * len(curves)
    assert table.records["bin_mean"][2] == curves[0].bins[2].mean
    assert "6 of 6 rows have no curve" in to_text(attribute_table(new_curve(8), OVERLAP))


def test_plot_has_a_panel_per_attribute():
    curves = new_curve(20)
    figure = plot_attributes(curves, OVERLAP, "title")
    labels = [axes.get_xlabel() for axes in figure.axes if axes.get_visible()]
    names = dict.fromkeys(entry.attribute for entry in curves)
    assert labels == [attributes.ATTRIBUTES[name].heading for name in names]
