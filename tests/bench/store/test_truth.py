"""Polygons and masks of a stored truth: what was known of the sequence is known of its file."""

import numpy as np
import pyarrow as pa
import pytest

from trackmark.bench.store.checksum import DamagedError, arrow_bytes, read_arrow
from trackmark.bench.store.truth import check_truth, read_truth, truth_path, write_truth
from trackmark.datasets.shapes import EncodedMask, Shapes

SIZE = (32, 24)
POLYGON = np.array([[1.5, 2], [9.1, 2], [9, 8], [0.1, 7]])
MASK = EncodedMask(3, 4, 5, 2, np.array([2, 5, 3]))
N = 12


@pytest.fixture
def outlined(make_sequence):
    """A sequence with these outlines by frame."""

    def make(known):
        return make_sequence(n=N, absent=(4,), shapes=Shapes(known, range(N), SIZE))

    return make


@pytest.fixture
def kept(tmp_path):
    """A sequence's truth, written and read."""

    def keep(sequence):
        write_truth(tmp_path, sequence)
        return read_truth(tmp_path, sequence.name, sequence.fingerprint)

    return keep


@pytest.mark.parametrize(
    "known", [{0: POLYGON, 3: POLYGON + 0.25}, {1: MASK}, {0: POLYGON, 1: MASK, 11: POLYGON[:3]}]
)
def test_outlines_are_kept_to_the_bit(outlined, kept, known):
    sequence = outlined(known)
    found = kept(sequence)
    assert len(found.shapes) == N
    for ours, theirs in zip(found.shapes, sequence.shapes, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert found.shapes[1:3][0] is None or found.shapes[1:3][0].shape == SIZE[::-1]


def test_a_truth_of_boxes_has_none(make_sequence, kept, tmp_path):
    assert kept(make_sequence(n=N)).shapes is None
    (file,) = tmp_path.glob("_truth/*/*")
    assert not [name for name in read_arrow(file).column_names if name.startswith("shape")]


def test_a_truth_that_was_stored_without_them_gets_them_with_the_next_run(
    outlined, make_sequence, kept
):
    assert kept(make_sequence(n=N, absent=(4,))).shapes is None
    found = kept(outlined({0: POLYGON}))
    np.testing.assert_array_equal(found.shapes[0], POLYGON)


@pytest.mark.parametrize(
    ("kind", "row"), [("polygon", [1.0, 2.0, 3.0]), ("mask", [0, 0, 2, 2, 3]), ("mask", [0, 0])]
)
def test_what_is_no_outline_is_told_in_the_files_name(outlined, tmp_path, kind, row):
    sequence = outlined({0: POLYGON, 1: MASK})
    write_truth(tmp_path, sequence)
    file = truth_path(tmp_path, sequence.name, sequence.fingerprint)
    table = read_arrow(file)
    number = table.column_names.index(f"shape/{kind}")
    rows = pa.array([row] * N, table.schema.field(number).type)
    table = table.set_column(number, f"shape/{kind}", rows)
    file.write_bytes(arrow_bytes(table, table.schema.metadata))
    with pytest.raises(DamagedError, match="holds no truth"):
        check_truth(file)
