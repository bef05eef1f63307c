"""Attributes of sequences: each by its definition in plain Python, and on pictures whose values
are known without computing."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from trackmark import datasets
from trackmark.datasets import Sequence, SequenceError, attributes
from trackmark.datasets.attributes import measuring
from trackmark.datasets.attributes.view import View

HEIGHT, WIDTH = 24, 30


def sequence(images, boxes, visibility=None, name="made"):
    content = b"".join(image.tobytes() for image in images) + np.asarray(boxes, float).tobytes()
    return Sequence(
        name, images, boxes, fingerprint=f"{name} {hash(content)}", visibility=visibility
    )


def series(images, boxes, **more):
    return attributes.measure(sequence(images, boxes, **more))


def textured(seed, height=HEIGHT, width=WIDTH):
    generator = np.random.default_rng(seed)
    noise = generator.integers(0, 256, (height, width, 3)).astype(np.uint8)
    return cv2.GaussianBlur(noise, (0, 0), 1.0)


# What each says, pixel by pixel, in plain Python.


def pixels_in(image, box):
    x, y, w, h = box
    return [
        [(i, j) for j in range(image.shape[1]) if x <= j + 0.5 < x + w]
        for i in range(image.shape[0])
        if y <= i + 0.5 < y + h
    ]


def grey_of(image, box):
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    rows = [[float(grey[place]) for place in row] for row in pixels_in(image, box)]
    return [row for row in rows if row]


def slow_size(now):
    return math.sqrt(now.box[2] * now.box[3])


def slow_scale_change(now):
    first = now.first or now
    return abs(math.log(slow_size(now) / slow_size(first)) / math.log(2))


def slow_aspect_change(now):
    (_, _, w, h), (_, _, first_w, first_h) = now.box, (now.first or now).box
    return abs(math.log((w / h) / (first_w / first_h)) / math.log(2))


def slow_motion(now):
    if now.before is None:
        return math.nan
    (x, y, w, h), (u, v, p, q) = now.box, now.before.box
    return math.dist((x + w / 2, y + h / 2), (u + p / 2, v + q / 2)) / math.sqrt(p * q)


def averaged(values):
    """Means over 9 neighbours, mirrored at both ends."""
    n = len(values)

    def mirrored(i):
        while not 0 <= i < n:
            i = -i - 1 if i < 0 else 2 * n - i - 1
        return values[i]

    return [sum(mirrored(i + k) for k in range(-4, 5)) / 9 for i in range(n)]


def slow_blur(now):
    rows = grey_of(now.image, now.box)
    found = []
    for lines in (rows, [list(column) for column in zip(*rows, strict=True)]):
        smooth = [averaged(line) for line in lines]

        def difference(picture, i, j):
            ahead, behind = (
                picture[i - 1][k] + 2 * picture[i][k] + picture[i + 1][k] for k in (j + 1, j - 1)
            )
            return abs(ahead - behind)

        own = kept = 0.0
        for i in range(2, len(lines) - 1):
            for j in range(2, len(lines[0]) - 1):
                own += difference(lines, i, j)
                kept += min(difference(lines, i, j), difference(smooth, i, j))
        if own > 0:
            found.append(kept / own)
    return max(found, default=math.nan)


def mean_of(rows):
    values = [value for row in rows for value in row]
    return sum(values) / len(values) if values else math.nan


def slow_brightness_change(now):
    first = now.first or now
    return abs(mean_of(grey_of(now.image, now.box)) - mean_of(grey_of(first.image, first.box)))


def bilinear(rows, height, width):
    def at(line, place):
        place = min(max(place, 0.0), len(line) - 1.0)
        low = min(int(place), len(line) - 2) if len(line) > 1 else 0
        share = place - low
        high = min(low + 1, len(line) - 1)
        return line[low] * (1 - share) + line[high] * share

    across = [[at(row, (j + 0.5) * len(row) / width - 0.5) for j in range(width)] for row in rows]
    columns = [list(column) for column in zip(*across, strict=True)]
    down = [
        [at(column, (i + 0.5) * len(rows) / height - 0.5) for i in range(height)]
        for column in columns
    ]
    return [list(row) for row in zip(*down, strict=True)]


def slow_correlation(now):
    if now.before is None:
        return math.nan
    ends = []
    for axis, length in ((0, WIDTH), (1, HEIGHT)):
        parts = []
        for view in (now, now.before):
            low, side = view.box[axis], view.box[axis + 2]
            parts.append(((max(low, 0.0) - low) / side, (min(low + side, length) - low) / side))
        ends.append((max(low for low, _ in parts), min(high for _, high in parts)))
    pictures = []
    for view in (now, now.before):
        (left, right), (top, bottom) = ends
        x, y, w, h = view.box
        part = (x + left * w, y + top * h, (right - left) * w, (bottom - top) * h)
        pictures.append(grey_of(view.image, part))
    if not all(pictures):
        return math.nan
    later = [value for row in pictures[0] for value in row]
    resized = bilinear(pictures[1], len(pictures[0]), len(pictures[0][0]))
    earlier = [value for row in resized for value in row]
    a, b = sum(later) / len(later), sum(earlier) / len(earlier)
    squares = sum((v - a) ** 2 for v in later) * sum((v - b) ** 2 for v in earlier)
    if math.sqrt(squares) < 1e-9:
        return math.nan
    shared = sum((u - a) * (v - b) for u, v in zip(later, earlier, strict=True))
    return shared / math.sqrt(squares)


def slow_clutter(now):
    def colours(box):
        return {
            place: tuple(int(level) // 32 for level in now.image[place])
            for row in pixels_in(now.image, box)
            for place in row
        }

    x, y, w, h = now.box
    inside = colours(now.box)
    around = colours((x - w / 4, y - h / 4, 1.5 * w, 1.5 * h))
    outside = {place: colour for place, colour in around.items() if place not in inside}
    if not inside or not outside:
        return math.nan
    total = 0.0
    for colour in set(inside.values()):
        p = sum(one == colour for one in inside.values()) / len(inside)
        q = sum(one == colour for one in outside.values()) / len(outside)
        total += math.sqrt(p * q)
    return total


def slow_visibility(now):
    return now.visibility


def slow_border(now):
    x, y, w, h = now.box
    return min(x, y, WIDTH - x - w, HEIGHT - y - h) / slow_size(now)


SLOW = {name.removeprefix("slow_"): one for name, one in list(globals().items()) if "slow_" in name}

boxes = st.tuples(
    st.integers(-40, 110), st.integers(-40, 90), st.integers(1, 60), st.integers(1, 60)
).map(lambda quarters: np.array(quarters) / 4)


@given(st.integers(0, 2**31), st.tuples(boxes, boxes, boxes), st.floats(0, 1))
@example(  # of one grey level, but for the rounding when it is resized
    0, tuple(np.array(one) / 4 for one in ([0, 0, 1, 1], [0, 0, 3, 3], [0, 0, 3, 11])), 0.0
)
@settings(max_examples=60, deadline=None)
def test_each_is_what_its_definition_says_pixel_by_pixel(seed, three, visibility):
    assert set(SLOW) == set(attributes.names())
    images = [textured(seed + k) for k in range(3)]
    first = View(images[0], three[0], visibility)
    before = View(images[1], three[1], visibility, first, first)
    for now in (first, before, View(images[2], three[2], visibility, before, first)):
        for name, slow in SLOW.items():
            one = attributes.find(name)
            found = one.measure(now)
            exact = 1e-6 if name == "correlation" else 1e-9  # OpenCV resizes by float32
            assert found == pytest.approx(slow(now), abs=exact, nan_ok=True), name
            assert math.isnan(found) or one.least <= found <= one.most, name


@given(st.integers(0, 2**31), st.integers(1, 8), st.integers(1, 8))
@settings(max_examples=25, deadline=None)
def test_where_in_the_picture_it_is_matters_to_none_but_the_border(seed, right, down):
    scene = textured(seed, 30, 40)
    here = [np.array([9.0, 8.0, 9.0, 7.0]), np.array([10.25, 8.5, 8.0, 8.0])]
    moved = [box + [right, down, 0, 0] for box in here]
    shifted = np.roll(scene, (down, right), (0, 1))
    there, again = series([scene] * 2, here), series([shifted] * 2, moved)
    for name in set(attributes.names()) - {"border"}:
        assert again[name] == pytest.approx(there[name], abs=1e-12, nan_ok=True), name


@given(st.integers(0, 2**31), st.sampled_from([1.25, 1.5, 2.0, 2.5]))
@settings(max_examples=15, deadline=None)
def test_twice_the_picture_doubles_sizes_and_no_ratio(seed, grows):
    start = np.array([[4.0, 5.0, 8.0, 6.0], [6.0, 7.0, 8.0 * grows, 6.0]])
    picture = textured(seed)
    large = picture.repeat(2, axis=0).repeat(2, axis=1)
    one, twice = series([picture] * 2, start), series([large] * 2, 2 * start)
    assert twice["size"] == pytest.approx(2 * one["size"])
    for name in ("scale_change", "aspect_change", "motion", "border", "brightness_change"):
        assert twice[name] == pytest.approx(one[name], abs=1e-9, nan_ok=True), name


def test_a_box_that_grows_by_a_tenth_a_frame():
    n = 8
    sides = 10 * 1.1 ** np.arange(n)
    grown = np.stack([20 + np.arange(n), 30 * np.ones(n), sides, sides], axis=1)
    found = series([textured(1, 100, 120)] * n, grown)
    assert found["size"] == pytest.approx(sides)
    assert found["scale_change"] == pytest.approx(np.arange(n) * math.log2(1.1), abs=1e-12)
    assert found["aspect_change"] == pytest.approx(np.zeros(n), abs=1e-12)
    centres = grown[:, :2] + sides[:, None] / 2
    steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    assert found["motion"][1:] == pytest.approx(steps / sides[:-1])
    assert np.isnan(found["motion"][0])
    overall = attributes.overall(found)
    assert overall["size"] == pytest.approx(sides.mean())
    assert overall["scale_change"] == pytest.approx(np.quantile(found["scale_change"], 0.95))


def test_a_box_that_turns_upright_changes_its_aspect_alone():
    found = series([textured(1)] * 2, [[4, 4, 16, 4], [4, 4, 4, 16]])
    assert found["aspect_change"].tolist() == [0.0, 4.0]
    assert found["scale_change"].tolist() == [0.0, 0.0]


def detailed(seed, side=60):
    """A picture with detail of every size."""
    generator = np.random.default_rng(seed)
    picture = np.zeros((side, side))
    for cells in (3, 6, 12, 24, 60):
        picture += cv2.resize(generator.normal(size=(cells, cells)), (side, side))
    grey = np.clip(128 + 28 * picture, 0, 255).astype(np.uint8)
    return np.stack([grey] * 3, axis=2)


def test_more_of_a_gaussian_is_more_blur_and_less_light_is_not():
    sharp = detailed(0)
    deviations = (0.5, 1.0, 2.0, 4.0, 8.0)
    images = [sharp, *(cv2.GaussianBlur(sharp, (0, 0), deviation) for deviation in deviations)]
    found = series(images, [[10, 10, 40, 40]] * len(images))["blur"]
    assert (np.diff(found) > 0).all(), found
    assert found[-1] - found[0] > 0.4
    dimmed = series([sharp, sharp // 2], [[10, 10, 40, 40]] * 2)["blur"]
    assert dimmed[1] == pytest.approx(dimmed[0], abs=0.02)


@pytest.mark.parametrize("deviation", [0.4, 1.5, 6.0])
def test_blur_is_that_of_scikit_image(deviation):
    from skimage.measure import blur_effect

    picture = cv2.GaussianBlur(detailed(1), (0, 0), deviation)
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    found = series([picture], [[0, 0, 60, 60]])["blur"]
    assert found[0] == pytest.approx(blur_effect(grey, h_size=9), abs=1e-9)


def test_steps_of_light_are_told_in_grey_levels():
    images = [np.full((20, 20, 3), level, np.uint8) for level in (100, 120, 80, 100)]
    found = series(images, [[2, 2, 10, 10]] * 4)
    assert found["brightness_change"].tolist() == [0, 20, 20, 0]
    assert np.isnan(found["blur"]).all()  # nothing to see it by
    assert np.isnan(found["correlation"]).all()
    assert found["clutter"] == pytest.approx(np.ones(4))


def test_a_target_like_its_surround_is_told_by_no_histogram_and_another_by_each():
    alone = np.zeros((40, 40, 3), np.uint8)
    alone[10:20, 10:20] = 255
    stripes = np.zeros((40, 40, 3), np.uint8)
    stripes[:, ::2] = 255
    half = np.zeros((40, 40, 3), np.uint8)
    half[10:20, 10:15] = 255
    found = series([alone, stripes, half], [[10, 10, 10, 10]] * 3)["clutter"]
    # Half of the third shares the surround's black: √(1/2 · 1).
    assert found == pytest.approx([0.0, 1.0, math.sqrt(0.5)], abs=5e-3)


def test_the_same_picture_correlates_by_one_its_negative_by_minus_one():
    picture = textured(3)
    found = series([picture, picture, 255 - picture], [[5, 5, 12, 9]] * 3)["correlation"]
    assert np.isnan(found[0])
    assert found[1] == pytest.approx(1.0)
    assert found[2] == pytest.approx(-1.0, abs=0.01)  # grey levels are rounded


def test_what_leaves_the_picture_has_less_than_no_room():
    found = series([textured(4)] * 4, [[10, 8, 4, 4], [0, 8, 4, 4], [-2, 8, 4, 4], [-20, 8, 4, 4]])
    assert found["border"].tolist() == [2.0, 0.0, -0.5, -5.0]
    for name in ("blur", "brightness_change", "correlation", "clutter"):
        assert np.isnan(found[name][3]), name  # no pixel of it
    assert found["motion"][3] == pytest.approx(4.5)


def test_frames_without_the_target_have_nothing_and_those_after_them_no_motion():
    absent = [np.nan] * 4
    found = series(
        [textured(k) for k in range(7)],
        [absent, [4, 4, 8, 8], [5, 4, 8, 8], absent, [9, 4, 8, 8], [9, 4, 0, 8], [9, 4, 8, 8]],
        visibility=[0, 1, 0.5, 0, 1, 1, 1],
    )
    gone = [0, 3, 5]
    for name, values in found.items():
        assert np.isnan(values[gone]).all(), name
    assert np.isnan(found["motion"][[1, 4, 6]]).all()
    assert found["motion"][2] == pytest.approx(1 / 8)
    assert found["scale_change"][[1, 2, 4, 6]].tolist() == [0, 0, 0, 0]
    assert attributes.overall(found)["visibility"] == pytest.approx(3.5 / 4)


def test_one_frame_has_no_motion():
    overall = attributes.overall(series([textured(5)], [[4, 4, 8, 8]]))
    without = {name for name, value in overall.items() if math.isnan(value)}
    assert without == {"motion", "correlation", "visibility"}


def test_grey_pictures_have_all_that_coloured_ones_have():
    grey = textured(6)[..., :1].repeat(3, 2)
    found = series([grey, grey], [[4, 4, 8, 8]] * 2, visibility=[1, 1])
    assert all(np.isfinite(values[1]) for values in found.values())


def test_a_sequence_without_truth_says_what_to_do():
    with pytest.raises(SequenceError, match="there is no ground truth"):
        attributes.measure(Sequence("none", [textured(0)], fingerprint="none"))


class Counted(list):
    """Frames that count how often they are read."""

    reads = 0

    def __getitem__(self, frame):
        self.reads += 1
        return super().__getitem__(frame)


def test_they_are_measured_once_and_again_where_the_definitions_change(cache, monkeypatch):
    images = Counted([textured(k) for k in range(3)])
    one = Sequence("counted", images, [[4, 4, 8, 8]] * 3, fingerprint="counted")
    told = []
    first = attributes.measure(one, lambda done, total: told.append((done, total)))
    assert images.reads == 3
    assert told == [(1, 3), (2, 3), (3, 3)]
    again = attributes.measure(one)
    assert images.reads == 3
    for name, values in first.items():
        assert values.tobytes() == again[name].tobytes()
    monkeypatch.setattr(measuring, "_digest", lambda: "another")
    assert attributes.cached_values("counted") is None
    attributes.measure(one)
    assert images.reads == 6


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 torn", b"none of ours" * 9])
def test_what_is_damaged_on_disk_is_measured_anew(cache, content):
    one = sequence([textured(0)], [[4, 4, 8, 8]])
    there = attributes.measure(one)
    (file,) = (cache / "attributes").iterdir()
    file.write_bytes(content)
    assert attributes.cached_values(one.fingerprint) is None
    assert attributes.measure(one)["size"].tolist() == there["size"].tolist()
    assert attributes.cached_values(one.fingerprint) is not None


def test_a_cache_that_can_not_be_written_costs_time_alone(cache):
    (cache / "attributes").write_text("in the way")
    assert series([textured(0)], [[4, 4, 8, 8]])["size"].tolist() == [8.0]


def test_the_digest_is_of_the_definitions(tmp_path):
    import shutil
    from pathlib import Path

    from trackmark.datasets.source_digest import tree_digest

    here = Path(measuring.__file__).parent
    digests = []
    for change in ("", "LOW_PASS = 11\n"):
        folder = tmp_path / str(len(digests)) / "datasets" / "attributes"
        shutil.copytree(here, folder)
        (folder.parent / "__init__.py").touch()
        with (folder / "definitions.py").open("a") as file:
            file.write(change)
        digests.append(tree_digest(folder / "measuring.py", folder))
    assert digests[0] == measuring._digest()
    assert digests[1] != digests[0]


def test_an_unknown_name_is_told_with_those_there_are():
    with pytest.raises(ValueError, match="Did you mean 'motion'"):
        attributes.find("notion")


@pytest.mark.parametrize("name", ["plain/target:length=10", "samples/bow-tie"])
def test_they_are_there_for_synthetic_and_for_recorded_sequences(name):
    found = attributes.measure(datasets.load(name)[:6])
    for values in found.values():
        assert values.shape == (6,)
    finite = {key for key, values in found.items() if np.isfinite(values[1:]).all()}
    assert finite >= set(attributes.names()) - {"visibility"}


def test_each_has_a_definition_with_a_line_of_its_own():
    for name in attributes.names():
        one = attributes.find(name)
        first, _, rest = one.definition.partition("\n")
        assert first.endswith((".", ":"))
        assert not rest or rest.startswith("\n")
        assert one.least < one.most
