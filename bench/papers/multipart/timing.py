"""Time per frame of both representations (the paper's "10 milliseconds more")."""

from collections.abc import Collection, Sequence
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.papers.timed import timed_runs
from bench.store.layout import Cell as StoredCell
from datasets.text_form import parse_text
from reports.tables import MISSING, Cell, Table
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import N_BINS, LuvBins
from trackers.histograms.counting import region_counts
from trackers.histograms.rectangles import bhattacharyya_distances, pixel_regions
from trackers.multipart import LEAST_PIXELS, LEAST_SHARE

__all__ = [
    "by_representation",
    "frame_times",
    "kernel_times",
    "naive_ratios",
    "time_table",
]

_HEADS = ("sequence", "single [ms]", "multi [ms]", "multi − single [ms]", "ratio")
_ROUNDS = 15
_PARTICLES = 200
_BINS = np.arange(0, N_BINS, 5)  # about as many as a person's histogram has


def frame_times(folder: Path, cells: Collection[StoredCell] | None = None) -> pd.DataFrame:
    """CPU seconds of every frame of the timing runs that no load disturbed.

    Returns
    -------
    DataFrame
        `representation`, `sequence`, `frame`, `seconds`: medians over the repetitions.
    """
    pieces = []
    for run in timed_runs(folder, cells):
        assert run.times is not None
        _, options = parse_text(run.identity.tracker)
        timed = np.isfinite(run.times.cpu)
        pieces.append(
            pd.DataFrame(
                {
                    "representation": options["representation"],
                    "sequence": run.identity.sequence,
                    "frame": np.flatnonzero(timed),
                    "seconds": run.times.cpu[timed],
                }
            )
        )
    if not pieces:
        return pd.DataFrame(columns=["representation", "sequence", "frame", "seconds"])
    frames = pd.concat(pieces, ignore_index=True)
    keys = ["representation", "sequence", "frame"]
    return frames.groupby(keys, as_index=False).agg({"seconds": "median"})


def by_representation(frames: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    """Seconds by representation, of the frames that both were timed on."""
    wide = frames.pivot_table("seconds", keys, "representation")
    return wide.reindex(columns=["single", "multi"]).dropna()


def kernel_times(sequences: Sequence[str]) -> pd.DataFrame:
    """Times of weighing the same rectangles whole and by halves, in turns.

    Returns
    -------
    DataFrame
        A row a sequence and frame: `single`, `multi`, medians over rounds [seconds].
    """
    rows = []
    for name in sequences:
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


def time_table(
    frames: pd.DataFrame,
    kernels: pd.DataFrame,
    naive: NDArray[np.float64],
    failed: Sequence[str] = (),
) -> Table:
    """Milliseconds a frame, and the ratio of the two representations; what failed beneath."""
    data: list[dict[str, Any]] = []
    for sequence, times in frames.groupby("sequence"):
        wide = by_representation(times, ["frame"]) * 1e3
        if wide.empty:
            data.append(dict.fromkeys(_HEADS, MISSING) | {"sequence": sequence})
            continue
        ratio = wide["multi"] / wide["single"]
        data.append(
            {
                "sequence": sequence,
                "single [ms]": f"{wide['single'].median():.2f}",
                "multi [ms]": f"{wide['multi'].median():.2f}",
                "multi − single [ms]": f"{(wide['multi'] - wide['single']).median():+.3f}",
                "ratio": f"{ratio.median():.3f}",
            }
        )
    return Table(
        name="time",
        caption=(
            "Time a frame, CPU, median over frames, 200 particles, one thread (paper: multi takes "
            "10 ms more on a Pentium 4, 3.0 GHz; seconds of two machines are not compared)"
        ),
        heads=list(_HEADS),
        n_labels=1,
        rows=[[Cell(row[head]) for head in _HEADS] for row in data],
        notes=[
            "passes that other load disturbed are left out; where none is left there is a dash",
            "whole updates on tracks that differ; weighing the same rectangles takes multi "
            f"{(kernels['multi'] / kernels['single']).median():.2f} times as long",
            "with one library call a region and particle (NumPy bincount) the ratio is "
            f"{np.median(naive):.2f} [{naive.min():.2f}–{naive.max():.2f}]",
            *failed,
        ],
        data=pd.DataFrame(data),
    )
