"""Time per frame of both representations (the paper's "10 milliseconds more")."""

from collections.abc import Collection
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.index import load_results
from bench.results import Cell as StoredCell
from bench.results import Results
from datasets.text_form import parse_text
from reports.tables import Cell, Table
from trackers.colour.luv import LuvBins
from trackers.colour.regions import pixel_regions

__all__ = ["frame_times", "naive_ratios", "time_table"]

_ROUNDS = 15
_PARTICLES = 200


def frame_times(folder: Path, cells: Collection[StoredCell] | None = None) -> pd.DataFrame:
    """CPU seconds of every frame of the timing runs that no load disturbed.

    Returns
    -------
    DataFrame
        `representation`, `sequence`, `frame`, `seconds`: medians over the repetitions.
    """
    results = Results(folder)
    runs = load_results(folder, cells)
    pieces = []
    for _, run in runs[(runs["status"] == "finished") & (runs["disturbed"] == 0)].iterrows():
        times = results.read(folder / run["path"]).times
        if times is None:
            continue
        _, options = parse_text(run["tracker"])
        seconds = times.cpu[np.isfinite(times.cpu)]
        pieces.append(
            pd.DataFrame(
                {
                    "representation": options["representation"],
                    "sequence": run["sequence"],
                    "frame": np.flatnonzero(np.isfinite(times.cpu)),
                    "seconds": seconds,
                }
            )
        )
    if not pieces:
        return pd.DataFrame(columns=["representation", "sequence", "frame", "seconds"])
    frames = pd.concat(pieces, ignore_index=True)
    return frames.groupby(["representation", "sequence", "frame"], as_index=False).median()


def naive_ratios(sequence: str, seed: int = 0) -> NDArray[np.float64]:
    """Time of two histogram calls a particle over that of one, in rounds side by side.

    The plain way, a library call a region: 200 rectangles around the first one of a
    sequence, whole and by halves. Shape (rounds,).
    """
    opened = datasets.load(sequence)
    image = opened[opened.first_frame]
    x, y, width, height = opened.boxes[opened.first_frame]
    generator = np.random.default_rng(seed)
    jitter = generator.uniform(-1, 1, (_PARTICLES, 3)) * [width / 3, width / 3, width * height / 10]
    states = np.array([x + width / 2, y + height / 2, width * height]) + jitter
    colours = LuvBins()
    codes = colours.codes(image).astype(np.intp)
    n_codes = len(colours.votes)
    shapes = [
        pixel_regions(states, width / height, parts, image.shape[1], image.shape[0], 0.25, 16).parts
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


def time_table(frames: pd.DataFrame, naive: NDArray[np.float64]) -> Table:
    """Milliseconds a frame, and the ratio of the two representations."""
    data: list[dict[str, Any]] = []
    for sequence, times in frames.groupby("sequence"):
        wide = times.pivot_table("seconds", "frame", "representation") * 1e3
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
        heads=list(data[0]) if data else ["sequence"],
        n_labels=1,
        rows=[[Cell(text) for text in row.values()] for row in data],
        notes=[
            "with one library call a region and particle (NumPy bincount) the ratio is "
            f"{np.median(naive):.2f} [{naive.min():.2f}–{naive.max():.2f}]"
        ],
        data=pd.DataFrame(data),
    )
