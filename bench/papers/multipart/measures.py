"""Measures of the multi-part paper, with the whole person as the target."""

import numpy as np

from trackmark.bench.metrics.boxes import centre_inside
from trackmark.bench.metrics.sets.native import SUCCESS_OVERLAP, first_loss
from trackmark.bench.papers.measures import MeasuredRun, Values, measure

PERSON = "full"
"""Ground-truth region of the whole person."""


def inside_person(measured: MeasuredRun) -> Values:
    """Return 1 in frames with the centre inside the whole person's rectangle, else 0, shape (n,).

    The rectangle does not depend on the tracker's init box.
    """
    return np.asarray(centre_inside(measured.truth.regions[PERSON], measured.boxes), np.float64)


@measure("frames")
def frames_overlapping(measured: MeasuredRun) -> float:
    """Return the number of frames with an overlap of at least 0.5.

    Ground truth is the region of the tracker's init box.
    """
    return float((measured.overlap >= SUCCESS_OVERLAP).sum())


@measure("frames")
def frames_before_loss(measured: MeasuredRun) -> float:
    """Return the number of frames before ten consecutive visible frames off the target."""
    return float(first_loss(measured.on_target, measured.present, measured.truth.visibility))
