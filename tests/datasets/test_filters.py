"""Filters of synthetic and recorded sequences."""

import cv2
import numpy as np
import pytest

from trackmark import datasets
from trackmark.datasets import Sequence, SequenceError
from trackmark.datasets.filters import FILTERS, filtered

SCENE = "plain/target:length=60:width=160:height=120:scene=3"
FACE = "samples/face"
MASKED = "moreno2005/ellipse"


def load_filtered(text, *filters):
    return datasets.load(":".join([text, *(f"filter.{value}" for value in filters)]))


def test_sequences_without_filters_have_fixed_fingerprints():
    assert datasets.load(SCENE).fingerprint == "f22626a6f07e940b"
    assert datasets.load(FACE).fingerprint.startswith("04c63a9b6ad0a48b")


@pytest.mark.parametrize(("text", "name"), [*((SCENE, name) for name in FILTERS), (FACE, "motion")])
def test_filtered_sequence_has_its_own_identity(text, name):
    plain = datasets.load(text)
    hard = FILTERS[name].hard if name != "occlusion" else 20
    changed = load_filtered(text, f"{name}={hard}")
    assert changed.name == f"{plain.name}:filter.{name}={hard}"
    others = {load_filtered(text, f"{name}={FILTERS[name].easy}").fingerprint}
    others |= {plain.fingerprint, load_filtered(text, f"{name}={hard}", "draw=1").fingerprint}
    assert len({changed.fingerprint, *others}) == 4
    assert load_filtered(text, f"{name}={hard}").fingerprint == changed.fingerprint
    changed.check_runnable()
    assert len(changed) == len(plain) - (name == "start")
    for frame in (0, 30, len(changed) - 1):
        assert changed[frame].dtype == np.uint8
        assert changed[frame].shape[1::-1] == changed.image_size
        np.testing.assert_array_equal(changed[frame], changed[frame])


@pytest.mark.parametrize(
    "name", ["step=1", "motion=0", "occlusion=0", "gain=1", "blur=0", "noise=0", "box_error=0"]
)
def test_easiest_value_changes_nothing(name):
    plain, changed = datasets.load(SCENE), load_filtered(SCENE, name)
    np.testing.assert_array_equal(changed.boxes, plain.boxes)
    for frame in (0, 20, 59):
        np.testing.assert_array_equal(changed[frame], plain[frame])
        np.testing.assert_array_equal(changed.mask(frame), plain.mask(frame))


def test_noise_of_two_levels_is_proportional():
    plain = datasets.load(FACE)[4].astype(float)
    weak, strong = (load_filtered(FACE, f"noise={sd}", "draw=5")[4] - plain for sd in (4, 8))
    inside = (plain > 60) & (plain < 180)
    assert np.corrcoef(weak[inside], strong[inside])[0, 1] > 0.98
    assert strong[inside].std() == pytest.approx(8, rel=0.03)


def test_gain_fades_geometrically_and_stays():
    plain, changed = datasets.load(FACE), load_filtered(FACE, "gain=0.25")
    shares = [changed[frame].mean() / plain[frame].mean() for frame in (0, 30, 60, 119)]
    assert shares == pytest.approx([1, 0.5, 0.25, 0.25], rel=0.02)


def test_step_shows_frames_forwards_and_backwards():
    plain, changed = datasets.load(SCENE), load_filtered(SCENE, "step=25")
    frames = [0, 25, 50, 25, 0, 25]
    np.testing.assert_array_equal(changed.boxes[:6], plain.boxes[frames])
    np.testing.assert_array_equal(changed[3], plain[25])
    np.testing.assert_array_equal(changed.mask(2), plain.mask(50))
    assert len(changed) == 60


@pytest.mark.parametrize("text", [SCENE, FACE])
def test_size_sets_the_size_of_the_target(text):
    changed = load_filtered(text, "size=12")
    assert np.sqrt(np.prod(changed.boxes[0, 2:])) == pytest.approx(12, rel=0.03)


@pytest.mark.parametrize(
    "filters", ["size=30", "motion=0.7", "size=20:filter.motion=0.7", "start=9"]
)
def test_boxes_enclose_the_changed_masks(filters):
    changed = load_filtered(MASKED, filters)
    for frame in (0, 7, 20):
        box = np.array(cv2.boundingRect(changed.mask(frame).view(np.uint8)), float)
        np.testing.assert_allclose(box, changed.boxes[frame], atol=1.6)


