"""Short check of estimates with the usual types: it accepts what the complete check accepts."""

from itertools import product
from math import inf, nan

import numpy as np
import pytest

from trackmark.bench.evaluation.recorder import _usual_row
from trackmark.trackers import Estimate
from trackmark.trackers.base.estimate_check import read_estimate

BOX = np.array([1.0, -2.0, 3.0, 4.0])
BOXES = [BOX, BOX.astype(np.float32), BOX.astype(">f8"), BOX[:3], BOX[None], BOX.tolist(), None]
BOXES += [np.array(values) for values in ([0.0] * 4, [nan, 2, 3, 4], [1, inf, 3, 4], [1, 2, 0, 4])]
VISIBLE = [True, False, None, np.False_, 1, "no"]
CONFIDENCE = [0.5, 1.0, nan, None, np.float64(0.5), 1, 1.5, -inf, "0.5"]
DETAILS = [{}, {"a": 1.0}, {"a": nan}, {"a": 1}, {1: 1.0}, {"a": "b"}, None, []]


@pytest.mark.parametrize("mask", [None, np.ones((9, 9), np.bool_)])
def test_short_check_accepts_what_the_complete_check_accepts(mask):
    accepted = 0
    for values in product(BOXES, VISIBLE, CONFIDENCE, DETAILS):
        box, visible, confidence, details = values
        estimate = Estimate(box, visible, confidence, mask, details)
        if row := _usual_row(estimate):
            fields = read_estimate(estimate, (9, 9))  # raises no error
            expected = (*fields["box"], fields["visible"], fields["confidence"])
            np.testing.assert_array_equal(row, expected)
            assert fields["details"].keys() == details.keys()
            accepted += 1
    assert accepted == (0 if mask is not None else 18)
