"""State noise, gain and template while light or orientation change (NG-14)."""

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.nguyen2002.checks.follower import FEATURES, Follower
from bench.papers.nguyen2002.checks.made_up import clear_frames, dimmed, turned, wholly_seen
from datasets import Sequence
from trackers.base.interface import Box, Image
from trackers.templates.appearance import Seen
from trackers.templates.features import Features

__all__ = ["gain_of", "measure"]

Array = NDArray[np.float64]

NOISES = {"on": True, "off": False}
BEFORE, DURING = 25, 15  # frames
SETTLED = 15  # frames before any counts: the first covariance must have left the mean of K = 10
LEAST_LIGHT = 0.6
MOST_TURN = 12.0  # degrees
QUICK_FEATURES: tuple[Features, ...] = ("rgb", "invariants")

Change = Callable[[Image, Box, float], Image]


def _dim(image: Image, box: Box, progress: float) -> Image:
    return dimmed(image, 1 - progress * (1 - LEAST_LIGHT))


def _turn(image: Image, box: Box, progress: float) -> Image:
    return turned(image, box, progress * MOST_TURN)


def _nothing(image: Image, box: Box, progress: float) -> Image:
    return image


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `ng-14`; see `bench.papers.nguyen2002.checks`."""
    cases: list[tuple[str, Sequence, Change]] = []
    part = wholly_seen(sequence, BEFORE + DURING, BEFORE + DURING)
    if part is not None:
        cases += [("dimming", part, _dim), ("turning", part, _turn)]
    cases += [(label, there, _nothing) for label, there in _switches(sequence)]
    rows = [
        {"change": label, "features": features, "adaptive": noise, **row}
        for label, there, change in cases
        for features in (QUICK_FEATURES if quick else FEATURES)
        for noise, adaptive in NOISES.items()
        for row in _phases(there, features, adaptive, change)
    ]
    return {"ng-14": pd.DataFrame(rows)}


def _switches(sequence: Sequence) -> list[tuple[str, Sequence]]:
    """Parts about the frames in which a lamp is switched, the target being wholly seen."""
    lamp = sequence.attributes.get("lamp off")
    if lamp is None:
        return []
    parts, clear = [], clear_frames(sequence)
    for frame in np.flatnonzero(lamp[1:] != lamp[:-1]) + 1:
        part = sequence[max(0, frame - BEFORE) : frame + DURING]
        if len(part) == BEFORE + DURING and clear[frame - BEFORE : frame + DURING].all():
            parts.append((f"lamp {'off' if lamp[frame] else 'on'}", part))
    return parts


def _phases(
    part: Sequence, features: Features, adaptive: bool, change: Change
) -> list[dict[str, str | float]]:
    """Means before and during a change."""
    follower = Follower(part[0], part.boxes[0], features, adaptive_noise=adaptive)
    images = [
        change(image, box, max(0, frame - BEFORE + 1) / DURING)
        for frame, (image, box) in enumerate(zip(part, part.boxes, strict=True))
    ]
    seen = []
    for frame in range(1, len(part) - 1):
        view, before = follower.look(images[frame]), follower.appearance.template.copy()
        follower.take(view)
        appearance = follower.appearance
        seen.append(
            {
                "state_noise": np.trace(appearance.state) / np.trace(appearance.residual),
                "gain": gain_of(view.seen, before, appearance.template),
                "template_error": follower.errors(images[frame + 1], part.boxes[frame + 1]).mean(),
            }
        )
    courses = pd.DataFrame(seen, index=range(1, len(part) - 1))
    phases = {"before": courses.loc[SETTLED : BEFORE - 1], "change": courses.loc[BEFORE:]}
    return [
        {"phase": phase, **{str(name): value for name, value in rows.mean().items()}}
        for phase, rows in phases.items()
    ]


def gain_of(seen: Seen, before: Array, after: Array) -> float:
    """Mean eigenvalue of K (equation 9), by how far inliers moved towards what was seen.

    Parameters
    ----------
    seen : Seen
        What was taken into the template.
    before, after : ndarray of float64, shape (height, width, d)
        The template.
    """
    inliers = ~seen.outliers
    residuals = (seen.features - before)[inliers]
    gain, *_ = np.linalg.lstsq(residuals, (after - before)[inliers])
    return float(np.trace(gain)) / len(gain)
