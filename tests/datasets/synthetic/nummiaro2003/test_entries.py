"""Where targets can come into the picture."""

import pytest

import datasets
from datasets import SequenceError
from datasets.synthetic import nummiaro2003


@pytest.mark.parametrize("name", nummiaro2003.SUITE.names())
def test_entries_lie_in_the_picture(name):
    boxes = nummiaro2003.entries(f"{name}:scene=3")
    assert len(boxes) >= 2
    assert (boxes[:, :2] >= -1).all()
    assert (boxes[:, :2] + boxes[:, 2:] <= [641, 481]).all()
    assert (boxes[:, 2:] > 5).all()


def test_heads_come_in_at_the_borders():
    name = "nummiaro2003/head"
    rows = datasets.load(name).boxes[:, 1::2] @ [1, 0.5]
    left, right = nummiaro2003.entries(name)
    assert left[0] == 0
    assert right[0] + right[2] == 640
    for _, top, width, height in (left, right):
        assert 40 < width < 110
        assert ((rows > top) & (rows < top + height)).mean() > 0.9


def test_entries_of_a_sequence_of_another_suite_are_refused():
    with pytest.raises(SequenceError, match=r"^'multipart/1' has no [^\n]*nummiaro2003/person"):
        nummiaro2003.entries("multipart/1")
