"""What the shape makes of the colours' posterior map (MO-11), over all frames and by contrast."""

import numpy as np
import pandas as pd

from bench.evaluation.record import Run
from bench.metrics.regions import region_similarity
from bench.papers.moreno2005.checks.colours import contrast
from bench.papers.short_runs import runs
from datasets import Sequence
from trackers.contours.contour.outline import filled

__all__ = ["QUARTERS", "by_contrast", "frame_rows", "measure"]

PRESETS = ("as-written", "recommended", "robust")
QUARTERS = ("least", "less", "more", "most")
QUICK_FRAMES = 20


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `mo-11`; see `bench.papers.moreno2005.checks`."""
    if quick:
        sequence = sequence[:QUICK_FRAMES]
    found = runs(sequence, [f"moreno2005:preset={preset}" for preset in PRESETS])
    tables = [
        by_contrast(frame_rows(sequence, run)).assign(preset=preset)
        for preset, run in zip(PRESETS, found, strict=True)
    ]
    return {"mo-11": pd.concat(tables, ignore_index=True)}


def frame_rows(sequence: Sequence, run: Run) -> pd.DataFrame:
    """J of every mask in every frame that a run with arrays has.

    Returns
    -------
    DataFrame
        `mask`, `frame`, `distance` (see `contrast`), `region_similarity`.
    """
    rows = []
    for frame, arrays in run.arrays.items():
        truth = sequence.mask(frame)
        if truth is None or not truth.any() or "mask" not in arrays:
            continue
        distance = contrast(sequence[frame], truth)
        masks = {
            "contour": arrays["mask"],
            "mean contour": filled(arrays["mean_contour"].astype(np.float64), *truth.shape),
            "posterior map": arrays["posterior"] > 0.5,
        }
        rows += [
            {
                "mask": name,
                "frame": frame,
                "distance": distance,
                "region_similarity": region_similarity(mask, truth),
            }
            for name, mask in masks.items()
        ]
    return pd.DataFrame(rows)


def by_contrast(frames: pd.DataFrame) -> pd.DataFrame:
    """Means over all frames, and over quarters of them by contrast.

    Parameters
    ----------
    frames : DataFrame
        See `frame_rows`.

    Returns
    -------
    DataFrame
        `mask`, `contrast`, `distance`, `region_similarity`.
    """
    ranks = frames.groupby("mask")["distance"].rank(method="first", pct=True)
    quarter = np.minimum((ranks * len(QUARTERS) - 1e-9).astype(int), len(QUARTERS) - 1)
    parts = [
        frames.assign(contrast="all"),
        frames.assign(contrast=np.array(QUARTERS, object)[quarter]),
    ]
    means = pd.concat(parts).groupby(["mask", "contrast"], sort=False)
    return means[["distance", "region_similarity"]].mean().reset_index()
