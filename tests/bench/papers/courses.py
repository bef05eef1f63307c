"""Courses of runs with known boxes, for tests of measures."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from trackmark.bench.papers.description import read_description
from trackmark.bench.papers.measures import Course, find_measure


def course(
    paper: str,
    boxes: np.ndarray,
    estimates: np.ndarray,
    visibility: Any = 1.0,
    size: tuple[int, int] = (60, 80),
    run: Any = (),
    **truth: Any,
) -> Course:
    """Return the course of a run with these estimates; `run` and `truth` hold what else is read."""
    visible = np.broadcast_to(visibility, len(boxes)).astype(float)
    made: Any = SimpleNamespace(
        **{"failure": "", "details": {}, "boxes_in": lambda trace: estimates, **dict(run)}
    )
    true: Any = SimpleNamespace(boxes=boxes, visibility=visible, image_size=size, **truth)
    return Course(made, true, read_description(paper), paper)


def value(text: str, given: Course) -> float:
    """Return a measure, given as its text form, of a course."""
    return find_measure(text, given.description.name)(given)
