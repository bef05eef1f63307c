"""Means and sums of a test's rows are, to the bit, those that pandas makes of them."""

import numpy as np
import pandas as pd
import pytest

from bench.claims.verdicts import _keys, _reduced


@pytest.mark.parametrize("how", ["mean", "sum"])
@pytest.mark.parametrize("rows", [40, 2000])
def test_labels_of_all_kinds_values_that_are_missing_and_labels_that_are(how, rows):
    random = np.random.default_rng(rows)
    labels = {
        "sequence": random.choice(["b", "a", "c"], rows).astype(object),
        "scene": random.integers(0, 12, rows),
        "of": [[10, 2, True, "auto", None, np.nan][i] for i in random.integers(0, 6, rows)],
    }
    frame = pd.DataFrame({**labels, "of": pd.Series(labels["of"], dtype=object)})
    values = np.where(random.random(rows) < 0.2, np.nan, random.random(rows))
    found = _reduced(_keys(frame, list(frame)), values, how)
    groups = pd.Series(values).groupby([frame[column] for column in frame])
    counts = groups.size()
    assert (counts.max() > 2) == (rows == 2000)  # both ways of adding
    expected = groups.agg(how)
    assert list(found) == list(expected.index)
    assert np.array_equal(list(found.values()), expected, equal_nan=True)
