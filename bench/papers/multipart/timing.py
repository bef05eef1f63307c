"""Time per frame of both representations (the paper's "10 milliseconds more")."""

from functools import cache
from time import thread_time

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from datasets.text_form import parse_text
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import N_BINS, LuvBins
from trackers.histograms.counting import region_counts
from trackers.histograms.rectangles import bhattacharyya_distances, pixel_regions
from trackers.multipart import LEAST_PIXELS, LEAST_SHARE

__all__ = ["kernel_pairs", "update_times"]

_ROUNDS = 15
_PARTICLES = 200
_BINS = np.arange(0, N_BINS, 5)  # about as many as a person's histogram has


@cache
def kernel_pairs(*, quick: bool) -> pd.DataFrame:
    """Weighing the same rectangles whole and by halves, in turns: a pair of times a row.

    Returns
    -------
    DataFrame
        `kernel`; `single` and `multi` [seconds], or, of `two calls`, 1 and the ratio; `ratio`.
    """
    timed = (8,) if quick else range(1, 9)  # opening a sequence takes longer than timing
    pairs = pd.concat([_kernel_times(f"multipart/{number}") for number in timed])
    plain = pd.DataFrame(
        {"kernel": "two calls", "single": 1.0, "multi": naive_ratios("multipart/8")}
    )
    both = pd.concat([pairs.assign(kernel="one pass"), plain], ignore_index=True)
    return both.assign(ratio=both["multi"] / both["single"])


def _kernel_times(name: str) -> pd.DataFrame:
    """A row a frame of a sequence: `single`, `multi`, medians over rounds [seconds]."""
    rows = []
    sequence = datasets.load(name)
    for frame in (0, len(sequence) // 2):
        image, box = sequence[frame], sequence.regions["full"][frame]
        states = _around(box, np.random.default_rng(frame))
        seconds: dict[str, list[float]] = {"single": [], "multi": []}
        for _ in range(_ROUNDS):
            for parts, key in ((1, "single"), (2, "multi")):
                began = thread_time()
                _weigh(image, states, float(box[2] / box[3]), parts)
                seconds[key].append(thread_time() - began)
        rows.append({key: float(np.median(values)) for key, values in seconds.items()})
    return pd.DataFrame(rows)


def _weigh(image: Image, states: NDArray[np.float64], aspect: float, parts: int) -> None:
    """What the tracker does for the distances of its particles, with one or two parts."""
    height, width = image.shape[:2]
    regions = pixel_regions(states, aspect, parts, width, height, LEAST_SHARE, LEAST_PIXELS)
    colours = LuvBins()
    counts = region_counts(SharedFrame(image), regions, colours, _BINS)
    totals = regions.pixels * colours.votes_a_pixel
    for part in range(parts):
        reference = counts[part, 0]
        bhattacharyya_distances(counts[part], totals[part], reference, int(totals[part, 0]))


def _around(box: NDArray[np.float64], generator: np.random.Generator) -> NDArray[np.float64]:
    """Particles as they lie around a box after a step of the paper's noise."""
    x, y, width, height = box
    jitter = generator.uniform(-1, 1, (_PARTICLES, 3)) * [width / 3, width / 3, width * height / 10]
    return np.asarray(np.array([x + width / 2, y + height / 2, width * height]) + jitter)


def naive_ratios(sequence: str, seed: int = 0) -> NDArray[np.float64]:
    """Time of two histogram calls a particle over that of one, in rounds side by side.

    The plain way, a library call a region: 200 rectangles around the first one of a
    sequence, whole and by halves. Shape (rounds,).
    """
    opened = datasets.load(sequence)
    image = opened[opened.first_frame]
    box = opened.boxes[opened.first_frame]
    states = _around(box, np.random.default_rng(seed))
    colours = LuvBins()
    codes = colours.codes(image).astype(np.intp)
    n_codes = len(colours.votes)
    shapes = [
        pixel_regions(
            states,
            float(box[2] / box[3]),
            parts,
            image.shape[1],
            image.shape[0],
            LEAST_SHARE,
            LEAST_PIXELS,
        ).parts
        for parts in (1, 2)
    ]
    ratios = []
    for _ in range(_ROUNDS):
        seconds = []
        for parts in shapes:
            began = thread_time()
            for left, top, right, bottom in parts.reshape(-1, 4).tolist():
                np.bincount(codes[top:bottom, left:right].ravel(), minlength=n_codes)
            seconds.append(thread_time() - began)
        ratios.append(seconds[1] / seconds[0])
    return np.array(ratios)


def update_times(frames: pd.DataFrame) -> pd.DataFrame:
    """Whole updates, a frame that both were timed on a row, each the median of its repetitions.

    `sequence`, `single`, `multi` [seconds], `difference` of them, and `ratio`.
    """
    names = [parse_text(text)[1]["representation"] for text in frames["tracker"]]
    keys = ["sequence", "frame"]
    seconds = frames["seconds"].astype(np.float64)
    wide = frames.assign(name=names, seconds=seconds).pivot_table(
        "seconds", keys, "name", aggfunc="median"
    )
    wide = wide.reindex(columns=["single", "multi"]).dropna().reset_index()
    difference, ratio = wide["multi"] - wide["single"], wide["multi"] / wide["single"]
    return wide.assign(difference=difference, ratio=ratio)
