"""A sequence: images that come lazily, and what is true of the target in them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.datasets import Sequence, SequenceError

NAN = [float("nan")] * 4
BOX = [2.0, 1.0, 4.0, 3.0]


class Numbered:
    """n images of 10x8 pixels that hold their frame number; remembers what was asked for."""

    def __init__(self, n):
        self.n = n
        self.asked = []

    def __len__(self):
        return self.n

    def __getitem__(self, frame):
        self.asked.append(frame)
        return np.full((8, 10, 3), frame, np.uint8)


def sequence(n=6, boxes=None, **more):
    boxes = [BOX] * n if boxes is None else boxes
    return Sequence("numbered", Numbered(n), boxes, **{"fingerprint": "f", **more})


def numbers(images):
    return [int(image[0, 0, 0]) for image in images]


def test_iterating_gives_every_image_once_and_in_order():
    assert numbers(sequence()) == [0, 1, 2, 3, 4, 5]


def test_images_come_only_when_asked_for():
    frames = Numbered(6)
    taken = Sequence("s", frames, [BOX] * 6, fingerprint="f")[1:5]
    assert frames.asked == []
    assert numbers([taken[2]]) == [3]
    assert frames.asked == [3]


def test_images_and_truth_are_read_only():
    one = sequence()
    for array in (one[0], one.boxes, one.visibility):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_the_truth_does_not_change_with_the_array_it_was_given():
    boxes = np.array([BOX] * 6)
    one = sequence(boxes=boxes)
    boxes[:] = 0
    assert one.boxes.tolist() == [BOX] * 6


def test_negative_numbers_count_from_the_end():
    one = sequence()
    assert numbers([one[-1], one[-6]]) == [5, 0]


@pytest.mark.parametrize("frame", [6, -7])
def test_a_frame_that_is_not_there_is_an_index_error(frame):
    with pytest.raises(IndexError, match=f"numbered: no frame {frame}; there are 6"):
        sequence()[frame]


limits = st.none() | st.integers(-9, 9)


@given(start=limits, stop=limits, step=st.none() | st.integers(-3, 3).filter(bool))
def test_a_slice_holds_what_a_slice_of_a_list_holds(start, stop, step):
    n = 7
    cut = slice(start, stop, step)
    expected = list(range(n))[cut]
    one = sequence(
        n,
        boxes=[[i, 0, 1, 1] for i in range(n)],
        regions={"full": [[i, 0, 2, 2] for i in range(n)]},
        visibility=np.arange(n) / 10,
        attributes={"odd": [i % 2 for i in range(n)]},
        frame_names=[f"{i}.jpg" for i in range(n)],
        masks=lambda frame: np.full((8, 10), frame % 2 == 1),
        fps=25.0,
    )
    if not expected:
        with pytest.raises(SequenceError, match="there are no images"):
            one[cut]
        return
    part = one[cut]
    assert numbers(part) == expected
    assert part.boxes[:, 0].tolist() == expected
    assert part.regions["full"][:, 0].tolist() == expected
    assert part.visibility.tolist() == [i / 10 for i in expected]
    assert part.attributes["odd"].tolist() == [i % 2 == 1 for i in expected]
    assert [part.frame_name(i) for i in range(len(part))] == [f"{i}.jpg" for i in expected]
    assert [bool(part.mask(i).all()) for i in range(len(part))] == [i % 2 == 1 for i in expected]
    assert part.fps == 25.0


def test_a_slice_of_a_slice_is_as_one():
    assert numbers(sequence(12, [BOX] * 12)[2:11:2][1:4]) == [4, 6, 8]


def test_a_slice_has_a_name_and_a_fingerprint_of_its_own():
    one = sequence()
    parts = [one, one[:3], one[1:4], one[::2]]
    assert len({part.name for part in parts}) == 4
    assert len({part.fingerprint for part in parts}) == 4
    assert one[:3].fingerprint == one[0:3:1].fingerprint


def test_the_fingerprint_is_asked_for_once_and_not_on_opening():
    asked = []
    one = sequence(fingerprint=lambda: asked.append(1) or "late")
    assert asked == []
    assert (one.fingerprint, one.fingerprint) == ("late", "late")
    assert asked == [1]


def test_the_sequence_ends_with_its_truth():
    one = sequence(6, [BOX] * 4)
    assert len(one) == 4
    assert one.images_beyond_truth == 2
    assert numbers(one) == [0, 1, 2, 3]
    with pytest.raises(IndexError):
        one[4]


def test_more_truth_than_images_names_both():
    with pytest.raises(SequenceError, match=r"t\.txt: 7 truth rows for 6 images of numbered"):
        sequence(6, [BOX] * 7, truth_source="t.txt")


def test_without_truth_every_frame_is_empty():
    one = Sequence("bare", Numbered(3), fingerprint="f")
    assert np.isnan(one.boxes).all()
    assert one.boxes.shape == (3, 4)
    assert not one.present.any()
    assert numbers(one) == [0, 1, 2]


def test_the_first_frame_is_the_first_with_the_target_in_it():
    one = sequence(4, [NAN, NAN, BOX, NAN])
    assert one.first_frame == 2
    assert one.present.tolist() == [False, False, True, False]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"boxes": [[1, 2, 3]] * 6}, r"boxes have shape \(6, 3\), not \(6, 4\)"),
        ({"visibility": [1.0]}, r"visibility have shape \(1,\), not \(6,\)"),
        ({"regions": {"full": [BOX]}}, r"region full have shape \(1, 4\), not \(6, 4\)"),
        ({"attributes": {"fast": [True]}}, r"attribute fast has shape \(1,\), not \(6,\)"),
    ],
)
def test_truth_of_another_shape_is_named(wrong, message):
    with pytest.raises(SequenceError, match=f"numbered: {message}"):
        sequence(**wrong)


class TestRunnable:
    @pytest.mark.parametrize(
        "box", [BOX, [0, 0, 10, 8], [-3, -2, 4, 3], [9.5, 7.5, 5, 5], [-5, -5, 50, 50]]
    )
    def test_a_box_that_shows_something_of_the_image_is_fine(self, box):
        sequence(2, [box, NAN]).check_runnable()

    @pytest.mark.parametrize(
        ("box", "fault"),
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
    def test_a_first_box_without_size_or_outside_is_named_in_full(self, box, fault):
        x, y, width, height = box
        where = rf"t\.csv: the first box, of b\.png, {fault}: x={x} y={y} "
        with pytest.raises(SequenceError, match=where + rf"width={width} height={height} .*Mend"):
            sequence(
                2, [NAN, box], truth_source="t.csv", frame_names=["a.png", "b.png"]
            ).check_runnable()

    def test_later_boxes_are_not_looked_at(self):
        frames = Numbered(3)
        Sequence("s", frames, [BOX, [99, 99, 1, 1], NAN], fingerprint="f").check_runnable()
        assert frames.asked == [0]

    def test_no_image_is_read_where_their_size_is_known(self):
        frames = Numbered(3)
        options = {"fingerprint": "f", "image_size": (10, 8)}
        Sequence("s", frames, [BOX, NAN, NAN], **options)[:2].check_runnable()
        with pytest.raises(SequenceError, match=r"lies outside the image \(10x8\)"):
            Sequence("s", frames, [[9, 8, 4, 3]], **options).check_runnable()
        assert frames.asked == []

    def test_without_truth_it_says_how_to_give_or_make_one(self):
        bare = Sequence("bare", Numbered(3), fingerprint="f")
        with pytest.raises(SequenceError, match=r"bare: there is no truth.*--truth.*annotate"):
            bare.check_runnable()
