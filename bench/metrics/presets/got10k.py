"""Average overlap and success rates as the GOT-10k toolkit has them.

The first frame does not count, nor do frames in which nothing of the target is visible; unknown
visibility counts as visible. Boxes are cut off at the image as the toolkit does it: one that begins
left of or above the image is moved in, not cut. AO is the mean overlap over all frames of all
sequences and repetitions, so that long sequences count for more; SR50 and SR75 are shares of these
frames with an overlap above 0.5 and 0.75. A malformed box is a miss. Huang, Zhao, Huang, "GOT-10k:
a large high-diversity benchmark for generic object tracking in the wild", TPAMI 2021.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.curves import shares
from trackmark.bench.metrics.native import Truth
from trackmark.bench.metrics.overlap import is_well_formed, overlap
from trackmark.bench.metrics.preset import Answer, Axes, Column, Judged, Preset, Runs, started

_THRESHOLDS = np.linspace(0, 1, 101)


def judge(truth: Truth, answer: Answer) -> Judged:
    """Return scores and curve of a run."""
    run = started(truth, answer)
    t, e = run.truth, run.estimate
    visibility = np.broadcast_to(truth.visibility, len(truth.boxes))[run.frames]
    counted = run.present & ~(visibility <= 0)
    counted[0] = False
    t, e = t[counted], e[counted]
    if run.size is not None:
        good = is_well_formed(e)
        t, e = _moved_in(t, run.size), np.where(good[:, None], _moved_in(e, run.size), 0.0)
    return _judged(overlap(t, e))


def combine(runs: Runs) -> Judged:
    """Return the scores over all frames of all runs."""
    return _judged(np.concatenate([run.evidence["overlaps"] for of in runs for run in of]))


def _judged(overlaps: NDArray[np.float64]) -> Judged:
    success = shares(overlaps, _THRESHOLDS, above=True)
    known = len(overlaps) > 0
    scores = {
        "ao": float(overlaps.mean()) if known else np.nan,
        "sr50": float(success[50, 1]),
        "sr75": float(success[75, 1]),
    }
    return Judged(scores, {"success": success}, {"overlaps": overlaps})


def _moved_in(boxes: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.float64]:
    corner = np.clip(boxes[:, :2], 0, size)
    return np.column_stack([corner, np.clip(boxes[:, 2:], 0, size - corner)])


PRESET = Preset(
    columns={
        "ao": Column("average overlap"),
        "sr50": Column("share of frames with an overlap above 0.5"),
        "sr75": Column("share of frames with an overlap above 0.75"),
    },
    judge=judge,
    combine=combine,
    curves={"success": Axes("overlap threshold", "share of frames")},
    agrees="got10k's ExperimentGOT10k",
)
