"""Ground truth in CSV files."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from trackmark.datasets import SequenceError
from trackmark.datasets.truth_file import GroundTruth, read, write

NUMBERS = st.floats(-1e6, 1e6)
SIZES = st.floats(1e-3, 1e6)


@st.composite
def truths(draw):
    n = draw(st.integers(1, 12))
    boxes = np.column_stack(
        [
            draw(arrays(np.float64, (n, 2), elements=NUMBERS)),
            draw(arrays(np.float64, (n, 2), elements=SIZES)),
        ]
    )
    boxes[draw(arrays(np.bool_, n))] = np.nan
    fractions = st.one_of(st.just(np.nan), st.floats(0, 1))
    visibility = draw(st.none() | arrays(np.float64, n, elements=fractions))
    sources = draw(st.none() | st.tuples(*[st.sampled_from(["marked", "interpolated", ""])] * n))
    return GroundTruth(boxes, visibility, sources)


@given(truth=truths())
def test_written_ground_truth_is_read_bit_identically(truth, tmp_path_factory):
    path = tmp_path_factory.mktemp("truth") / "truth.csv"
    write(path, truth, ["one, with a comma", "", "two"])
    copy = read(path)
    np.testing.assert_array_equal(copy.boxes, truth.boxes)
    assert copy.sources == truth.sources
    assert (copy.visibility is None) == (truth.visibility is None)
    if truth.visibility is not None:
        np.testing.assert_array_equal(copy.visibility, truth.visibility)


def test_written_file_has_the_shortest_numbers(tmp_path):
    boxes = np.array([[1.0, 2.5, 30, 40], [np.nan] * 4])
    write(tmp_path / "t.csv", GroundTruth(boxes, sources=("marked", "")), ["Made by hand."])
    assert (tmp_path / "t.csv").read_bytes() == (
        b"# Made by hand.\nframe,x,y,width,height,source\n0,1,2.5,30,40,marked\n1,,,,,\n"
    )


@pytest.fixture
def truth_of(tmp_path):
    def parse(text, encoding="utf-8"):
        path = tmp_path / "mine.csv"
        path.write_bytes(text.encode(encoding))
        return read(path)

    return parse


def test_missing_rows_and_empty_boxes_mean_absence(truth_of):
    truth = truth_of("frame,x,y,width,height\n1,5,6,7,8\n3,,,,\n4,1,2,3,4\n6,,,,\n")
    assert np.isfinite(truth.boxes).all(axis=1).tolist() == [0, 1, 0, 0, 1, 0, 0]
    assert truth.boxes[1].tolist() == [5, 6, 7, 8]


def test_comment_with_line_ends_stays_a_comment(tmp_path):
    boxes = np.array([[1.0, 2.0, 3.0, 4.0]])
    write(tmp_path / "truth.csv", GroundTruth(boxes), ["Truth of a\n5,6,7,8,9\r\udcff.avi", ""])
    np.testing.assert_array_equal(read(tmp_path / "truth.csv").boxes, boxes)


def test_comments_spaces_and_windows_line_ends_are_read(truth_of):
    text = "# made by me\r\n\r\nframe, x, y, width, height\r\n  # so it is\r\n0, 1,2 ,3,4 \r\n\r\n"
    assert truth_of(text, "utf-8-sig").boxes.tolist() == [[1, 2, 3, 4]]


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("0,1,2,3,4\n", 1, "'0,1,2,3,4' is not the header. Expected: frame,x,y,width,height"),
        ("x,y,width,height\n1,2,3,4\n", 1, "is not the header"),
        ("frame,x,y,width,height,colour\n", 1, "is not the header"),
        ("frame,x,y,width,height,source,source\n", 1, "is not the header"),
        ("#\nframe,x,y,width,height\n0,1,2,3\n", 3, "4 values for the 5 columns"),
        ("frame,x,y,width,height\n0,1,2,3,4\n0,1,2,3,4\n", 3, "frame 0 follows frame 0"),
        ("frame,x,y,width,height\n5,1,2,3,4\n4,1,2,3,4\n", 3, "frame 4 follows frame 5"),
        ("frame,x,y,width,height\n-1,1,2,3,4\n", 2, "'-1' is not a frame number"),
        ("frame,x,y,width,height\n0.5,1,2,3,4\n", 2, "'0.5' is not a frame number"),
        ("frame,x,y,width,height\n,1,2,3,4\n", 2, "'' is not a frame number"),
        ("frame,x,y,width,height\n99999999999,1,2,3,4\n", 2, "is not a frame number"),
        ("frame,x,y,width,height\n0,a,2,3,4\n", 2, "'a' is not a number"),
        ("frame,x,y,width,height\n0,nan,2,3,4\n", 2, "'nan' is not a number"),
        ("frame,x,y,width,height\n0,1,2,inf,4\n", 2, "'inf' is not a number"),
        ("frame,x,y,width,height\n0,1,2,3,\n", 2, "'' is not a number"),
        ("frame,x,y,width,height\n0,1,2,0,4\n", 2, "the box of frame 0 has no size"),
        ("frame,x,y,width,height\n0,1,2,3,-4\n", 2, "the box of frame 0 has no size"),
        ("frame,x,y,width,height,visibility\n0,1,2,3,4,1.5\n", 2, "visibility 1.5 of frame 0"),
        ("frame,x,y,width,height,source\n0,1,2,3,4,guess\n", 2, "source 'guess' of frame 0"),
    ],
)
def test_mistake_is_refused_with_its_line(truth_of, text, line, message):
    with pytest.raises(SequenceError, match=message) as caught:
        truth_of(text)
    assert f"mine.csv: line {line}: " in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "# nothing\n", "frame,x,y,width,height\n"])
def test_file_without_rows_is_refused_with_the_format(truth_of, text):
    with pytest.raises(SequenceError, match=r"mine\.csv: there are no rows\. Expected: .* frame,x"):
        truth_of(text)


def test_unreadable_file_is_refused_by_name(tmp_path):
    (tmp_path / "clip.csv").write_bytes(bytes(range(128, 256)))
    with pytest.raises(SequenceError, match=r"clip\.csv: not a text file"):
        read(tmp_path / "clip.csv")
    with pytest.raises(SequenceError, match=r"gone\.csv: cannot be read"):
        read(tmp_path / "gone.csv")
