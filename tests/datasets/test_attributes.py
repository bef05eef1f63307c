"""Attributes of sequences, compared with slow definitions."""

import math
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates
from skimage.filters import sobel
from skimage.measure import blur_effect

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


def pixels_in(image, box):
    """Return the pixels with centres inside a box, shape (rows, columns, ...)."""
    x, y, w, h = box
    rows, columns = (np.arange(n) + 0.5 for n in image.shape[:2])
    return image[(rows >= y) & (rows < y + h)][:, (columns >= x) & (columns < x + w)]


def grey_of(image, box):
    return pixels_in(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), box).astype(float)


def slow_size(view):
    return math.sqrt(view.box[2] * view.box[3])


def slow_scale_change(view):
    first = view.first or view
    return abs(math.log(slow_size(view) / slow_size(first)) / math.log(2))


def slow_aspect_change(view):
    (_, _, w, h), (_, _, first_w, first_h) = view.box, (view.first or view).box
    return abs(math.log((w / h) / (first_w / first_h)) / math.log(2))


def slow_motion(view):
    if view.previous is None:
        return math.nan
    (x, y, w, h), (u, v, p, q) = view.box, view.previous.box
    return math.dist((x + w / 2, y + h / 2), (u + p / 2, v + q / 2)) / math.sqrt(p * q)


def slow_blur(view):
    grey = grey_of(view.image, view.box)
    if min(grey.shape) < 4:
        return math.nan
    differences = [np.abs(sobel(grey, axis=axis)[2:-1, 2:-1]).sum() for axis in (0, 1)]
    # Without differences along one axis only, scikit-image divides rounding errors by each other.
    assume(min(differences) > 1e-9 or max(differences) < 1e-9)
    with np.errstate(invalid="ignore"):  # 0 / 0 in uniform boxes
        return blur_effect(grey, h_size=9)


def slow_brightness_change(view):
    grey, first = (grey_of(each.image, each.box) for each in (view, view.first or view))
    return abs(grey.mean() - first.mean()) if grey.size and first.size else math.nan


def slow_correlation(view):
    """Correlate the common part of both boxes; the earlier one is resampled bilinearly."""
    if view.previous is None:
        return math.nan
    boxes = np.array([view.box, view.previous.box])
    inner = np.clip(0 - boxes[:, :2], 0, None) / boxes[:, 2:]
    outer = (np.minimum(boxes[:, :2] + boxes[:, 2:], [WIDTH, HEIGHT]) - boxes[:, :2]) / boxes[:, 2:]
    low, high = inner.max(axis=0), outer.min(axis=0)
    later, earlier = (
        grey_of(each.image, [*(box[:2] + low * box[2:]), *((high - low) * box[2:])])
        for each, box in zip((view, view.previous), boxes, strict=True)
    )
    if not (later.size and earlier.size):
        return math.nan
    ratios = np.array(earlier.shape) / later.shape
    places = np.indices(later.shape) * ratios[:, None, None] + (ratios / 2 - 0.5)[:, None, None]
    earlier = map_coordinates(earlier, places, order=1, mode="nearest")
    deviations = [values - values.mean() for values in (later, earlier)]
    norm = math.sqrt(np.prod([np.square(values).sum() for values in deviations]))
    return (deviations[0] * deviations[1]).sum() / norm if norm > 1e-9 else math.nan


def slow_clutter(view):
    x, y, w, h = view.box
    colours = view.image // 32 @ np.array([64, 8, 1])
    inside = np.bincount(pixels_in(colours, view.box).ravel(), minlength=512)
    around = pixels_in(colours, (x - w / 4, y - h / 4, 1.5 * w, 1.5 * h))
    outside = np.bincount(around.ravel(), minlength=512) - inside
    if not inside.any() or not outside.any():
        return math.nan
    return np.sqrt(inside / inside.sum() * outside / outside.sum()).sum()


def slow_visibility(view):
    return view.visibility


def slow_border(view):
    x, y, w, h = view.box
    return min(x, y, WIDTH - x - w, HEIGHT - y - h) / slow_size(view)


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
    assert set(SLOW) == set(attributes.ATTRIBUTES)
    images = [textured(seed + k) for k in range(3)]
    first = TargetView(images[0], boxes_of_frames[0], visibility)
    previous = TargetView(images[1], boxes_of_frames[1], visibility, first, first)
    for view in (
        first,
        previous,
        TargetView(images[2], boxes_of_frames[2], visibility, previous, first),
    ):
        for name, slow in SLOW.items():
            attribute = attributes.ATTRIBUTES[name]
            value = attribute.measure(view)
            # OpenCV resizes in float32, whose rounding is up to 1.5e-5 grey levels.
            tolerance = 1e-5 if name == "correlation" else 1e-9
            assert value == pytest.approx(slow(view), abs=tolerance, nan_ok=True), name
            assert math.isnan(value) or attribute.minimum <= value <= attribute.maximum, name


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
    overall = attributes.overall(values)
    assert overall["visibility"] == pytest.approx(3.5 / 4)
    changes = values["brightness_change"][[1, 2, 4, 6]]
    assert overall["brightness_change"] == pytest.approx(np.quantile(changes, 0.95))
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
def test_synthetic_and_recorded_sequences_are_measured(name):
    values = attributes.measure(datasets.load(name)[:6])
    assert all(series.shape == (6,) for series in values.values())
    finite = {key for key, series in values.items() if np.isfinite(series[1:]).all()}
    assert finite >= set(attributes.ATTRIBUTES) - {"visibility"}


def test_definitions_start_with_a_summary_line():
    for attribute in attributes.ATTRIBUTES.values():
        first, _, rest = attribute.definition.partition("\n")
        assert first.endswith((".", ":"))
        assert not rest or rest.startswith("\n")
