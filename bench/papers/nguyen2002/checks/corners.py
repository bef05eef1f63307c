"""Whether what of a template is background is told by its outliers (NG-12)."""

import numpy as np
import pandas as pd

from bench.papers.nguyen2002.checks.follower import FEATURES, Follower
from bench.papers.nguyen2002.checks.made_up import wholly_seen
from datasets import Sequence, SequenceError
from trackers.base.interface import Mask
from trackers.templates.features import Features

__all__ = ["measure"]

LEAST, MOST = 15, 60  # frames
SETTLED = 5  # frames before any counts
LEAST_BACKGROUND = 0.1  # share of the template
QUICK_FEATURES: tuple[Features, ...] = ("invariants",)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `ng-12`; see `bench.papers.nguyen2002.checks`."""
    part = wholly_seen(sequence, LEAST, LEAST if quick else MOST)
    if part is None:
        return {}
    rows = []
    for features in QUICK_FEATURES if quick else FEATURES:
        follower = Follower(part[0], part.boxes[0], features)
        background = 1 - float(_target(follower, part, 0).mean())
        if background < LEAST_BACKGROUND:
            return {}
        corners, inside = _flagged(follower, part)
        for label, flagged in {"corners": corners, "three times inside": 3 * inside}.items():
            row = {"features": features, "part": label, "background": background}
            rows.append(row | {"flagged": flagged})
    return {"ng-12": pd.DataFrame(rows)}


def _flagged(follower: Follower, part: Sequence) -> tuple[float, float]:
    """Mean shares of outliers among pixels that show the background, and the target."""
    shares = []
    for frame in range(1, len(part)):
        view = follower.look(part[frame])
        follower.take(view)
        if frame >= SETTLED:
            target, outliers = _target(follower, part, frame), view.seen.outliers
            shares.append((outliers[~target].mean(), outliers[target].mean()))
    corners, inside = np.mean(shares, axis=0).tolist()
    return corners, inside


def _target(follower: Follower, part: Sequence, frame: int) -> Mask:
    mask = part.mask(frame)
    if mask is None:
        raise SequenceError(f"{part.name}, {part.frame_name(frame)}: there is no mask.")
    return follower.on_template(mask, part.boxes[frame])
