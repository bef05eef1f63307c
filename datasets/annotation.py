"""From boxes marked in some frames to the truth of all frames."""

from collections.abc import Iterable, Mapping
from math import nan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import MAX_COORDINATE, SequenceError, lies_outside
from trackmark.datasets.truth_file import GroundTruth


def interpolate(
    keys: Mapping[int, ArrayLike],
    n_frames: int,
    absent: Iterable[tuple[int, int]] = (),
    size: tuple[int, int] | None = None,
) -> GroundTruth:
    """GroundTruth of all frames from the boxes of some.

    Between two key frames x, y, width and height change linearly, also across frames where
    the target is absent. Nothing is extrapolated: before the first key frame and after the
    last the target counts as absent; whoever knows better marks those frames.

    Parameters
    ----------
    keys : mapping of int to box
        Marked boxes `[x, y, width, height]`, in pixels, by frame.
    n_frames : int
        Number of frames, at least 1.
    absent : iterable of (int, int)
        First and last frame (included) of every stretch without the target.
    size : tuple of int, optional
        Width and height of the images [pixels], in which boxes must lie at least in part.

    Returns
    -------
    GroundTruth
        With `n_frames` rows; `sources` tells the marked from the interpolated.

    Raises
    ------
    SequenceError
        For no key frames, a frame outside the sequence, a box without size or outside the image,
        a stretch that ends before it begins, and a key frame with the target said to be absent.

    Examples
    --------
    >>> truth = interpolate({1: [0, 0, 10, 10], 3: [4, 2, 10, 14]}, n_frames=5)
    >>> truth.boxes[2].tolist(), truth.sources
    ([2.0, 1.0, 10.0, 12.0], ('', 'marked', 'interpolated', 'marked', ''))
    """
    if not keys:
        raise SequenceError("there are no key frames: mark the target in at least one.")
    frames = sorted(keys)
    marked = np.array([np.asarray(keys[frame], dtype=np.float64) for frame in frames])
    for frame, box in zip(frames, marked, strict=True):
        _check_frame(frame, n_frames)
        _check_box(frame, box, size)
    every = np.arange(n_frames)
    boxes = np.column_stack(
        [np.interp(every, frames, column, left=nan, right=nan) for column in marked.T]
    )
    for first, last in absent:
        _check_absent(first, last, frames, n_frames)
        boxes[first : last + 1] = nan
    sources = ("" if np.isnan(box[0]) else "interpolated" for box in boxes)
    named = ("marked" if frame in keys else source for frame, source in enumerate(sources))
    return GroundTruth(boxes, sources=tuple(named))


def _check_frame(frame: int, n_frames: int) -> None:
    if not 0 <= frame < n_frames:
        raise SequenceError(f"frame {frame} is outside the sequence: 0 to {n_frames - 1}.")


def _check_box(frame: int, box: NDArray[np.float64], size: tuple[int, int] | None) -> None:
    if not (np.isfinite(box).all() and (box[2:] > 0.0).all()):
        raise SequenceError(f"frame {frame}: {box.tolist()} is not a box with a size.")
    if (np.abs(box) > MAX_COORDINATE).any() or (size and lies_outside(box, size)):
        image = f" ({size[0]}x{size[1]})" if size else ""
        raise SequenceError(f"frame {frame}: {box.tolist()} lies outside the image{image}.")


def _check_absent(first: int, last: int, marked: list[int], n_frames: int) -> None:
    """Refuse a stretch without the target that is none, or in which a frame is marked."""
    _check_frame(first, n_frames)
    _check_frame(last, n_frames)
    if last < first:
        raise SequenceError(f"absent {first}-{last}: the stretch ends before it begins.")
    inside = [frame for frame in marked if first <= frame <= last]
    if inside:
        raise SequenceError(f"frame {inside[0]} has a box, but is within absent {first}-{last}.")
