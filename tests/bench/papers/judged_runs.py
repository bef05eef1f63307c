"""Runs with known boxes and ground truth, for tests of measures."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from trackmark.bench.papers.description import read_description
from trackmark.bench.papers.measures import JudgedRun, find_measure


def judged(
    paper: str,
    boxes: np.ndarray,
    estimates: np.ndarray,
    visibility: Any = 1.0,
    size: tuple[int, int] = (60, 80),
    run: Any = (),
    **truth: Any,
) -> JudgedRun:
    """Return a run with these estimates; `run` and `truth` hold further attributes."""
    visible = np.broadcast_to(visibility, len(boxes)).astype(float)
    run_record: Any = SimpleNamespace(
        **{"failure": "", "details": {}, "boxes_in": lambda trace: estimates, **dict(run)}
    )
    ground_truth: Any = SimpleNamespace(boxes=boxes, visibility=visible, image_size=size, **truth)
    return JudgedRun(run_record, ground_truth, read_description(paper), paper)


def value(text: str, run: JudgedRun) -> float:
    """Return a measure, given as text, of a run."""
    return find_measure(text, run.description.name)(run)
