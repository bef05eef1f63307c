"""What becomes of pixels whose appearance has changed for good (NG-13)."""

import numpy as np
import pandas as pd

from bench.papers.nguyen2002.checks.follower import FEATURES, Follower
from bench.papers.nguyen2002.checks.made_up import Patch, wholly_seen
from datasets import Sequence
from trackers.templates.features import Features

__all__ = ["measure"]

RULES = {"on": True, "off": False}
CHANGE, LATER = 10, 20  # the change's frame, and frames from it on to the last
PART = np.array([0.25, 0.3, 0.5, 0.3])
"""What changes: x, y, width and height, in shares of the box; an eighth and a bit of it."""

QUICK_FEATURES: tuple[Features, ...] = ("invariants",)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `ng-13`; see `bench.papers.nguyen2002.checks`."""
    frames = CHANGE + LATER + 1
    part = wholly_seen(sequence, frames, frames)
    if part is None:
        return {}
    rows = [
        {"features": features, "rebootstrap": label} | _flagged(part, features, rule)
        for features in (QUICK_FEATURES if quick else FEATURES)
        for label, rule in RULES.items()
    ]
    return {"ng-13": pd.DataFrame(rows)}


def _flagged(part: Sequence, features: Features, rebootstrap: bool) -> dict[str, float]:
    """Shares that are outliers in the last frame."""
    follower = Follower(part[0], part.boxes[0], features, rebootstrap=rebootstrap)
    patch = Patch(part[0], part.boxes[0])
    for frame in range(1, len(part)):
        image, box = part[frame], part.boxes[frame]
        mask = np.zeros(image.shape[:2], np.bool_)
        if frame >= CHANGE:
            image, mask = patch.stuck_on(image, box, PART)
        view = follower.look(image)
        follower.take(view)
    changed = follower.on_template(mask, box)
    return {
        "flagged": float(view.seen.outliers[changed].mean()),
        "flagged_others": float(view.seen.outliers[~changed].mean()),
        "outliers": view.seen.share,
    }
