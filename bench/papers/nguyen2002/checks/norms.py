"""Where a target that is partly covered is found, by the norm of the matching error (NG-19)."""

import numpy as np
import pandas as pd

from bench.metrics.centre_error import centre_error
from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.checks.follower import FEATURES, Follower
from bench.papers.nguyen2002.checks.made_up import Patch, wholly_seen
from datasets import Sequence
from trackers.templates.features import Features

__all__ = ["measure"]

NORMS = ("huber", "quadratic")
COVERAGES = (0.1, 0.15, 0.2, 0.25)  # shares of the target
BEFORE, DURING = 10, 10  # frames
QUICK_FEATURES: tuple[Features, ...] = ("invariants",)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `ng-19`; see `bench.papers.nguyen2002.checks`."""
    part = wholly_seen(sequence, BEFORE + DURING, BEFORE + DURING)
    if part is None:
        return {}
    rows = [
        {"features": features, "norm": norm, "coverage": coverage}
        | _course(part, features, norm, coverage)
        for features in (QUICK_FEATURES if quick else FEATURES)
        for norm in NORMS
        for coverage in COVERAGES
    ]
    return {"ng-19": pd.DataFrame(rows)}


def _course(part: Sequence, features: Features, norm: str, coverage: float) -> dict[str, float]:
    follower = Follower(part[0], part.boxes[0], features, norm=norm)
    patch = Patch(part[0], part.boxes[0])
    found = []
    for frame in range(1, len(part)):
        image, box = part[frame], part.boxes[frame]
        shown, _ = patch.slid_over(image, box, coverage if frame >= BEFORE else 0.0)
        view = follower.look(shown)
        follower.take(view)
        if frame >= BEFORE:
            found.append(follower.box(view.pose))
    truth, boxes = part.boxes[BEFORE:], np.array(found)
    return {
        "centre_error": float(centre_error(truth, boxes).mean()),
        "overlap": float(overlap(truth, boxes).mean()),
    }
