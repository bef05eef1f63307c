"""Small painted scenes with known criteria."""

import numpy as np

import datasets
from bench.papers.criteria.shared import SceneImages


def painted(images, boxes, masks=None, visibility=None):
    """Return `SceneImages` of arrays; the masks default to the pixels inside the boxes."""
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
            masks=lambda frame: masks[frame],
        )
    )


def moving(rows, columns=None, *, side=10, size=(60, 80), colour=(20, 120, 240), ground=40):
    """Return a square of one colour on grey, with its centre in given rows and columns."""
    rows = np.asarray(rows, np.float64)
    columns = np.full(len(rows), size[1] / 2) if columns is None else np.asarray(columns, float)
    boxes = np.column_stack([columns - side / 2, rows - side / 2, *np.full((2, len(rows)), side)])
    images = [np.full((*size, 3), ground, np.uint8) for _ in rows]
    for image, box in zip(images, boxes, strict=True):
        image[inside(image.shape, box)] = colour
    return painted(images, boxes)


def inside(shape, box):
    """Return the pixels whose centre lies inside a box."""
    x, y, width, height = box
    rows, columns = np.mgrid[: shape[0], : shape[1]] + 0.5
    return (columns > x) & (columns < x + width) & (rows > y) & (rows < y + height)
