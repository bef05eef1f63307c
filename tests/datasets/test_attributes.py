"""Attributes of sequences: compared with slow definitions and with analytic values."""

import math
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from trackmark import datasets
from trackmark.datasets import Sequence, SequenceError, attributes
from trackmark.datasets.attributes import measuring
from trackmark.datasets.attributes.view import TargetView
from trackmark.datasets.source_digest import tree_digest

HEIGHT, WIDTH = 24, 30


def sequence(images, boxes, visibility=None, name="made"):
    content = b"".join(image.tobytes() for image in images) + np.asarray(boxes, float).tobytes()
    return Sequence(
        name, images, boxes, fingerprint=f"{name} {hash(content)}", visibility=visibility
    )


def measure(images, boxes, **options):
    return attributes.measure(sequence(images, boxes, **options))


def textured(seed, height=HEIGHT, width=WIDTH):
    generator = np.random.default_rng(seed)
    noise = generator.integers(0, 256, (height, width, 3)).astype(np.uint8)
    return cv2.GaussianBlur(noise, (0, 0), 1.0)


# Slow definitions of the attributes, pixel by pixel.


def pixels_in(image, box):
    x, y, w, h = box
    return [
        [(i, j) for j in range(image.shape[1]) if x <= j + 0.5 < x + w]
        for i in range(image.shape[0])
        if y <= i + 0.5 < y + h
    ]


def grey_of(image, box):
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    rows = [[float(grey[pixel]) for pixel in row] for row in pixels_in(image, box)]
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
    if now.previous is None:
        return math.nan
    (x, y, w, h), (u, v, p, q) = now.box, now.previous.box
    return math.dist((x + w / 2, y + h / 2), (u + p / 2, v + q / 2)) / math.sqrt(p * q)


def averaged(values):
    """Return means over 9 neighbours, mirrored at both ends."""
    n = len(values)

    def mirrored(i):
        while not 0 <= i < n:
            i = -i - 1 if i < 0 else 2 * n - i - 1
        return values[i]

    return [sum(mirrored(i + k) for k in range(-4, 5)) / 9 for i in range(n)]


def slow_blur(now):
    rows = grey_of(now.image, now.box)
    shares = []
    for lines in (rows, [list(column) for column in zip(*rows, strict=True)]):
        smooth = [averaged(line) for line in lines]

        def difference(picture, i, j):
            ahead, behind = (
                picture[i - 1][k] + 2 * picture[i][k] + picture[i + 1][k] for k in (j + 1, j - 1)
            )
            return abs(ahead - behind)

        before = after = 0.0
        for i in range(2, len(lines) - 1):
            for j in range(2, len(lines[0]) - 1):
                before += difference(lines, i, j)
                after += min(difference(lines, i, j), difference(smooth, i, j))
        if before > 0:
            shares.append(after / before)
    return max(shares, default=math.nan)


def mean_of(rows):
    values = [value for row in rows for value in row]
    return sum(values) / len(values) if values else math.nan


def slow_brightness_change(now):
    first = now.first or now
    return abs(mean_of(grey_of(now.image, now.box)) - mean_of(grey_of(first.image, first.box)))


def bilinear(rows, height, width):
    def value_at(line, position):
        position = min(max(position, 0.0), len(line) - 1.0)
        low = min(int(position), len(line) - 2) if len(line) > 1 else 0
        share = position - low
        high = min(low + 1, len(line) - 1)
        return line[low] * (1 - share) + line[high] * share

    across = [
        [value_at(row, (j + 0.5) * len(row) / width - 0.5) for j in range(width)] for row in rows
    ]
    columns = [list(column) for column in zip(*across, strict=True)]
    down = [
        [value_at(column, (i + 0.5) * len(rows) / height - 0.5) for i in range(height)]
        for column in columns
    ]
    return [list(row) for row in zip(*down, strict=True)]


