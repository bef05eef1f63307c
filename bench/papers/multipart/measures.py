"""Measures of the multi-part paper, with the whole person as the target."""

from collections.abc import Callable

import numpy as np

from trackmark.bench.metrics import native
from trackmark.bench.metrics.centre_error import centre_inside
from trackmark.bench.metrics.native import SUCCESS_OVERLAP
from trackmark.bench.papers.measures import JudgedRun, Values, measure

PERSON = "full"
"""Ground-truth region of the whole person."""


def inside_person(judged: JudgedRun) -> Values:
    """Return 1 in frames with the centre inside the whole person's rectangle, else 0, shape (n,).

    The rectangle does not depend on the tracker's init box.
    """
    return np.asarray(centre_inside(judged.truth.regions[PERSON], judged.boxes), np.float64)


SERIES: dict[str, Callable[[JudgedRun], Values]] = {"inside": inside_person}
"""Series by frame. `inside` replaces the common series, which uses the region of the init box."""


@measure("frames")
def frames_overlapping(judged: JudgedRun) -> float:
    """Return the number of frames with an overlap of at least 0.5.

    Ground truth is the region of the tracker's init box.
    """
    return float((judged.overlap >= SUCCESS_OVERLAP).sum())


@measure("frames")
def frames_before_loss(judged: JudgedRun) -> float:
    """Return the number of frames before ten consecutive visible frames off the target."""
    return float(native.first_loss(judged.on_target, judged.present, judged.truth.visibility))
