"""Runs with known boxes and ground truth, for tests of measures."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from trackmark.bench.papers.measures import MeasuredRun, find_measure
from trackmark.bench.papers.paper import read_paper


def measured(
    paper: str,
    boxes: np.ndarray,
    estimates: np.ndarray,
    visibility: Any = 1.0,
    size: tuple[int, int] = (60, 80),
    run: Any = (),
    **truth: Any,
) -> MeasuredRun:
    """Return a run with these estimates; `run` and `truth` hold further attributes."""
    visible = np.broadcast_to(visibility, len(boxes)).astype(float)
    run_record: Any = SimpleNamespace(
        **{"failure": "", "details": {}, "boxes_in": lambda trajectory: estimates, **dict(run)}
    )
    ground_truth: Any = SimpleNamespace(boxes=boxes, visibility=visible, image_size=size, **truth)
    return MeasuredRun(run_record, ground_truth, read_paper(paper).frame_rules)


def values_of(paper: str) -> Callable[[str, MeasuredRun], float]:
    """Return a function for the value of a measure of the paper, given as text, of a run."""
    return lambda text, run: find_measure(text, paper)(run)
