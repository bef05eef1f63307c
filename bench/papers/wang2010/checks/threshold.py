"""An adaptive threshold of the differences and fixed ones, by contrast and noise (WA-6)."""

import numpy as np
import pandas as pd

from bench.papers.scenes import with_contrast, with_noise
from bench.papers.wang2010.checks.motion import MovingThings, averaged, found, latest
from bench.papers.wang2010.plain import threshold
from datasets import Sequence

__all__ = ["measure"]

FRAMES = 6
WINDOW = 5
CONTRASTS = (1.0, 0.5, 0.25)
NOISES = (0.0, 4.0, 8.0)  # deviations of what is added [grey levels]
FACTORS = (2.0, 3.0, 4.0, 5.0, 6.0)  # λ
LEVELS = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0)
"""Fixed thresholds: mean absolute difference of a pixel of the window [grey levels]."""


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-6`; see `bench.papers.wang2010.checks`."""
    generator = np.random.default_rng(0)
    things = MovingThings(sequence)
    rows = []
    for frame in things.frames(1 if quick else FRAMES):
        for contrast in CONTRASTS:
            views = [with_contrast(image, contrast) for image in latest(sequence, frame)]
            for noise in NOISES:
                image, previous, earlier = (with_noise(view, noise, generator) for view in views)
                difference = averaged((image, previous, earlier), WINDOW)
                grey_levels = difference / (3 * WINDOW**2)
                labels = {"contrast": contrast, "noise": noise}
                for factor in FACTORS:
                    marked = difference > threshold(difference, factor)
                    rule = {"rule": "adaptive", "level": factor}
                    rows.append(rule | labels | found(marked, things[frame]))
                for level in LEVELS:
                    rule = {"rule": "fixed", "level": level}
                    rows.append(rule | labels | found(grey_levels > level, things[frame]))
    if not rows:
        return {"wa-6": pd.DataFrame()}
    table = pd.DataFrame(rows)
    means = table.groupby(["rule", "level", "contrast", "noise"], as_index=False).mean()
    return {"wa-6": means.assign(best=_is_best(means))}


def _is_best(table: pd.DataFrame) -> "pd.Series[float]":
    """1 for that level of each rule whose mean F1 over all contrasts and noises is greatest."""
    means = table.groupby(["rule", "level"])["f1"].mean()
    best = means.groupby("rule").idxmax()
    keys = pd.Series(list(zip(table["rule"], table["level"], strict=True)), table.index)
    return keys.isin(best.tolist()).astype(float)
