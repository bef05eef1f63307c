"""Whether the observation function tells particles on the target from others (WA-29)."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.scenes import short_runs
from datasets import Sequence

__all__ = ["measure", "on_against_off"]

PRESETS = ("as-written", "recommended")

Array = NDArray[np.float64]

TRACKERS = ("wang2010", "particle-filter")
QUICK_FRAMES = 20


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-29`; see `bench.papers.wang2010.checks`."""
    part = sequence[:QUICK_FRAMES] if quick else sequence
    labels = [{"tracker": tracker, "preset": preset} for tracker in TRACKERS for preset in PRESETS]
    found = short_runs(part, [f"{one['tracker']}:preset={one['preset']}" for one in labels])
    rows = [
        {
            **label,
            "frame": frame,
            "effective_share": float(run.details["effective_sample_size"][frame]),
            "weight_ratio": float(run.details["weight_ratio"][frame]),
        }
        | on_against_off(
            run.arrays[frame]["particles"], run.arrays[frame]["weights"], part.boxes[frame]
        )
        for label, run in zip(labels, found, strict=True)
        for frame in range(1, len(part))
    ]
    return {"wa-29": pd.DataFrame(rows)}


def on_against_off(particles: Array, weights: Array, box: Array) -> dict[str, float]:
    """How many particles are on the target, and how their weight compares with the others'.

    Parameters
    ----------
    particles : ndarray of float64, shape (n, 2)
        Centres [pixels].
    weights : ndarray of float64, shape (n,)
        Not negative.
    box : ndarray of float64, shape (4,)
        The target's.

    Returns
    -------
    dict of str to float
        `on_target` (share) and `on_over_off` (mean weight over mean weight; NaN where there are
        none of either).
    """
    on = ((particles >= box[:2]) & (particles < box[:2] + box[2:])).all(axis=1)
    both = on.any() and not on.all()
    ratio = float(weights[on].mean() / weights[~on].mean()) if both else np.nan
    return {"on_target": float(on.mean()), "on_over_off": ratio}
