"""The paper's Figures 3 and 4 as film strips, and where the proposed method loses sequence 7."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.papers.context import Context
from reports.film_strip import evenly_spaced, film_strip
from reports.overlay import TRUTH

__all__ = ["strips"]

FIGURES = {"figure-3": "multipart/2", "figure-4": "multipart/6"}
LOST = "multipart/7"
_STRIP = 10  # frames
_AROUND_LOSS = 20  # frames before and after


def strips(context: Context) -> dict[str, NDArray[np.uint8] | None]:
    """Strips of the first scene in even light, first repetition, full rectangle."""
    found = {
        name: _strip(context, sequence, f"{name}, {sequence}") for name, sequence in FIGURES.items()
    }
    lost = _runs(context, LOST, "adaptive")
    lost = lost[lost["first_loss"] < lost["frames"]]
    if len(lost):
        at = int(lost["first_loss"].iloc[0])
        title = f"{LOST}, first loss of the proposed method at frame {at}"
        found["loss-7"] = _strip(context, LOST, title, at - _AROUND_LOSS, at + _AROUND_LOSS)
    return found


def _runs(context: Context, sequence: str, representation: str) -> pd.DataFrame:
    told = {"init": "full", "representation": representation}
    runs = context.lookup.runs("multipart", told, [sequence])
    return runs[(runs["name"] == sequence) & (runs["repetition"] == 0) & (runs["failure"] == "")]


def _strip(
    context: Context, name: str, title: str, first: int = 0, last: int | None = None
) -> NDArray[np.uint8] | None:
    picked = set(_runs(context, name, "adaptive")["path"])
    sequence = datasets.load(name)
    boxes: dict[str, NDArray[np.float64]] = {TRUTH: sequence.regions["full"]}
    for one in ("single", "multi"):
        for path in _runs(context, name, one)["path"]:
            # The proposed method is one of the two: its box would hide the one it equals.
            label = f"{one} = proposed" if path in picked else one
            boxes[label] = context.stored.read(path).boxes
    if len(boxes) == 1:
        return None
    end = len(sequence) - 1
    numbers = evenly_spaced(max(first, 0), end if last is None else min(last, end), _STRIP)
    return film_strip(sequence.__getitem__, numbers, boxes, title)
