"""OpenCV's trackers that need trained models, with tiny models that follow what is bright."""

from pathlib import Path

import numpy as np
import pytest

from tests.trackers.tiny_models import write_models
from trackmark import trackers
from trackmark.trackers.base.parameters import TrackerError

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
    """Message for a tracker that OpenCV lacks; GOTURN is not in every version."""
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
    assert "trackmark" in message  # which has none
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
def test_describe_names_the_files_without_having_any(name):
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
def test_a_model_of_another_tracker_is_one_line_that_names_it(
    name, parameter, kind, models, moving_target
):
    everything = {key: file for files in models.values() for key, file in files.items()}
    files = models[name] | {parameter: everything[kind]}
    clip = moving_target(3)
    tracker = trackers.create(name, **files)

    def follow():
        tracker.init(clip.images[0], clip.boxes[0])
        tracker.update(clip.images[1])

    with pytest.raises(TrackerError, match=f"models .*{parameter}={everything[kind]}") as caught:
        follow()
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
    # The target went 57 pixels to the right; cells of the answer are some pixels wide.
    assert np.abs(centres - true).max() < 25


def test_where_the_score_is_low_the_target_counts_as_lost(models, moving_target):
    clip = moving_target(3)
    tracker = trackers.create("opencv-vit", tracking_score_threshold=1, **models["opencv-vit"])
    tracker.init(clip.images[0], clip.boxes[0])
    estimate = tracker.update(clip.images[1])
    assert not estimate.visible
    assert estimate.box.tolist() == clip.boxes[0].tolist()
