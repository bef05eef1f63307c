"""CamShift against the paper's equations, OpenCV's CamShift and what must hold of any."""

from math import sqrt

import cv2
import numpy as np
import pytest

from tests.trackers.following import track
from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.maps.back_projection import adapted_window

# In the middle of a hue bin each, so that sensor noise moves no pixel to the next.
RED, BLUE, GREEN = (20, 72, 200), (200, 56, 30), (60, 180, 40)


def scene(centre, size=(24, 36), height=120, width=160):
    """A red and blue target on green; `centre` and `size` in whole or half pixels."""
    image = np.full((height, width, 3), GREEN, np.uint8)
    left, top = round(centre[0] - size[0] / 2), round(centre[1] - size[1] / 2)
    rows = slice(max(top, 0), max(top + size[1], 0))
    columns = slice(max(left, 0), max(left + size[0], 0))
    image[rows, columns] = RED
    image[max(top + size[1] // 2, 0) : rows.stop, columns] = BLUE
    return image, np.array([left, top, *size], float)


def clean_sequence(n_frames=25):
    """Smooth motion of a target on ground of another hue, with sensor noise."""
    rng = np.random.default_rng(1)
    images, boxes = [], []
    for frame in range(n_frames):
        image, box = scene((60 + 30 * np.sin(frame / 6), 60 + 15 * np.cos(frame / 5)))
        noise = rng.normal(0, 4, image.shape)
        images.append(np.clip(image + noise, 0, 255).astype(np.uint8))
        boxes.append(box)
    return images, np.array(boxes)


def test_the_centre_is_the_centroid_of_the_back_projection():
    # Of the red block that is two thirds of the target's colours, and of half its rows.
    template = np.full((40, 40, 3), GREEN, np.uint8)
    template[10:14, 10:16] = RED  # 24 pixels
    template[14:16, 10:16] = BLUE  # 12 pixels: they weigh half
    moved = np.full((40, 40, 3), GREEN, np.uint8)
    moved[11, 12] = RED
    moved[13, 15] = BLUE
    (estimate,) = track("camshift", [template, moved], [10, 10, 6, 6], stop_distance=99)
    centre = estimate.box[:2] + estimate.box[2:] / 2
    expected = (np.array([12.5, 11.5]) + 0.5 * np.array([15.5, 13.5])) / 1.5
    assert centre == pytest.approx(expected, abs=1e-9)
    assert estimate.details["iterations"] == 1
    assert estimate.details["mean_back_projection"] == pytest.approx(1.5 / 36, abs=1e-9)
    assert estimate.confidence == estimate.details["mean_back_projection"]


@pytest.mark.parametrize(("stop_distance", "iterations"), [(0.0, 3), (1.0, 1), (99.0, 1)])
def test_a_step_shorter_than_the_stop_distance_is_still_taken(stop_distance, iterations):
    images = [scene((60, 60))[0], scene((60.5 + 0.25, 60))[0]]
    (estimate,) = track(
        "camshift", images, [48, 42, 24, 36], stop_distance=stop_distance, max_iterations=3
    )
    assert estimate.details["iterations"] == iterations
    assert estimate.box[0] > 48  # moved all the same


def test_bradskis_rule_sets_the_window_from_the_mass():
    image, box = scene((60, 60))
    (estimate,) = track("camshift", [image, image], box, window="adaptive")
    mass = 24 * 36  # both colours fill half the template: every pixel weighs 1
    ratio = 24 / 36
    expected = [2 * sqrt(mass * ratio), 2 * sqrt(mass / ratio)]  # 48 x 72
    assert estimate.box[2:] == pytest.approx(expected, abs=0.5)
    assert estimate.box[:2] + estimate.box[2:] / 2 == pytest.approx([60, 60], abs=1e-9)
    assert estimate.confidence == 1.0
    assert adapted_window(100.0, 1.1, (500, 500)) == (21, 19)  # 2 √110 = 20.98, 2 √90.9 = 19.07


def test_adaptive_window_size_is_limited():
    full = np.full((50, 40, 3), RED, np.uint8)
    estimates = track("camshift", [full] * 8, [10, 10, 20, 20], window="adaptive")
    assert estimates[-1].box.tolist() == [0, 0, 40, 50]
    dot = np.full((50, 40, 3), GREEN, np.uint8)
    dot[20, 20] = RED
    (estimate,) = track("camshift", [full, dot], [15, 15, 10, 10], window="adaptive")
    assert estimate.box.tolist() == [19, 19, 3, 3]


def test_an_adaptive_window_has_the_centre_of_opencvs():
    # Same template, same 32 hues, same stopping rule. Sizes are not compared: OpenCV's come from
    # second moments over an enlarged window, Bradski's from the mass.
    images, boxes = clean_sequence()
    left, top, width, height = boxes[0].astype(int)
    hsv = cv2.cvtColor(images[0], cv2.COLOR_BGR2HSV)
    template = hsv[top : top + height, left : left + width, 0].copy()
    counts = np.bincount(template.ravel().astype(int) * 32 // 180, minlength=32)
    table = np.round(255 * counts / counts.max()).astype(np.uint8)
    window = (left, top, width, height)
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 10, 0.5)
    theirs = []
    for image in images[1:]:
        hue = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)[..., 0].astype(int)
        rotated, window = cv2.CamShift(table[hue * 32 // 180], window, stop)
        # Centre of mass, pixel centres at integers.
        theirs.append(np.array(rotated[0]) + 0.5)
    ours = [
        estimate.box[:2] + estimate.box[2:] / 2
        for estimate in track("camshift", images, boxes[0], window="adaptive", stop_distance=0.5)
    ]
    truth = boxes[1:, :2] + boxes[1:, 2:] / 2
    assert np.abs(np.array(ours) - truth).max() < 1
    assert np.abs(np.array(ours) - theirs).max() < 1


def test_window_without_weight_stays_until_target_returns():
    target_image, box = scene((60, 60))
    empty = np.full_like(target_image, GREEN)
    gone, back = track("camshift", [target_image, empty, target_image], box, window="adaptive")
    assert not gone.visible
    assert gone.confidence == 0
    assert gone.box.tolist() == box.tolist()
    assert back.visible
    assert back.box[:2] + back.box[2:] / 2 == pytest.approx([60, 60], abs=0.5)


def test_a_mask_hides_the_pale_the_dark_and_the_bright():
    image, box = scene((60, 60))
    clean, _ = scene((64, 60))
    pale = (180, 186, 200)  # red's hue, saturation 0.1
    dark = (2, 8, 20)  # red's hue, value 0.08
    bright = (25, 91, 253)  # red's hue, value 0.99
    masks = {"minimum_saturation": (0.2, pale), "minimum_value": (0.2, dark)}
    for mask, (limit, patch) in (masks | {"maximum_value": (0.9, bright)}).items():
        distracted = clean.copy()
        distracted[60:70, 42:52] = patch
        (plain,) = track("camshift", [image, distracted], box)
        (masked,) = track("camshift", [image, distracted], box, **{mask: limit})
        (expected,) = track("camshift", [image, clean], box)
        assert masked.box.tolist() == expected.box.tolist()
        assert plain.box[0] < masked.box[0] - 0.1


def test_a_target_without_a_usable_pixel_is_refused():
    image, box = scene((60, 60))
    with pytest.raises(TrackerError, match="minimum_saturation"):
        track("camshift", [image], box, minimum_saturation=0.95)
    with pytest.raises(TrackerError, match=r"\[200.0, 10.0, 20.0, 20.0\] is in the image"):
        track("camshift", [image], [200, 10, 20, 20])