def slow_correlation(now):
    if now.previous is None:
        return math.nan
    ends = []
    for axis, length in ((0, WIDTH), (1, HEIGHT)):
        parts = []
        for view in (now, now.previous):
            low, side = view.box[axis], view.box[axis + 2]
            parts.append(((max(low, 0.0) - low) / side, (min(low + side, length) - low) / side))
        ends.append((max(low for low, _ in parts), min(high for _, high in parts)))
    pictures = []
    for view in (now, now.previous):
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
            pixel: tuple(int(level) // 32 for level in now.image[pixel])
            for row in pixels_in(now.image, box)
            for pixel in row
        }

    x, y, w, h = now.box
    inside = colours(now.box)
    around = colours((x - w / 4, y - h / 4, 1.5 * w, 1.5 * h))
    outside = {pixel: colour for pixel, colour in around.items() if pixel not in inside}
    if not inside or not outside:
        return math.nan
    total = 0.0
    for colour in set(inside.values()):
        p = list(inside.values()).count(colour) / len(inside)
        q = list(outside.values()).count(colour) / len(outside)
        total += math.sqrt(p * q)
    return total


def slow_visibility(now):
    return now.visibility


def slow_border(now):
    x, y, w, h = now.box
    return min(x, y, WIDTH - x - w, HEIGHT - y - h) / slow_size(now)


SLOW = {
    name.removeprefix("slow_"): function
    for name, function in list(globals().items())
    if name.startswith("slow_")
}

boxes = st.tuples(
    st.integers(-40, 110), st.integers(-40, 90), st.integers(1, 60), st.integers(1, 60)
).map(lambda quarters: np.array(quarters) / 4)


@given(st.integers(0, 2**31), st.tuples(boxes, boxes, boxes), st.floats(0, 1))
@example(  # uniform except for the rounding of the resizing
    0, tuple(np.array(box) / 4 for box in ([0, 0, 1, 1], [0, 0, 3, 3], [0, 0, 3, 11])), 0.0
)
@settings(max_examples=60, deadline=None)
def test_attributes_equal_their_slow_definitions(seed, boxes_of_frames, visibility):
    assert set(SLOW) == set(attributes.names())
    images = [textured(seed + k) for k in range(3)]
    first = TargetView(images[0], boxes_of_frames[0], visibility)
    previous = TargetView(images[1], boxes_of_frames[1], visibility, first, first)
    for now in (
        first,
        previous,
        TargetView(images[2], boxes_of_frames[2], visibility, previous, first),
    ):
        for name, slow in SLOW.items():
            attribute = attributes.find(name)
            value = attribute.measure(now)
            tolerance = 1e-6 if name == "correlation" else 1e-9  # OpenCV resizes in float32
            assert value == pytest.approx(slow(now), abs=tolerance, nan_ok=True), name
            assert math.isnan(value) or attribute.minimum <= value <= attribute.maximum, name


@given(st.integers(0, 2**31), st.integers(1, 8), st.integers(1, 8))
@settings(max_examples=25, deadline=None)
def test_only_border_depends_on_the_position_in_the_image(seed, right, down):
    scene = textured(seed, 30, 40)
    boxes = [np.array([9.0, 8.0, 9.0, 7.0]), np.array([10.25, 8.5, 8.0, 8.0])]
    moved = [box + [right, down, 0, 0] for box in boxes]
    shifted = np.roll(scene, (down, right), (0, 1))
    values, moved_values = measure([scene] * 2, boxes), measure([shifted] * 2, moved)
    for name in set(attributes.names()) - {"border"}:
        assert moved_values[name] == pytest.approx(values[name], abs=1e-12, nan_ok=True), name


@given(st.integers(0, 2**31), st.sampled_from([1.25, 1.5, 2.0, 2.5]))
@settings(max_examples=15, deadline=None)
def test_scaled_image_changes_only_sizes(seed, grows):
    boxes = np.array([[4.0, 5.0, 8.0, 6.0], [6.0, 7.0, 8.0 * grows, 6.0]])
    image = textured(seed)
    large = image.repeat(2, axis=0).repeat(2, axis=1)
    values, doubled = measure([image] * 2, boxes), measure([large] * 2, 2 * boxes)
    assert doubled["size"] == pytest.approx(2 * values["size"])
    for name in ("scale_change", "aspect_change", "motion", "border", "brightness_change"):
        assert doubled[name] == pytest.approx(values[name], abs=1e-9, nan_ok=True), name


