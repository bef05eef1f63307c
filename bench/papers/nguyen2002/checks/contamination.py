"""What a short partial occlusion leaves in the template, with the gate and without (NG-11)."""

import numpy as np
import pandas as pd

from bench.metrics.centre_error import centre_error
from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.checks.follower import FEATURES, Follower
from bench.papers.nguyen2002.checks.made_up import Patch, wholly_seen
from datasets import Sequence
from trackers.templates.features import Features

__all__ = ["measure"]

GATES = {"on": True, "off": False}
BEFORE, AFTER = 10, 5  # frames without occlusion
DURATIONS = {
    "ng-11": 5,
    "ng-11-longer": 15,
}  # frames: as long as pixels may be outliers, and longer
COVERAGE = 0.2  # of the target, below gamma
QUICK_FEATURES: tuple[Features, ...] = ("invariants",)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `ng-11` and `ng-11-longer`; see `bench.papers.nguyen2002.checks`."""
    least = BEFORE + max(DURATIONS.values()) + AFTER + 1
    part = wholly_seen(sequence, least, least)
    if part is None:
        return {}
    return {
        table: pd.DataFrame(
            {"features": features, "gate": label, **_course(part, features, gate, duration)}
            for features in (QUICK_FEATURES if quick else FEATURES)
            for label, gate in GATES.items()
        )
        for table, duration in DURATIONS.items()
    }


def _course(part: Sequence, features: Features, gate: bool, duration: int) -> dict[str, float]:
    follower = Follower(part[0], part.boxes[0], features, gate=gate)
    patch = Patch(part[0], part.boxes[0])
    begin, end = BEFORE, BEFORE + duration
    boxes, visible, covered = [], [], []
    for frame in range(1, end + AFTER):
        image, box = part[frame], part.boxes[frame]
        shown, mask = patch.slid_over(image, box, COVERAGE if begin <= frame < end else 0.0)
        view = follower.look(shown)
        follower.take(view)
        if frame < begin:
            continue
        boxes.append(follower.box(view.pose))
        errors = follower.errors(part[frame + 1], part.boxes[frame + 1])
        hidden = follower.on_template(mask, box)
        visible.append(errors[~hidden].mean())
        if frame < end:
            covered.append(errors[hidden].mean())
    truth = part.boxes[begin : end + AFTER]
    return {
        "template_error": float(np.mean(visible)),
        "covered_error": float(np.mean(covered)),
        "overlap": float(overlap(truth, np.array(boxes)).mean()),
        "centre_error": float(centre_error(truth, np.array(boxes)).mean()),
    }
