"""The paper's Figures 3 and 4 as film strips, and where the proposed method loses sequence 7."""

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.store.results import Results
from datasets.text_form import format_text
from reports.film_strip import evenly_spaced, film_strip, write_film_strip
from reports.overlay import TRUTH

__all__ = ["write_figures"]

FIGURES = {"figure-3": "multipart/2", "figure-4": "multipart/6"}
_STRIP = 10  # frames
_AROUND_LOSS = 20  # frames before and after


def write_figures(scores: pd.DataFrame, folder: Path) -> list[Path]:
    """Draw the strips of the first scene in even light, first repetition, full rectangle.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`, with the rows of `adaptive_rows`.
    folder : Path
        Where to.
    """
    shown = scores[
        (scores["repetition"] == 0)
        & (scores["initial"] == "full")
        & (scores["variant"] == "")
        & (scores["light"] == "even")
        & (scores["scene"] == 0)
    ]
    paths = []
    for name, sequence in FIGURES.items():
        runs = shown[shown["sequence"] == sequence]
        if len(runs):
            n = int(runs["frames"].iloc[0])
            numbers = evenly_spaced(0, n - 1, _STRIP)
            paths.append(_strip(folder / f"{name}.png", runs, numbers, f"{name}, {sequence}"))
    lost = shown[(shown["sequence"] == "multipart/7") & (shown["first_loss"] < shown["frames"])]
    if "adaptive" in set(lost["representation"]):
        row = lost[lost["representation"] == "adaptive"].iloc[0]
        first, last = int(row["first_loss"]) - _AROUND_LOSS, int(row["first_loss"]) + _AROUND_LOSS
        numbers = evenly_spaced(max(first, 0), min(last, int(row["frames"]) - 1), _STRIP)
        runs = shown[shown["sequence"] == "multipart/7"]
        title = f"multipart/7, first loss of the proposed method at frame {row['first_loss']:.0f}"
        paths.append(_strip(folder / "loss-7.png", runs, numbers, title))
    return paths


def _strip(path: Path, runs: pd.DataFrame, numbers: list[int], title: str) -> Path:
    row = runs.iloc[0]
    sequence = datasets.load(
        format_text(row["sequence"], {"scene": row["scene"], "light": row["light"]})
    )
    boxes: dict[str, NDArray[np.float64]] = {TRUTH: sequence.regions["full"]}
    picked = set(runs[runs["representation"] == "adaptive"]["path"])
    for name in ("single", "multi"):
        for _, run in runs[runs["representation"] == name].iterrows():
            file = Path(run["path"])
            # The proposed method is one of the two: its box would hide the one it equals.
            label = f"{name} = proposed" if run["path"] in picked else name
            boxes[label] = Results(file.parent.parent.parent).read(file).boxes
    strip = film_strip(sequence.__getitem__, numbers, boxes, title)
    return write_film_strip(path, strip)
