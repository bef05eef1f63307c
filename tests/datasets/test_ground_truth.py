"""Ground truth: CSV files, interpolation of marked boxes, polygons and masks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from trackmark.datasets import SequenceError
from trackmark.datasets.annotation import interpolate
from trackmark.datasets.shapes import EncodedMask, Shapes
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
    annotated = draw(st.none() | arrays(np.bool_, n))
    if annotated is not None:
        annotated[-1] = True
        boxes[~annotated] = np.nan
        annotated = None if annotated.all() else annotated
    if annotated is not None and visibility is not None:
        visibility[~annotated] = np.nan
    if annotated is not None and sources is not None:
        sources = tuple(np.where(annotated, sources, "").tolist())
    return GroundTruth(boxes, visibility, sources, annotated)


@given(truth=truths())
def test_written_ground_truth_is_read_bit_identically(truth, tmp_path_factory):
    path = tmp_path_factory.mktemp("truth") / "truth.csv"
    write(path, truth, ["one, with a comma", "", "two"])
    copy = read(path)
    np.testing.assert_array_equal(copy.boxes, truth.boxes)
    assert copy.sources == truth.sources
    np.testing.assert_array_equal(copy.annotated_frames, truth.annotated_frames)
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


def test_empty_box_is_absence_and_no_row_is_no_annotation(truth_of):
    truth = truth_of("frame,x,y,width,height\n1,5,6,7,8\n3,,,,\n4,1,2,3,4\n6,,,,\n")
    assert np.isfinite(truth.boxes).all(axis=1).tolist() == [0, 1, 0, 0, 1, 0, 0]
    assert truth.annotated_frames.tolist() == [0, 1, 0, 1, 1, 0, 1]
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
        ("frame,x,y,width,height,colour\n", 1, "is not the header"),
        ("frame,x,y,width,height,source,source\n", 1, "is not the header"),
        ("#\nframe,x,y,width,height\n0,1,2,3\n", 3, "4 values for the 5 columns"),
        ("frame,x,y,width,height\n0,1,2,3,4\n0,1,2,3,4\n", 3, "frame 0 follows frame 0"),
        ("frame,x,y,width,height\n-1,1,2,3,4\n", 2, "'-1' is not a frame number"),
        ("frame,x,y,width,height\n0.5,1,2,3,4\n", 2, "'0.5' is not a frame number"),
        ("frame,x,y,width,height\n,1,2,3,4\n", 2, "'' is not a frame number"),
        ("frame,x,y,width,height\n99999999999,1,2,3,4\n", 2, "is not a frame number"),
        ("frame,x,y,width,height\n0,a,2,3,4\n", 2, "'a' is not a number"),
        ("frame,x,y,width,height\n0,nan,2,3,4\n", 2, "'nan' is not a number"),
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


BOX = [10.0, 20.0, 30.0, 40.0]


@given(
    start=st.lists(st.floats(1, 500), min_size=4, max_size=4),
    change=st.lists(st.floats(-0.01, 5), min_size=4, max_size=4),
    keys=st.sets(st.integers(0, 59), min_size=2),
)
def test_uniform_motion_is_interpolated_exactly(start, change, keys):
    frames = np.arange(60)[:, np.newaxis]
    motion = np.array(start) + frames * np.array(change)
    truth = interpolate({frame: motion[frame] for frame in keys}, 60)
    inside = slice(min(keys), max(keys) + 1)
    np.testing.assert_allclose(truth.boxes[inside], motion[inside], atol=1e-9)
    assert np.isnan(truth.boxes[: min(keys)]).all()
    assert np.isnan(truth.boxes[max(keys) + 1 :]).all()


def test_marked_boxes_are_kept_exactly():
    keys = {7: [0.1, 0.2, 0.3, 0.4], 2: BOX}
    truth = interpolate(keys, 10)
    assert truth.boxes[[2, 7]].tolist() == [BOX, keys[7]]
    assert interpolate({2: BOX}, 4).sources == ("", "", "marked", "")


def test_absent_frames_do_not_change_the_interpolation():
    keys = {0: BOX, 10: [20, 30, 40, 50]}
    expected = interpolate(keys, 11).boxes.copy()
    expected[[3, 4, 5, 9]] = np.nan
    truth = interpolate(keys, 11, absent=[(3, 5), (9, 9)])
    np.testing.assert_array_equal(truth.boxes, expected)
    between = ["interpolated"] * 2
    assert truth.sources == ("marked", *between, "", "", "", *between, "interpolated", "", "marked")


@pytest.mark.parametrize(
    ("keys", "absent", "message"),
    [
        ({}, [], "no key frames"),
        ({10: BOX}, [], "frame 10 is outside the sequence. Expected: 0 to 9"),
        ({-1: BOX}, [], "frame -1 is outside"),
        ({0: [1, 2, 0, 4]}, [], r"frame 0: invalid box \[1.0, 2.0, 0.0, 4.0\]"),
        ({0: [1, 2, float("nan"), 4]}, [], "frame 0: invalid box"),
        ({0: BOX}, [(3, 12)], "frame 12 is outside"),
        ({0: BOX}, [(5, 3)], "absent 5-3: the interval ends before it starts"),
        ({0: BOX, 4: BOX}, [(3, 5)], "frame 4 has a box, but the target is absent in frames 3-5"),
    ],
)
def test_invalid_input_is_refused(keys, absent, message):
    with pytest.raises(SequenceError, match=message):
        interpolate(keys, 10, absent)


POLYGON = np.array([[1.5, 2], [9, 2], [9, 8]])


def runs_of(mask):
    """Return the lengths of alternating runs outside and inside, row by row."""
    runs, inside = [0], False
    for pixel in mask.ravel().tolist():
        if pixel != inside:
            runs.append(0)
            inside = pixel
        runs[-1] += 1
    return np.array(runs)


@given(arrays(bool, st.tuples(st.integers(1, 6), st.integers(1, 7))), st.integers(0, 3))
def test_mask_is_decoded_from_its_runs(part, shift):
    height, width = part.shape
    encoded = EncodedMask(shift, 2 * shift, width, height, runs_of(part))
    np.testing.assert_array_equal(encoded.pixels(), part)
    mask = encoded.decode((12, 13))
    assert mask.shape == (13, 12)
    assert mask.sum() == part.sum()
    rows, columns = np.nonzero(mask)
    if len(rows):
        size = np.ptp(columns) + 1, np.ptp(rows) + 1
        assert encoded.box() == [columns.min(), rows.min(), *size]
    else:
        assert np.isnan(encoded.box()).all()


@pytest.mark.parametrize("runs", [[3], [5, 2], [4, -1, 3]])
def test_runs_of_another_length_are_refused(runs):
    with pytest.raises(ValueError, match=r"pixels\. Expected: 2x3"):
        EncodedMask(0, 0, 2, 3, np.array(runs))


def test_shapes_belong_to_the_selected_frames():
    mask = EncodedMask(1, 0, 2, 1, np.array([1, 1]))
    shapes = Shapes({0: POLYGON, 2: mask}, range(4), (3, 2))
    assert len(shapes) == 4
    kinds = [None if shape is None else shape.dtype for shape in shapes]
    assert kinds == [np.float64, None, np.bool_, None]
    assert shapes[2].tolist() == [[False, False, True], [False, False, False]]
    assert [shape is None for shape in shapes[::-1]] == [True, False, True, False]
    assert shapes[1:][1:].as_stored() == [mask, None]
    assert shapes[1:-1][1].shape == (2, 3)
