"""OpenCV's trackers."""

import ctypes
import typing
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.trackers.tiny_models import write_models
from trackmark import trackers
from trackmark.trackers.base.opencv import OpenCVTracker, find_factory, pixel_rectangle
from trackmark.trackers.base.parameters import Parameters, TrackerError


def boxes_of(tracker, clip):
    tracker.init(clip.images[0], clip.boxes[0])
    return np.array([tracker.update(image).box for image in clip.images[1:]])


def usable(name):
    try:
        return trackers.resolve(name)
    except TrackerError as error:
        pytest.skip(str(error))


class Scripted(OpenCVTracker):
    """OpenCV tracker that returns the given results."""

    def _make(self):
        return self.script


def scripted(*results):
    class Script:
        def init(self, image, rectangle):
            self.rectangle = rectangle
            self.left = list(results)

        def update(self, image):
            return self.left.pop(0)

    tracker = Scripted(Parameters(), np.random.SeedSequence(0))
    tracker.script = Script()
    return tracker


IMAGE = np.zeros((60, 80, 3), np.uint8)


@pytest.mark.parametrize(
    "result",
    [(False, (0, 0, 0, 0)), (False, (9, 9, 9, 9)), (True, (5, 5, 0, 7)), (True, (5, 5, 7, -1))]
    + [(True, (np.nan, 5, 7, 7)), (True, (5, np.inf, 7, 7))],
)
def test_lost_target_keeps_the_last_valid_box(result):
    tracker = scripted(result, (True, (4.5, 4, 4, 4.25)), result, result)
    first = np.array([1.5, 2.5, 10.25, 10.0])
    tracker.init(IMAGE, first)
    first[:] = -1  # must not change the tracker's box
    lost = tracker.update(IMAGE)
    assert lost.box.tolist() == [1.5, 2.5, 10.25, 10.0]
    assert not lost.visible
    actual = tracker.update(IMAGE)
    assert actual.visible
    assert actual.box.tolist() == [4.5, 4, 4, 4.25]
    for _ in range(2):
        lost = tracker.update(IMAGE)
        assert lost.box.tolist() == [4.5, 4, 4, 4.25]
        assert not lost.visible
        lost.box[:] = -1  # must not change the tracker's box


@pytest.mark.parametrize(
    ("box", "expected"),
    [
        ((3, 4, 5, 6), (3, 4, 5, 6)),
        ((3.4, 4.6, 5, 6), (3, 5, 5, 6)),
        ((-5, -5, 20, 20), (0, 0, 15, 15)),
        ((70, 50, 20, 20), (70, 50, 10, 10)),
        ((79.8, 59.9, 0.1, 0.1), (79, 59, 1, 1)),
    ],
)
def test_pixel_rectangle_is_rounded_and_clipped(box, expected):
    assert pixel_rectangle(np.array(box, float), IMAGE) == expected


def test_target_too_small_for_opencv_is_rejected():
    # OpenCV's own init would never return.
    tracker = trackers.create("opencv-mil")
    with pytest.raises(TrackerError, match="MIL needs an init box with at least 5 x 5 pixels"):
        tracker.init(IMAGE, np.array([10.0, 10.0, 30.0, 4.0]))


def test_init_box_that_opencv_refuses_is_rejected(moving_target):
    clip = moving_target(size=(120, 90), start=(0, 0), velocity=(0, 0))
    with pytest.raises(TrackerError, match=r"MIL rejects the init box \(0, 0, 120, 90\)"):
        trackers.create("opencv-mil").init(clip.images[0], clip.boxes[0])


def test_missing_opencv_tracker_error_has_a_remedy():
    with pytest.raises(ImportError, match="has no TrackerOfTheFuture; run `pip install"):
        find_factory("OfTheFuture")


@pytest.mark.parametrize("name", ["opencv-mil", "opencv-tld", "opencv-boosting"])
def test_opencv_result_depends_on_the_seed_alone(name, moving_target):
    specification = usable(name)
    assert specification.randomness is trackers.Randomness.PROCESS
    # Fast motion: on an easy clip, all seeds of Boosting give the same boxes.
    clip = moving_target(7, 140, 200, velocity=(10, 5), seed=4)
    actual = boxes_of(specification.create(1), clip)
    ctypes.CDLL(None).srand(99)
    cv2.setRNGSeed(99)
    np.testing.assert_array_equal(boxes_of(specification.create(1), clip), actual)
    others = (boxes_of(specification.create(seed), clip) for seed in range(2, 8))
    assert any((other != actual).any() for other in others)


