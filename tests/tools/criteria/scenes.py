"""Small painted scenes with known criteria."""

import numpy as np

from tools.criteria.shared import SceneImages
from trackmark import datasets


def painted(images, boxes, masks=None, visibility=None, **others):
    """Return `SceneImages` of arrays, visible and with the pixels inside the boxes by default.

    `others`: attributes or regions of the sequence.
    """
    visibility = np.ones(len(boxes)) if visibility is None else np.asarray(visibility)
    boxes = np.asarray(boxes, np.float64)
    if masks is None:
        masks = [inside(image.shape, box) for image, box in zip(images, boxes, strict=True)]
    return SceneImages(
        datasets.Sequence(
            "painted",
            list(images),
            boxes,
            fingerprint="painted",
            visibility=visibility,
            masks=masks.__getitem__,
            **others,
        )
    )


def blocks(frames, size=(60, 80), **others):
    """Return boxes of one colour on another; `frames` are `(box, colour, ground)`."""
    images = [np.full((*size, 3), ground, np.uint8) for _, _, ground in frames]
    for image, (box, colour, _) in zip(images, frames, strict=True):
        image[inside(image.shape, box)] = colour
    return painted(images, [box for box, _, _ in frames], **others)


def moving(rows, columns=None, *, colour=(20, 120, 240), ground=40):
    """Return a square of one colour on grey, with its centre in given rows and columns."""
    columns = [40] * len(rows) if columns is None else columns
    boxes = [(x - 5, y - 5, 10, 10) for x, y in zip(columns, rows, strict=True)]
    return blocks([(box, colour, ground) for box in boxes])


def blank(boxes, **others):
    """Return a scene of black images with these boxes."""
    return painted([np.zeros((40, 40, 3), np.uint8)] * len(boxes), boxes, **others)


def inside(shape, box):
    """Return the pixels whose centre lies inside a box."""
    x, y, width, height = box
    rows, columns = np.mgrid[: shape[0], : shape[1]] + 0.5
    return (columns > x) & (columns < x + width) & (rows > y) & (rows < y + height)
