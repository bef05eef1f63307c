"""Overlap of a ground-truth region (box, polygon or mask) with a box, clipped to the image.

The definition is that of the VOT toolkit: coordinates are rounded to whole pixels and pixels are
counted. A box of width w covers w columns, a polygon also the pixels of its vertices.
docs/metrics.md lists the differences.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.boxes import is_well_formed, overlap

MAX_COORDINATE = 2.0**30
"""Largest coordinate [px]; larger ones are clipped, so that areas and integers do not overflow."""


def raster_overlap(
    truth: NDArray[np.float64],
    estimate: NDArray[np.float64],
    size: tuple[int, int] | None = None,
    shapes: Iterable[NDArray[Any] | None] | None = None,
) -> NDArray[np.float64]:
    """Return the intersection over union of the pixels of two regions by frame, in [0, 1].

    Boxes have shape (n, 4). Pixels outside the image of `size` (width, height) do not count.
    `shapes` replace boxes of the ground truth. The overlap is 0 if the target is absent (NaN), the
    estimate is malformed or neither region has a pixel.
    """
    e = _corners(_round_like_vot(np.where(is_well_formed(estimate)[:, None], estimate, 0.0)), size)
    t = _corners(_round_like_vot(np.nan_to_num(truth)), size)
    overlaps = overlap(_boxes(t), _boxes(e))
    for i, region in enumerate(() if shapes is None else shapes):
        if region is not None and np.isfinite(truth[i]).all():
            shape = np.asarray(region)
            pixels = _round_like_vot(shape) if shape.dtype != bool else shape
            overlaps[i] = _pixel_overlap(pixels, e[i].astype(int), size)
    return overlaps


def _round_like_vot(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Round to integers, halves to even, in the single precision in which VOT stores regions."""
    return np.round(values.clip(-MAX_COORDINATE, MAX_COORDINATE).astype(np.float32)).astype(
        np.float64
    )


@np.errstate(over="ignore")
def _corners(boxes: NDArray[np.float64], size: tuple[int, int] | None) -> NDArray[np.float64]:
    """Return corners [left, top, right, bottom] of boxes clipped to the image, shape (n, 4)."""
    corners = np.column_stack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]])
    corners = corners.clip(-MAX_COORDINATE, MAX_COORDINATE)
    if size is not None:
        corners = np.clip(corners, 0, [*size, *size])
    corners[:, 2:] = np.maximum(corners[:, :2], corners[:, 2:])
    return np.asarray(corners)


def _boxes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.column_stack([corners[:, :2], corners[:, 2:] - corners[:, :2]])


def _pixel_overlap(
    shape: NDArray[np.float64], corners: NDArray[np.int64], size: tuple[int, int] | None
) -> float:
    """Return the overlap between a box and a mask or polygon, all with integer coordinates."""
    left, top, right, bottom = (int(value) for value in corners)
    mask, x, y = (shape, 0, 0) if shape.dtype == bool else _polygon_pixels(shape, size, left)
    height, width = mask.shape
    rows = slice(max(top - y, 0), max(min(bottom - y, height), 0))
    columns = slice(max(left - x, 0), max(min(right - x, width), 0))
    both = np.count_nonzero(mask[rows, columns])
    either = np.count_nonzero(mask) + (right - left) * (bottom - top) - both
    return both / either if either else 0.0


def _polygon_pixels(
    points: NDArray[np.float64], size: tuple[int, int] | None, from_column: int
) -> tuple[NDArray[np.bool_], int, int]:
    """Return the pixels of a polygon with integer coordinates as a mask, with its column and row.

    In each row, crossings with edges are truncated to integers, sorted and paired. Pixels from the
    first to the second crossing of a pair are inside. Of two equal crossings the first is ignored,
    unless they are the last two of the row. The mask starts at `from_column` if this column is left
    of the polygon: VOT truncates crossings relative to the left end of both regions.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    low[0] = min(low[0], from_column)
    if size is not None:
        low, high = np.maximum(low, 0), np.minimum(high, np.array(size) - 1)
    (x, y), (width, height) = low.astype(int), np.maximum(high - low + 1, 0).astype(int)
    mask = np.zeros((height, width), bool)
    start = points - low
    end = np.roll(start, 1, axis=0)
    (sx, sy), (dx, dy) = start.T, (end - start).T
    rows = np.arange(height)[:, None]
    crosses = (np.minimum(sy, end[:, 1]) <= rows) & (rows <= np.maximum(sy, end[:, 1]))
    share = np.divide(rows - sy, dy, out=np.zeros(crosses.shape), where=dy != 0)
    # Edges that do not cross a row are sorted to the end and ignored.
    columns = np.sort(np.where(crosses, (sx + share * dx).astype(int), np.iinfo(int).max), axis=1)
    counts = np.count_nonzero(crosses, axis=1).tolist()
    for row, (crossings, count) in enumerate(zip(columns.tolist(), counts, strict=True)):
        nodes = crossings[:count]
        while len(nodes) > 1:
            first = nodes.pop(0)
            if first == nodes[0] and len(nodes) > 1:
                continue
            last = nodes.pop(0)
            if last >= 0:
                mask[row, max(first, 0) : last + 1] = True
    return mask, int(x), int(y)