def test_growing_box_has_analytic_values():
    n = 8
    sides = 10 * 1.1 ** np.arange(n)
    boxes = np.stack([20 + np.arange(n), 30 * np.ones(n), sides, sides], axis=1)
    values = measure([textured(1, 100, 120)] * n, boxes)
    assert values["size"] == pytest.approx(sides)
    assert values["scale_change"] == pytest.approx(np.arange(n) * math.log2(1.1), abs=1e-12)
    assert values["aspect_change"] == pytest.approx(np.zeros(n), abs=1e-12)
    centres = boxes[:, :2] + sides[:, None] / 2
    steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    assert values["motion"][1:] == pytest.approx(steps / sides[:-1])
    assert np.isnan(values["motion"][0])
    overall = attributes.overall(values)
    assert overall["size"] == pytest.approx(sides.mean())
    assert overall["scale_change"] == pytest.approx(np.quantile(values["scale_change"], 0.95))


def detailed(seed, side=60):
    """Return an image with detail of all scales."""
    generator = np.random.default_rng(seed)
    image = np.zeros((side, side))
    for cells in (3, 6, 12, 24, 60):
        image += cv2.resize(generator.normal(size=(cells, cells)), (side, side))
    grey = np.clip(128 + 28 * image, 0, 255).astype(np.uint8)
    return np.stack([grey] * 3, axis=2)