def another(value, annotation):
    """Return another valid value of a parameter."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return next(other for other in typing.get_args(annotation) if other != value)
    if isinstance(value, int):
        return value + 1 if value <= 3 else value - 1
    return value * 1.01 if value > 1 else value / 2


def changed_alone(name):
    """Yield the tracker with default values, and with each parameter changed alone."""
    plugin = usable(name).plugin
    yield "", trackers.create(name)
    for field, about in plugin.Parameters.model_fields.items():
        yield field, trackers.create(name, **{field: another(about.default, about.annotation)})


@pytest.mark.parametrize("name", ["opencv-mil", "opencv-kcf", "opencv-csrt"])
def test_opencv_parameters_and_defaults_are_passed_on(name, monkeypatch):
    plugin = usable(name).plugin
    passed_options = []
    monkeypatch.setattr(plugin, "create_tracker", passed_options.append)
    fields = [field for field, tracker in changed_alone(name) if tracker._make() is None]
    kind = getattr(cv2, plugin.opencv_parameters)
    option_names = [key for key in dir(kind) if not key.startswith("_")]
    assert len(option_names) == len(fields) - 1
    values = [
        {key: getattr(options, key) for key in option_names}
        for options in (kind(), *passed_options)
    ]
    defaults, ours, *others = values
    assert ours == defaults
    changed = [{key for key in option_names if other[key] != ours[key]} for other in others]
    assert all(len(keys) == 1 for keys in changed)
    assert set.union(*changed) == set(option_names)


def written(tracker):
    """Return the parameters that a tracker of `cv2.legacy` writes, by OpenCV's names."""
    storage = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    tracker.write(storage)
    lines = storage.releaseAndGetString().splitlines()
    return dict(line.split(": ") for line in lines if ": " in line)


@pytest.mark.parametrize("name", ["opencv-median-flow", "opencv-boosting"])
def test_legacy_parameters_and_defaults_are_passed_on(name):
    plugin = usable(name).plugin
    (_, ours), *others = (
        (field, written(changed._make())) for field, changed in changed_alone(name)
    )
    assert ours == written(plugin.create_tracker())
    for field, other in others:
        changed = {key.lower() for key in other if other[key] != ours[key]}
        assert len({key.removeprefix("sampler") for key in changed}) == 1, field


@pytest.mark.parametrize(
    ("name", "threshold"), [("opencv-kcf", "detect_thresh"), ("opencv-csrt", "psr_threshold")]
)
def test_opencv_threshold_decides_visibility(name, threshold, moving_target):
    usable(name)
    presets = [trackers.resolve(name, preset=key).parameters for key in ("opencv", "recommended")]
    assert trackers.resolve(name).parameters == presets[0]
    other = {key for key, value in presets[0] if value != getattr(presets[1], key)}
    assert other == {threshold}
    assert getattr(presets[1], threshold) == 0
    clip = moving_target(4)
    for value, expected in ((0, True), (100, False)):
        tracker = trackers.create(name, **{threshold: value})
        tracker.init(clip.images[0], clip.boxes[0])
        visible = [tracker.update(image).visible for image in clip.images[1:]]
        assert set(visible[1:]) == {expected}  # KCF does not search in its first update


def test_missing_opencv_parameter_is_rejected(monkeypatch):
    monkeypatch.setattr(cv2, "TrackerMIL_Params", object)
    with pytest.raises(
        TrackerError, match=r"has no parameter sampler.* TrackerMIL_Params. Install a newer"
    ):
        trackers.create("opencv-mil")._make()


def test_csrt_without_features_is_rejected():
    usable("opencv-csrt")  # OpenCV would abort the process
    off = dict.fromkeys(["use_hog", "use_color_names", "use_gray", "use_rgb"], False)
    with pytest.raises(TrackerError, match="opencv-csrt needs features"):
        trackers.create("opencv-csrt", **off).init(IMAGE, np.array([10.0, 10, 20, 20]))


RED, GREEN = (20, 72, 200), (60, 180, 40)
CAMSHIFT_BOX = np.array([30.0, 20, 18, 24])


def image_with(x, y, colour=RED):
    image = np.full((90, 120, 3), GREEN, np.uint8)
    image[y : y + 24, x : x + 18] = colour
    return image


