"""Recorded sequences open as published."""

import cv2
import numpy as np
import pytest

from trackmark import datasets

# Path: number of frames with ground truth and of all others, shape, init box.
SEQUENCES = {
    "otb/Couple": (140, 0, (240, 320), [50, 46, 25, 62]),
    "otb/Crossing": (120, 0, (240, 360), [204, 150, 17, 50]),
    "otb/Football1": (74, 7, (288, 352), [152, 104, 26, 43]),
    "davis/libby": (49, 0, (480, 854), None),
    "davis/blackswan": (50, 0, (480, 854), None),
    "davis/drift-straight": (50, 0, (480, 854), None),
    "vot/bag": (196, 0, (360, 480), [292.23, 128.36, 145.96, 132.47]),
    "vot/ball": (601, 1, None, None),
    "video/bag.avi": (196, 0, (360, 480), None),
    "video/orange-shirt/sample_sequence_compressed.avi": (53, 0, (360, 640), None),
}


@pytest.mark.parametrize("path", SEQUENCES)
def test_recorded_sequence_opens_as_published(recorded, path):
    frames, beyond, shape, box = SEQUENCES[path]
    sequence = datasets.load(recorded / path)
    assert (len(sequence), sequence.images_beyond_truth) == (frames, beyond)
    for image in (sequence[0], sequence[-1]):
        assert shape is None or image.shape == (*shape, 3)
    if box is not None:
        assert sequence.boxes[0].round(2).tolist() == box
    if not path.endswith(".avi"):
        assert sequence.present.all()
        sequence.check_runnable()
    attribute = {"otb": "OPR", "vot": "camera_motion"}.get(path.partition("/")[0])
    assert attribute is None or attribute in sequence.attributes


@pytest.mark.parametrize("name", ["libby", "blackswan", "drift-straight"])
def test_recorded_davis_boxes_enclose_the_masks(recorded, name):
    sequence = datasets.load(recorded / "davis" / name)
    for frame in (0, len(sequence) // 2, len(sequence) - 1):
        file = recorded / "davis/Annotations/480p" / name / f"{frame:05}.png"
        mask = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        np.testing.assert_array_equal(sequence.mask(frame), mask == 255)
        assert sequence.boxes[frame].tolist() == list(cv2.boundingRect(mask))


def test_recorded_avi_shows_the_frames_of_its_images(recorded):
    video = datasets.load(recorded / "video" / "bag.avi")
    images = datasets.load(recorded / "vot" / "bag")
    for i in (3, 40, 97, 192):
        differences = [np.abs(video[i].astype(int) - images[k]).mean() for k in (i - 3, i, i + 3)]
        assert min(differences) == differences[1] < 8
