"""Whether mean shift moves the particles towards the target (WA-11)."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.metrics.centre_error import centre_inside, centres
from bench.papers.scenes import short_runs
from datasets import Sequence

__all__ = ["drifted", "measure"]

PRESETS = ("as-written", "recommended")

Array = NDArray[np.float64]

QUICK_FRAMES = 20


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-11`; see `bench.papers.wang2010.checks`."""
    part = sequence[:QUICK_FRAMES] if quick else sequence
    middles = centres(sequence.boxes)
    rows: list[dict[str, str | float]] = []
    found = short_runs(part, [f"wang2010:preset={preset}" for preset in PRESETS])
    for preset, run in zip(PRESETS, found, strict=True):
        for frame in range(1, len(part)):
            inside = float(centre_inside(part.boxes[frame], run.boxes[frame])[0])
            labels: dict[str, str | float] = {"preset": preset, "frame": frame, "inside": inside}
            rows += [labels | row for row in drifted(run.arrays[frame], middles[frame])]
    return {"wa-11": pd.DataFrame(rows)}


def drifted(arrays: Mapping[str, Array], target: Array) -> list[dict[str, str | float]]:
    """Particles before and after the drift.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        Of an estimate: `predicted`, `particles` (shape (n, 2)), `predicted_similarity` and
        `similarity` (shape (n,)).
    target : ndarray of float64, shape (2,)
        True centre [pixels].

    Returns
    -------
    list of dict
        Columns of `wa-11`.
    """
    before, after = arrays["predicted_similarity"], arrays["similarity"]
    shares = {"risen": float(np.mean(after > before)), "fallen": float(np.mean(after < before))}
    nothing = dict.fromkeys(shares, np.nan)
    return [
        {"stage": "predicted"} | _cloud(arrays["predicted"], before, target) | nothing,
        {"stage": "drifted"} | _cloud(arrays["particles"], after, target) | shares,
    ]


def _cloud(places: Array, similarity: Array, target: Array) -> dict[str, float]:
    offsets = places - places.mean(axis=0)
    return {
        "distance": float(np.hypot(*(places - target).T).mean()),
        "spread": float(np.sqrt((offsets**2).sum(axis=1).mean())),
        "similarity": float(similarity.mean()),
    }
