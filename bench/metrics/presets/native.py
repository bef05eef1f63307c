"""Scores that follow no toolkit; a perfect tracker scores 1.

The frames with a target after the initialisation are evaluated. Absent frames are neither hits nor
misses, and a malformed box is a miss. Overlaps are those of exact boxes, and success is an overlap
of 0.5 or more. All sequences have equal weights. No toolkit computes the same scores; see
`bench.metrics.native`.
"""

import numpy as np

from trackmark.bench.metrics.native import GroundTruthLike, native
from trackmark.bench.metrics.preset import Column, Preset, PresetResult, RunEstimates


def score_run(truth: GroundTruthLike, estimates: RunEstimates) -> PresetResult:
    """Return the scores of a run; the preset has no thresholds and thus no curves."""
    return PresetResult(
        native(truth, np.asarray(estimates.boxes, np.float64), estimates.visible), {}
    )


PRESET = Preset(
    columns={
        "evaluated_frames": Column("evaluated frames", None, None),
        "mean_overlap": Column("mean overlap, the area under the exact success curve"),
        "success_frames": Column("frames with an overlap of 0.5 or more", None),
        "success_share": Column("share of frames with an overlap of 0.5 or more"),
        "frames_inside": Column("frames with the estimated centre in the ground-truth box", None),
        "inside_share": Column("share of frames with the centre in the ground-truth box"),
        "first_loss": Column(
            "first of 10 consecutive visible frames with the centre outside", None
        ),
        "centre_error": Column("mean distance of the centres [px]", 0.0, "lower"),
        "centre_error_median": Column("median distance of the centres [px]", 0.0, "lower"),
        "centre_error_p90": Column("90th percentile of the distance [px]", 0.0, "lower"),
        "normalised_centre_error": Column(
            "mean distance of the centres [diagonals of the box]", 0.0, "lower"
        ),
        "malformed": Column("frames with a malformed box", 0.0, "lower"),
        "absent_frames": Column("frames without target", None, None),
        "absence_reported": Column(
            "share of the frames without target in which its absence is reported", None
        ),
    },
    score=score_run,
)
