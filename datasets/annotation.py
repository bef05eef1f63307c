"""Interpolation of ground truth between frames in which boxes are marked."""

from collections.abc import Iterable, Mapping
from math import nan

import numpy as np
from numpy.typing import ArrayLike

from trackmark.datasets.interface import MAX_COORDINATE, Array, SequenceError, lies_outside
from trackmark.datasets.truth_file import GroundTruth


def interpolate(
    keys: Mapping[int, ArrayLike],
    n_frames: int,
    absent: Iterable[tuple[int, int]] = (),
    size: tuple[int, int] | None = None,
) -> GroundTruth:
    """Interpolate the ground truth of all frames from the boxes of key frames.

    Between two key frames, x, y, width and height change linearly, also across frames without the
    target. There is no extrapolation: the target is annotated as absent before the first and after
    the last key frame.

    Parameters
    ----------
    keys : mapping of int to box
        Marked boxes `[x, y, width, height]`, in pixels, by frame.
    n_frames : int
        Number of frames, at least 1.
    absent : iterable of (int, int)
        First and last frame (included) of each interval without the target.
    size : tuple of int, optional
        Width and height of the images [pixels]; each box must overlap the image.

    Returns
    -------
    GroundTruth
        Ground truth with `n_frames` rows and their `sources`.

    Raises
    ------
    SequenceError
        If there is no key frame, or if a frame or box is out of range. Also if a box has no size,
        an interval ends before it starts, or the target is absent in a key frame.

    Examples
    --------
    >>> truth = interpolate({1: [0, 0, 10, 10], 3: [4, 2, 10, 14]}, n_frames=5)
    >>> truth.boxes[2].tolist(), truth.sources
    ([2.0, 1.0, 10.0, 12.0], ('', 'marked', 'interpolated', 'marked', ''))
    """
    if not keys:
        raise SequenceError("there are no key frames. Mark the target in at least one frame.")
    absent = list(absent)
    check_marks(keys, n_frames, absent, size)
    frames = sorted(keys)
    marked = np.array([np.asarray(keys[frame], dtype=np.float64) for frame in frames])
    all_frames = np.arange(n_frames)
    boxes = np.column_stack(
        [np.interp(all_frames, frames, column, left=nan, right=nan) for column in marked.T]
    )
    for first, last in absent:
        boxes[first : last + 1] = nan
    sources = [
        "marked" if frame in keys else "" if np.isnan(box[0]) else "interpolated"
        for frame, box in enumerate(boxes)
    ]
    return GroundTruth(boxes, sources=tuple(sources))


def check_marks(
    keys: Mapping[int, ArrayLike],
    n_frames: int,
    absent: Iterable[tuple[int, int]],
    size: tuple[int, int] | None,
) -> None:
    """Raise `SequenceError` for parameters that `interpolate` rejects, except an empty `keys`."""
    for frame in sorted(keys):
        _check_frame(frame, n_frames)
        _check_box(frame, np.asarray(keys[frame], dtype=np.float64), size)
    for first, last in absent:
        _check_absent(first, last, sorted(keys), n_frames)


def _check_frame(frame: int, n_frames: int) -> None:
    if not 0 <= frame < n_frames:
        raise SequenceError(
            f"frame {frame} is outside the sequence. Expected: 0 to {n_frames - 1}."
        )


def _check_box(frame: int, box: Array, size: tuple[int, int] | None) -> None:
    if not (np.isfinite(box).all() and (box[2:] > 0.0).all()):
        raise SequenceError(
            f"frame {frame}: invalid box {box.tolist()}. Expected: finite, with a size above 0."
        )
    if (np.abs(box) > MAX_COORDINATE).any() or (size and lies_outside(box, size)):
        image = f" ({size[0]}x{size[1]})" if size else ""
        raise SequenceError(f"frame {frame}: {box.tolist()} lies outside the image{image}.")


def _check_absent(first: int, last: int, marked: list[int], n_frames: int) -> None:
    """Refuse an interval of absence that is invalid or contains a key frame."""
    _check_frame(first, n_frames)
    _check_frame(last, n_frames)
    if last < first:
        raise SequenceError(f"absent {first}-{last}: the interval ends before it starts.")
    inside = [frame for frame in marked if first <= frame <= last]
    if inside:
        raise SequenceError(
            f"frame {inside[0]} has a box, but the target is absent in frames {first}-{last}."
        )
