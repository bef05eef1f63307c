"""Sequences: images read on request, with their ground truth."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.datasets import Sequence, SequenceError

NAN = [float("nan")] * 4
BOX = [2.0, 1.0, 4.0, 3.0]


class NumberedFrames:
    """Images of 10x8 pixels that contain their frame number; records which frames are read."""

    def __init__(self, n):
        self.n = n
        self.reads = []

    def __len__(self):
        return self.n

    def __getitem__(self, frame):
        self.reads.append(frame)
        return np.full((8, 10, 3), frame, np.uint8)


def numbered(n=6, boxes=None, **options):
    boxes = [BOX] * n if boxes is None else boxes
    return Sequence("numbered", NumberedFrames(n), boxes, **{"fingerprint": "f", **options})


def numbers(images):
    return [int(image[0, 0, 0]) for image in images]


def test_images_are_read_on_request_in_order():
    sequence = numbered()
    part = sequence[1:5]
    assert sequence.frames.reads == []
    assert numbers([part[2]]) == [3] == sequence.frames.reads
    assert numbers(sequence) == [0, 1, 2, 3, 4, 5]
    assert numbers([sequence[-1], sequence[-6]]) == [5, 0]
    for frame in (6, -7):
        with pytest.raises(IndexError, match=f"numbered: no frame {frame}; there are 6"):
            sequence[frame]


def test_images_and_ground_truth_are_read_only_copies():
    boxes = np.array([BOX] * 6)
    sequence = numbered(boxes=boxes)
    boxes[:] = 0
    assert sequence.boxes.tolist() == [BOX] * 6
    for array in (sequence[0], sequence.boxes, sequence.visibility):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


limits = st.none() | st.integers(-9, 9)


@given(start=limits, stop=limits, step=st.none() | st.integers(-3, 3).filter(bool))
def test_slice_selects_frames_as_a_slice_of_a_list(start, stop, step):
    n = 7
    index = slice(start, stop, step)
    expected = list(range(n))[index]
    sequence = numbered(
        n,
        boxes=[[i, 0, 1, 1] for i in range(n)],
        regions={"full": [[i, 0, 2, 2] for i in range(n)]},
        annotated=[True] * 6 + [False],
        visibility=np.arange(n) / 10,
        attributes={"odd": [i % 2 for i in range(n)]},
        frame_names=[f"{i}.jpg" for i in range(n)],
        masks=lambda frame: np.full((8, 10), frame % 2 == 1),
        fps=25.0,
    )
    if not expected:
        with pytest.raises(SequenceError, match="there are no images"):
            sequence[index]
        return
    part = sequence[index]
    assert numbers(part) == expected
    boxes = [i if i < 6 else pytest.approx(np.nan, nan_ok=True) for i in expected]
    assert part.boxes[:, 0].tolist() == boxes
    assert part.regions["full"][:, 0].tolist() == boxes
    assert part.annotated.tolist() == [i < 6 for i in expected]
    assert part.visibility.tolist() == [i / 10 for i in expected]
    assert part.attributes["odd"].tolist() == [i % 2 == 1 for i in expected]
    assert [part.frame_name(i) for i in range(len(part))] == [f"{i}.jpg" for i in expected]
    masks = [part.mask(i) for i in range(len(part))]
    all_set = [mask is None or bool(mask.all()) for mask in masks]
    assert all_set == [i in (1, 3, 5, 6) for i in expected]
    assert part.fps == 25.0
    assert numbers(part[::-1]) == expected[::-1]


def test_slice_has_its_own_name_and_fingerprint():
    sequence = numbered()
    parts = [sequence, sequence[:3], sequence[1:4], sequence[::2]]
    assert len({part.name for part in parts}) == 4
    assert len({part.fingerprint for part in parts}) == 4
    assert sequence[:3].fingerprint == sequence[0:3:1].fingerprint


def test_fingerprint_is_computed_once_at_the_first_access():
    calls = []
    sequence = numbered(fingerprint=lambda: calls.append(1) or "late")
    assert calls == []
    assert (sequence.fingerprint, sequence.fingerprint) == ("late", "late")
    assert calls == [1]


def test_sequence_ends_with_its_ground_truth():
    sequence = numbered(6, [BOX] * 4)
    assert (len(sequence), sequence.n_unread_images) == (4, 2)
    assert numbers(sequence) == [0, 1, 2, 3]
    with pytest.raises(IndexError):
        sequence[4]


def test_sequence_without_ground_truth_has_only_nan_rows():
    sequence = Sequence("bare", NumberedFrames(3), fingerprint="f")
    assert np.isnan(sequence.boxes).all()
    assert sequence.boxes.shape == (3, 4)
    assert not sequence.present.any()
    assert not sequence.annotated.any()
    assert numbers(sequence) == [0, 1, 2]
    with pytest.raises(SequenceError, match=r"bare: there is no ground truth.*--truth.*annotate"):
        sequence.check_runnable()


def test_first_frame_is_the_first_with_the_target():
    sequence = numbered(4, [NAN, NAN, BOX, NAN])
    assert sequence.first_frame == 2
    assert sequence.present.tolist() == [False, False, True, False]


def test_frames_without_annotation_have_no_box_and_no_mask():
    mask = np.ones((8, 10), np.bool_)
    sequence = numbered(
        3, annotated=[True, False, True], regions={"full": [BOX] * 3}, masks=lambda _: mask
    )
    assert sequence.present.tolist() == [True, False, True]
    assert np.isnan(sequence.boxes[1]).all()
    assert np.isnan(sequence.regions["full"][1]).all()
    assert [sequence.mask(frame) is None for frame in range(3)] == [False, True, False]
    assert numbered(3, [BOX, NAN, BOX]).annotated.all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"boxes": [[1, 2, 3]] * 6}, r"numbered: boxes: the shape is \(6, 3\)\. Expected: \(6, 4"),
        ({"visibility": [1.0]}, r"numbered: visibility: the shape is \(1,\)\. Expected: \(6,\)"),
        ({"regions": {"full": [BOX]}}, r"numbered: region full: the shape is \(1, 4\)"),
        ({"attributes": {"fast": [True]}}, r"numbered: attribute fast: the shape is \(1,\)"),
        (
            {"boxes": [BOX] * 7, "truth_source": "t.txt"},
            r"t\.txt: 7 ground-truth rows for 6 images of numbered",
        ),
    ],
)
def test_ground_truth_of_another_shape_is_refused(options, message):
    with pytest.raises(SequenceError, match=message):
        numbered(**options)


class TestCheckRunnable:
    @pytest.mark.parametrize(
        "box", [BOX, [0, 0, 10, 8], [-3, -2, 4, 3], [9.5, 7.5, 5, 5], [-5, -5, 50, 50]]
    )
    def test_box_partly_inside_the_image_is_accepted(self, box):
        numbered(2, [box, NAN]).check_runnable()

    @pytest.mark.parametrize(
        ("box", "problem"),
        [
            ([2, 1, 0, 3], "has no size"),
            ([2, 1, 4, 0], "has no size"),
            ([2, 1, -4, 3], "has no size"),
            ([10, 1, 4, 3], r"lies outside the image \(10x8\)"),
            ([2, 8, 4, 3], r"lies outside the image \(10x8\)"),
            ([-4, 1, 4, 3], r"lies outside the image \(10x8\)"),
            ([2, -3, 4, 3], r"lies outside the image \(10x8\)"),
        ],
    )
    def test_init_box_without_size_or_outside_is_refused(self, box, problem):
        x, y, width, height = box
        position = rf"t\.csv: the first box, of b\.png, {problem}: x={x} y={y} "
        names = ["a.png", "b.png"]
        sequence = numbered(2, [NAN, box], truth_source="t.csv", frame_names=names)
        with pytest.raises(SequenceError, match=rf"{position}width={width} height={height} .*Corr"):
            sequence.check_runnable()

    def test_only_the_image_of_the_first_box_is_read(self):
        sequence = numbered(3, [BOX, [99, 99, 1, 1], NAN])
        sequence.check_runnable()
        assert sequence.frames.reads == [0]

    def test_image_of_known_size_is_not_read(self):
        sequence = numbered(3, [BOX, NAN, NAN], image_size=(10, 8))
        sequence[:2].check_runnable()
        outside = numbered(3, [[11, 8, 4, 3]], image_size=(10, 8))
        with pytest.raises(SequenceError, match=r"lies outside the image \(10x8\)"):
            outside.check_runnable()
        assert sequence.frames.reads == outside.frames.reads == []
