"""The clean definitions, which a perfect tracker scores 1 by.

Evaluated are the frames after the one of initialisation in which the target is present; absent
frames are neither hits nor misses, and a malformed box is a miss. Overlap is that of exact boxes,
success an overlap of 0.5 or more. Each sequence counts once. Agrees with nobody: see
`bench.metrics.native`.
"""

import numpy as np

from trackmark.bench.metrics.native import Truth, native
from trackmark.bench.metrics.preset import Answer, Column, Judged, Preset


def judge(truth: Truth, answer: Answer) -> Judged:
    """Return the scores of a run; there are no curves, as they need no thresholds."""
    return Judged(native(truth, np.asarray(answer.boxes, np.float64), answer.visible), {})


PRESET = Preset(
    columns={
        "evaluated_frames": Column("frames that count", None, None),
        "mean_overlap": Column("mean overlap, the area under the exact success curve"),
        "success_frames": Column("frames with an overlap of 0.5 or more", None),
        "success_share": Column("share of these frames"),
        "frames_inside": Column("frames with the estimated centre inside the truth", None),
        "inside_share": Column("share of these frames"),
        "first_loss": Column("first of 10 visible frames with the centre outside", None),
        "centre_error": Column("mean distance of the centres [px]", 0.0, "lower"),
        "centre_error_median": Column("median of this distance [px]", 0.0, "lower"),
        "centre_error_p90": Column("90th percentile of this distance [px]", 0.0, "lower"),
        "normalised_centre_error": Column("mean distance in diagonals of the truth", 0.0, "lower"),
        "malformed": Column("frames with a box that is none", 0.0, "lower"),
        "absent_frames": Column("frames without target", None, None),
        "absence_reported": Column("share of these reported as not visible", None),
    },
    judge=judge,
)
