"""Measures of the multi-part paper: the whole person as the target, overlap, first loss."""

from collections.abc import Callable

import numpy as np

from trackmark.bench.metrics import native
from trackmark.bench.metrics.centre_error import centre_inside
from trackmark.bench.metrics.native import SUCCESS_OVERLAP
from trackmark.bench.papers.measures import Course, Values, measure

PERSON = "full"
"""Region of the ground truth that holds the whole person."""


def inside_person(course: Course) -> Values:
    """Return 1 in frames with the centre inside the whole person's rectangle, else 0, shape (n,).

    The rectangle does not depend on the region that the tracker started from.
    """
    return np.asarray(centre_inside(course.truth.regions[PERSON], course.boxes), np.float64)


SERIES: dict[str, Callable[[Course], Values]] = {"inside": inside_person}
"""Series by frame; `inside` replaces the common one, which uses the ground truth's boxes."""


@measure("frames")
def frames_overlapping(course: Course) -> float:
    """Return the number of frames with an overlap of at least 0.5.

    The ground truth is the region that the tracker started from, so that the sizes agree.
    """
    return float((course.overlap >= SUCCESS_OVERLAP).sum())


@measure("frames")
def frames_before_loss(course: Course) -> float:
    """Return the number of frames before ten visible ones in a row are off the target."""
    return float(native.first_loss(course.on_target, course.present, course.truth.visibility))