def test_motion_shifts_images_by_a_constant_distance():
    plain, changed = datasets.load(SCENE), load_filtered(SCENE, "motion=0.5")
    offsets = (changed.boxes - plain.boxes)[:, :2]
    lengths = np.hypot(*np.diff(offsets, axis=0).T)
    width = plain.boxes[0, 2]
    np.testing.assert_allclose(lengths, 0.5 * width, atol=1.5)
    assert not offsets[0].any()
    assert np.hypot(*offsets.T).max() <= 1.5 * width + 1
    centres = changed.boxes[:, :2] + changed.boxes[:, 2:] / 2
    assert ((centres >= -1) & (centres <= np.array(plain.image_size) + 1)).all()


def test_occlusion_covers_the_target_and_sets_visibility():
    plain, changed = datasets.load(SCENE), load_filtered(SCENE, "occlusion=20")
    hidden = changed.visibility == 0
    assert np.flatnonzero(hidden).tolist() == list(range(10, 30))
    np.testing.assert_array_equal(changed.boxes, plain.boxes)
    x, y, width, height = plain.boxes[20].astype(int)
    assert np.ptp(changed[20][y : y + height, x : x + width].reshape(-1, 3), axis=0).max() == 0
    np.testing.assert_array_equal(changed[30], plain[30])
    assert not changed.mask(20).any()
    assert changed.attributes["occlusion"][hidden].all()


def test_filters_keep_which_frames_are_annotated():
    scene = datasets.load(SCENE)
    annotated = np.arange(60) % 3 == 0
    sparse = Sequence("sparse", scene.frames, scene.boxes, annotated=annotated, fingerprint="")
    assert filtered(sparse, {"noise": 5}).annotated.tolist() == annotated.tolist()
    assert filtered(sparse, {"start": 4}).annotated.tolist() == annotated[4:].tolist()
    changed = filtered(sparse, {"step": 2, "motion": 0.1})
    assert changed.annotated[:30].tolist() == annotated[::2].tolist()
    np.testing.assert_array_equal(changed.present, changed.annotated)


def test_box_error_shifts_only_the_init_box():
    scene = datasets.load(SCENE)
    regions = {"full": scene.boxes + [0, 0, 3, 4]}
    plain = Sequence("both", scene.frames, scene.boxes, regions=regions, fingerprint="")
    changed = filtered(plain, {"box_error": 0.5})
    shift = (changed.boxes - plain.boxes)[0]
    assert np.hypot(*(shift[:2] / plain.boxes[0, 2:])) == pytest.approx(0.5)
    assert not shift[2:].any()
    np.testing.assert_array_equal(changed.boxes[1:], plain.boxes[1:])
    np.testing.assert_allclose((changed.regions["full"] - plain.regions["full"])[0], shift)


def test_order_of_filters_in_the_text_does_not_matter():
    first = load_filtered(SCENE, "noise=5", "step=2")
    second = datasets.load(
        "plain/target:filter.step=2.0:scene=3:filter.noise=5:height=120:length=60:width=160"
    )
    assert (first.name, first.fingerprint) == (second.name, second.fingerprint)
    assert datasets.matching("samples/*:filter.noise=5") == [
        "samples/bow-tie:filter.noise=5",
        "samples/face:filter.noise=5",
    ]


@pytest.mark.parametrize(
    ("filters", "message"),
    [
        ("filter.nois=3", "Did you mean 'noise'"),
        ("filter.noise=loud", "Expected: a number from 0 to 255"),
        ("filter.noise=nan", "Expected: a number from 0 to 255"),
        ("filter.step=1.5", "Expected: an integer"),
        ("filter.noise=1:filter.noise=2", "given twice"),
        ("filter.occlusion=50", "for 60 frames. Use at most 35"),
        ("filter.start=50", "At least 20 must be left"),
        ("filter.step=100", "only the first of 60 frames"),
    ],
)
def test_invalid_filter_is_refused(filters, message):
    with pytest.raises(SequenceError, match=message) as error:
        datasets.load(f"{SCENE}:{filters}")
    assert "\n" not in str(error.value)


def test_existing_path_has_priority_over_a_filter(tmp_path, write_images):
    folder = tmp_path / "take:filter.noise=9"
    write_images(folder, ["1.png", "2.png"])
    assert datasets.load(folder).name == "take:filter.noise=9"
    write_images(tmp_path / "take", ["1.png", "2.png"])
    noisy = datasets.load(tmp_path / "take:filter.noise=8")
    assert (noisy[0] != datasets.load(tmp_path / "take")[0]).any()
