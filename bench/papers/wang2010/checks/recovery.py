"""Whether trackers that start beside the target find it (WA-28).

A tracker learns the target from a first image in which a copy of it stands beside it, and is
shown the sequence from then on: its template is right, and its place is wrong. The copy vanishes
with the first image; what moves there has the ground's colours.
"""

from collections.abc import Iterator
from math import nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.readings import ANY
from bench.experiments.contestant import contestant, run_seed
from bench.metrics.centre_error import centre_error
from bench.papers.wang2010.plain.windows import whole_size, window_slices
from datasets import Sequence
from trackers.base.interface import Box, Image, Tracker

__all__ = ["displaced", "measure", "outcome", "ways"]

PRESETS = ("as-written", "recommended")

FILTERS = ("wang2010", "particle-filter")
REPETITIONS = 5
TRACKERS = (
    *(
        (name, preset, f"{name}:preset={preset}", REPETITIONS)
        for name in FILTERS
        for preset in PRESETS
    ),
    ("camshift fixed", ANY, "camshift:window=fixed", 1),
    ("camshift adaptive", ANY, "camshift:window=adaptive", 1),
)
"""Label, preset, text form, and how often it starts: CamShift draws no random numbers."""
WIDTHS = (0, 1, 2, 3)  # of the target's box
STARTS = 3  # a sequence
IN_TIME = 20  # frames


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-28`; see `bench.papers.wang2010.checks`."""
    tolerance = float(sequence.boxes[:, 2:].mean()) / 2
    last = len(sequence) - 1 - IN_TIME
    starts = np.linspace(0, max(last, 0), 1 if quick else STARTS).round().astype(int)
    rows = []
    for start in np.unique(starts).tolist():
        part = sequence[start : start + IN_TIME + 1]
        image, box = part[0], part.boxes[0]
        for number, (widths, offset) in enumerate(ways(box, image.shape)):
            view, beside = displaced(image, box, offset)
            for tracker, preset, text, most in TRACKERS:
                chosen = contestant(text)
                for repetition in range(1 if quick else most):
                    seed = run_seed(chosen.name, sequence.name, REPETITIONS * number + repetition)
                    made = chosen.make(seed)
                    made.init(view, beside)
                    errors = centre_error(part.boxes[1:], _followed(made, part))
                    rows.append(
                        {
                            "tracker": tracker,
                            "preset": preset,
                            "start": start,
                            "widths": widths,
                            "right": offset[0],
                            "down": offset[1],
                            "repetition": repetition,
                        }
                        | outcome(errors, tolerance)
                    )
    return {"wa-28": pd.DataFrame(rows)}


def ways(box: Box, shape: tuple[int, ...]) -> Iterator[tuple[int, tuple[int, int]]]:
    """Widths by which a box is moved, and to where, as far as it stays in the image.

    Yields
    ------
    widths : int
        Of the box.
    offset : tuple of int
        To the right and down, whole [pixels].
    """
    rows, columns = shape[:2]
    x, y, width, height = box.tolist()
    for widths in WIDTHS:
        far = round(widths * width)
        for right, down in dict.fromkeys([(far, 0), (-far, 0), (0, far), (0, -far)]):
            left, top = x + right, y + down
            inside = left >= 0 and top >= 0 and left + width <= columns and top + height <= rows
            if inside or not widths:
                yield widths, (right, down)


def displaced(image: Image, box: Box, offset: tuple[int, int]) -> tuple[Image, Box]:
    """An image with a copy of the box's pixels beside it, and the box around the copy."""
    x, y, width, height = box.tolist()
    right, down = offset
    size = whole_size(width), whole_size(height)
    rows, columns = window_slices(image.shape, x + width / 2, y + height / 2, *size)
    patch = image[rows, columns]
    view = image.copy()
    place = view[rows.start + down : rows.stop + down, columns.start + right : columns.stop + right]
    place[:] = patch[: place.shape[0], : place.shape[1]]
    return view, box + [right, down, 0, 0]


def outcome(errors: NDArray[np.float64], tolerance: float) -> dict[str, float]:
    """What became of a start.

    Parameters
    ----------
    errors : ndarray of float64, shape (n,)
        Of the frames after it.
    tolerance : float
        In the same unit.

    Returns
    -------
    dict of str to float
        The last columns of `wa-28`.
    """
    outside = np.flatnonzero(errors > tolerance)
    since = int(outside[-1]) + 2 if len(outside) else 1
    recovered = since <= len(errors)
    return {
        "recovered": float(recovered),
        "recovered_from": float(since) if recovered else nan,
        "reached": float(len(outside) < len(errors)),
    }


def _followed(tracker: Tracker, part: Sequence) -> NDArray[np.float64]:
    """Its boxes in all frames but the first."""
    return np.array([tracker.update(part[frame]).box for frame in range(1, len(part))])
