"""Work on a frame, done once for all that want it."""

import numpy as np
import pytest

from trackmark.trackers.base.parameters import TrackerError
from trackmark.trackers.base.sharing import SharedFrame

IMAGE = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)


def counting(calls):
    def scaled(image, factor, offset=0, none=None):
        calls.append((factor, offset))
        return image.astype(int) * factor + offset

    return scaled


def test_compute_caches_by_arguments():
    calls = []
    scaled = counting(calls)
    frame = SharedFrame(IMAGE)
    first = frame.compute(scaled, 3)
    assert frame.compute(scaled, 3) is first
    assert calls == [(3, 0)]
    np.testing.assert_array_equal(first, IMAGE.astype(int) * 3)
    assert frame.compute(scaled, 2).max() == 118
    assert frame.compute(scaled, 2, offset=1, none=None).max() == 119
    assert frame.compute(scaled, 2, none=None, offset=1).max() == 119
    assert frame.compute(counting(calls), 2).max() == 118
    assert SharedFrame(IMAGE).compute(scaled, 3).max() == 177
    assert calls == [(3, 0), (2, 0), (2, 1), (2, 0), (3, 0)]


def test_shared_image_is_read_only():
    image = IMAGE.copy()
    frame = SharedFrame(image)
    with pytest.raises(ValueError, match="read-only"):
        frame.image[0, 0, 0] = 1
    assert np.shares_memory(frame.image, image)
    assert image.flags.writeable


@pytest.mark.parametrize(
    "image", [IMAGE[..., 0], IMAGE[..., :1], IMAGE / 255, IMAGE.repeat(2, axis=2), IMAGE > 0]
)
def test_what_is_no_image_is_refused_in_one_line(image):
    words = r"^the image is [^\n]* Expected: BGR, uint8, of shape \(height, width, 3\)[^\n]*$"
    with pytest.raises(TrackerError, match=words):
        SharedFrame(image)