def test_opencv_camshift_equals_the_opencv_function():
    noise = np.random.default_rng(0).normal(0, 20, (6, 90, 120, 3))
    images = [
        np.clip(image_with(30 + 2 * i, 20) + noise[i], 0, 255).astype(np.uint8) for i in range(6)
    ]
    tracker = trackers.create("opencv-camshift", hue_bins=20, minimum_saturation=0.3)
    tracker.init(images[0], CAMSHIFT_BOX)
    hsv = cv2.cvtColor(images[0], cv2.COLOR_BGR2HSV)[20:44, 30:48]
    counts = np.bincount(hsv[hsv[..., 1] >= 77][:, 0] // 9, minlength=20)
    window = (30, 20, 18, 24)
    for image in images[1:]:
        hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
        weights = np.rint(255 * counts / counts.max())[hsv[..., 0] // 9]
        weights[hsv[..., 1] < 77] = 0
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 10, 2)
        _, window = cv2.CamShift(weights.astype(np.uint8), window, stop)
        assert tracker.update(image).box.tolist() == list(window)


def test_opencv_camshift_reports_an_absent_target():
    tracker = trackers.create("opencv-camshift")
    tracker.init(image_with(30, 20), CAMSHIFT_BOX)
    estimate = tracker.update(image_with(0, 0, GREEN))
    assert not estimate.visible
    assert estimate.box.tolist() == CAMSHIFT_BOX.tolist()
    for limits in ({"minimum_value": 0.9}, {"maximum_value": 0.5}):
        tracker = trackers.create("opencv-camshift", **limits)
        with pytest.raises(TrackerError, match="opencv-camshift: no pixel of the box"):
            tracker.init(image_with(30, 20), CAMSHIFT_BOX)


KINDS = {
    "opencv-dasiamrpn": ["model", "kernel_cls1", "kernel_r1"],
    "opencv-goturn": ["network", "weights"],
    "opencv-nano": ["backbone", "neckhead"],
    "opencv-vit": ["net"],
}


@pytest.fixture(scope="module", name="models")
def _models(tmp_path_factory):
    return write_models(tmp_path_factory.mktemp("models"))


def refused(name, **parameters):
    """Return the error message; skip if this OpenCV lacks the tracker."""
    with pytest.raises(TrackerError) as caught:
        trackers.resolve(name, **parameters)
    if isinstance(caught.value.__cause__, ImportError):
        pytest.skip(str(caught.value))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", KINDS)
def test_missing_model_error_names_its_source(name, tmp_path):
    first, *rest = KINDS[name]
    message = refused(name)
    assert message.startswith(
        f"{name}: the parameter {first} is missing. Set it by {name}:{first}=PATH"
    )
    assert "trackmark" in message
    existing_file = tmp_path / "there.onnx"
    existing_file.write_bytes(b"a model")
    gone = tmp_path / "gone.onnx"
    for parameter in KINDS[name]:
        files = {key: str(gone if key == parameter else existing_file) for key in (first, *rest)}
        message = refused(name, **files)
        assert f"{name}: parameter {parameter}={gone}: the file cannot be read (No such" in message
        assert "Expected: " in message
    message = refused(name, **dict.fromkeys(KINDS[name], str(tmp_path)))
    assert "(Is a directory)" in message


@pytest.mark.parametrize("name", KINDS)
def test_describe_lists_model_files_without_having_any(name):
    try:
        about = trackers.describe(name)["parameters"]
    except TrackerError as error:
        pytest.skip(str(error))
    assert [part["name"] for part in about][: len(KINDS[name])] == KINDS[name]
    assert {part["default"] for part in about if part["type"] == "ModelFile"} == {""}


@pytest.mark.parametrize("content", [b"", b"no model" * 50, None], ids=["empty", "words", "half"])
@pytest.mark.parametrize("name", ["opencv-nano", "opencv-vit"])
def test_unloadable_model_error_names_the_files(name, content, models, tmp_path, moving_target):
    files = dict(models[name])
    last = KINDS[name][-1]
    broken = tmp_path / "broken.onnx"
    whole = Path(files[last]).read_bytes()
    broken.write_bytes(whole[: len(whole) // 2] if content is None else content)
    files[last] = str(broken)
    clip = moving_target(2)
    with pytest.raises(
        TrackerError, match=f"cannot use the models of .*{last}={broken}: "
    ) as caught:
        trackers.create(name, **files).init(clip.images[0], clip.boxes[0])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "parameter", "kind"),
    [("opencv-nano", "backbone", "net"), ("opencv-vit", "net", "neckhead")],
)
def test_model_of_another_tracker_is_rejected_by_name(name, parameter, kind, models, moving_target):
    all_files = {key: file for files in models.values() for key, file in files.items()}
    files = models[name] | {parameter: all_files[kind]}
    clip = moving_target(3)
    tracker = trackers.create(name, **files)
    with pytest.raises(TrackerError, match=f"models .*{parameter}={all_files[kind]}") as caught:
        boxes_of(tracker, clip)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["opencv-nano", "opencv-vit"])
def test_model_trackers_follow_their_models(name, models, moving_target):
    clip = moving_target(10, 140, 200, velocity=(6, 3))
    tracker = trackers.create(name, **models[name])
    tracker.init(clip.images[0], clip.boxes[0])
    actual = [tracker.update(image) for image in clip.images[1:]]
    assert all(estimate.visible and 0 < estimate.confidence < 1 for estimate in actual)
    centres = np.array([estimate.box[:2] + estimate.box[2:] / 2 for estimate in actual])
    true = clip.boxes[1:, :2] + clip.boxes[1:, 2:] / 2
    # The target moved by 57 pixels; the models' cells are some pixels wide.
    assert np.abs(centres - true).max() < 25


def test_target_of_low_score_is_not_visible(models, moving_target):
    clip = moving_target(3)
    tracker = trackers.create("opencv-vit", tracking_score_threshold=1, **models["opencv-vit"])
    tracker.init(clip.images[0], clip.boxes[0])
    estimate = tracker.update(clip.images[1])
    assert not estimate.visible
    assert estimate.box.tolist() == clip.boxes[0].tolist()