def test_blur_grows_with_a_gaussian_and_not_with_darkness():
    sharp = detailed(0)
    deviations = (0.5, 1.0, 2.0, 4.0, 8.0)
    images = [sharp, *(cv2.GaussianBlur(sharp, (0, 0), deviation) for deviation in deviations)]
    values = measure(images, [[10, 10, 40, 40]] * len(images))["blur"]
    assert (np.diff(values) > 0).all()
    assert values[-1] - values[0] > 0.4
    dimmed = measure([sharp, sharp // 2], [[10, 10, 40, 40]] * 2)["blur"]
    assert dimmed[1] == pytest.approx(dimmed[0], abs=0.02)


@pytest.mark.parametrize("deviation", [0.4, 1.5, 6.0])
def test_blur_equals_that_of_scikit_image(deviation):
    from skimage.measure import blur_effect

    image = cv2.GaussianBlur(detailed(1), (0, 0), deviation)
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    values = measure([image], [[0, 0, 60, 60]])["blur"]
    assert values[0] == pytest.approx(blur_effect(grey, h_size=9), abs=1e-9)


def test_uniform_images_have_brightness_and_no_texture():
    images = [np.full((20, 20, 3), level, np.uint8) for level in (100, 120, 80, 100)]
    values = measure(images, [[2, 2, 10, 10]] * 4)
    assert values["brightness_change"].tolist() == [0, 20, 20, 0]
    assert np.isnan(values["blur"]).all()
    assert np.isnan(values["correlation"]).all()
    assert values["clutter"] == pytest.approx(np.ones(4))


def test_clutter_is_the_common_share_of_colours():
    images = np.zeros((3, 40, 40, 3), np.uint8)
    images[0, 10:20, 10:20] = 255  # another colour than the surround
    images[1, :, ::2] = 255  # the same stripes everywhere
    images[2, 10:20, 10:15] = 255  # half of the target is as the surround: √(1/2 · 1)
    values = measure(list(images), [[10, 10, 10, 10]] * 3)["clutter"]
    assert values == pytest.approx([0.0, 1.0, math.sqrt(0.5)], abs=5e-3)


def test_correlation_of_an_image_and_its_negative():
    image = textured(3)
    values = measure([image, image, 255 - image], [[5, 5, 12, 9]] * 3)["correlation"]
    assert np.isnan(values[0])
    assert values[1] == pytest.approx(1.0)
    assert values[2] == pytest.approx(-1.0, abs=0.01)  # grey levels are rounded


def test_box_outside_the_image_has_only_geometric_values():
    boxes = [[10, 8, 4, 4], [0, 8, 4, 4], [-2, 8, 4, 4], [-20, 8, 4, 4]]
    values = measure([textured(4)] * 4, boxes)
    assert values["border"].tolist() == [2.0, 0.0, -0.5, -5.0]
    for name in ("blur", "brightness_change", "correlation", "clutter"):
        assert np.isnan(values[name][3]), name
    assert values["motion"][3] == pytest.approx(4.5)


def test_frames_without_target_have_no_values():
    absent = [np.nan] * 4
    values = measure(
        [textured(k) for k in range(7)],
        [absent, [4, 4, 8, 8], [5, 4, 8, 8], absent, [9, 4, 8, 8], [9, 4, 0, 8], [9, 4, 8, 8]],
        visibility=[0, 1, 0.5, 0, 1, 1, 1],
    )
    for name, series in values.items():
        assert np.isnan(series[[0, 3, 5]]).all(), name
    assert np.isnan(values["motion"][[1, 4, 6]]).all()
    assert values["motion"][2] == pytest.approx(1 / 8)
    assert values["scale_change"][[1, 2, 4, 6]].tolist() == [0, 0, 0, 0]
    assert attributes.overall(values)["visibility"] == pytest.approx(3.5 / 4)
    single = attributes.overall(measure([textured(5)], [[4, 4, 8, 8]]))
    undefined = {name for name, value in single.items() if math.isnan(value)}
    assert undefined == {"motion", "correlation", "visibility"}


def test_sequence_without_ground_truth_is_refused():
    with pytest.raises(SequenceError, match="there is no ground truth"):
        attributes.measure(Sequence("none", [textured(0)], fingerprint="none"))


class CountedFrames(list):
    """Frames that count how often they are read."""

    reads = 0

    def __getitem__(self, frame):
        self.reads += 1
        return super().__getitem__(frame)


def test_measured_values_are_cached_until_definitions_change(monkeypatch):
    images = CountedFrames([textured(k) for k in range(3)])
    counted = Sequence("counted", images, [[4, 4, 8, 8]] * 3, fingerprint="counted")
    progress = []
    first = attributes.measure(counted, lambda done, total: progress.append((done, total)))
    assert images.reads == 3
    assert progress == [(1, 3), (2, 3), (3, 3)]
    second = attributes.measure(counted)
    assert images.reads == 3
    assert all(values.tobytes() == second[name].tobytes() for name, values in first.items())
    monkeypatch.setattr(measuring, "_digest", lambda: "another")
    assert attributes.cached_values("counted") is None
    attributes.measure(counted)
    assert images.reads == 6


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 truncated", b"another format" * 9])
def test_damaged_cache_is_replaced(cache, content):
    recording = sequence([textured(0)], [[4, 4, 8, 8]])
    expected = attributes.measure(recording)["size"].tolist()
    (file,) = (cache / "attributes").iterdir()
    file.write_bytes(content)
    assert attributes.cached_values(recording.fingerprint) is None
    assert attributes.measure(recording)["size"].tolist() == expected
    assert attributes.cached_values(recording.fingerprint) is not None


def test_measuring_does_not_need_a_writable_cache(cache):
    (cache / "attributes").write_text("a file instead of the folder")
    assert measure([textured(0)], [[4, 4, 8, 8]])["size"].tolist() == [8.0]


def test_cache_digest_depends_on_the_definitions(tmp_path):
    source = Path(measuring.__file__).parent
    digests = []
    for change in ("", "BLUR_PIXELS = 11\n"):
        folder = tmp_path / str(len(digests)) / "datasets" / "attributes"
        shutil.copytree(source, folder)
        (folder.parent / "__init__.py").touch()
        with (folder / "definitions.py").open("a") as file:
            file.write(change)
        digests.append(tree_digest(folder / "measuring.py", folder))
    assert digests[0] == measuring._digest()
    assert digests[1] != digests[0]


@pytest.mark.parametrize("name", ["plain/target:length=10", "samples/bow-tie"])
def test_attributes_of_synthetic_and_recorded_sequences(name):
    values = attributes.measure(datasets.load(name)[:6])
    assert all(series.shape == (6,) for series in values.values())
    finite = {key for key, series in values.items() if np.isfinite(series[1:]).all()}
    assert finite >= set(attributes.names()) - {"visibility"}


def test_definitions_start_with_a_summary_line():
    for name in attributes.names():
        attribute = attributes.find(name)
        first, _, rest = attribute.definition.partition("\n")
        assert first.endswith((".", ":"))
        assert not rest or rest.startswith("\n")
    with pytest.raises(ValueError, match="Did you mean 'motion'"):
        attributes.find("notion")
