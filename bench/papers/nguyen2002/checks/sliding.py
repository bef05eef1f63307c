"""What an occluder does to the template until it is declared, by its speed (NG-16)."""

import numpy as np
import pandas as pd

from bench.papers.nguyen2002.checks.follower import FEATURES, Follower, true_pose
from bench.papers.nguyen2002.checks.made_up import Patch, wholly_seen
from datasets import Sequence
from trackers.base.interface import Box, Image
from trackers.templates.features import Features

__all__ = ["course_of", "measure", "measure_on_targets", "pale"]

RULES = ("exceeds", "reaches")
SPEEDS = (0.05, 0.06, 0.08)  # template widths a frame
BEFORE, DURING = 10, 20  # frames
QUICK_FEATURES: tuple[Features, ...] = ("invariants",)

FAINT, PALE = 0.4, 100.0
DARK_BLUE = (90, 0, 0)
"""Of no pixel whose levels are between 100 and 202, nor of any ratio or sum of these."""


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `ng-16`; see `bench.papers.nguyen2002.checks`."""
    images = [pale(sequence[0])] * (BEFORE + DURING)
    boxes = [sequence.boxes[0]] * len(images)
    patch = Patch(np.full_like(images[0], DARK_BLUE), boxes[0])
    rows = [
        {"features": features, "speed": speed}
        | course_of(images, boxes, patch, features, "exceeds", speed, matched=False)
        for features in (QUICK_FEATURES if quick else FEATURES)
        for speed in SPEEDS
    ]
    return {"ng-16": pd.DataFrame(rows)}


def measure_on_targets(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `ng-16-targets`; see `bench.papers.nguyen2002.checks`."""
    part = wholly_seen(sequence, BEFORE + DURING, BEFORE + DURING)
    if part is None:
        return {}
    images, boxes = list(part), list(part.boxes)
    patch = Patch(images[0], boxes[0])
    rows = [
        {"features": features, "rule": rule, "speed": speed}
        | course_of(images, boxes, patch, features, rule, speed, matched=True)
        for features in (QUICK_FEATURES if quick else FEATURES)
        for rule in RULES
        for speed in SPEEDS
    ]
    return {"ng-16-targets": pd.DataFrame(rows)}


def pale(image: Image) -> Image:
    """An image of little contrast, without anything dark."""
    return np.round(image * np.float32(FAINT) + np.float32(PALE)).astype(np.uint8)


def course_of(
    images: list[Image],
    boxes: list[Box],
    patch: Patch,
    features: Features,
    rule: str,
    speed: float,
    *,
    matched: bool,
) -> dict[str, float]:
    """Slide a patch over the target until an occlusion is declared, or everything is covered.

    Parameters
    ----------
    images : list of ndarray
        In which the target is wholly seen.
    boxes : list of ndarray
        The target's.
    patch : Patch
        What is slid over it after some frames.
    features, rule : str
        Parameters of the tracker; `rule` is its `outlier_rule`.
    speed : float
        Share of the target that is covered more in every frame.
    matched : bool
        Whether the template is matched, or held at the target's true place.

    Returns
    -------
    dict of str to float
        The last columns of `ng-16`.
    """
    follower = Follower(images[0], boxes[0], features, outlier_rule=rule)
    declared = False
    for frame, (image, box) in enumerate(zip(images, boxes, strict=True)):
        if frame == 0:
            continue
        share = min(1.0, max(0, frame - BEFORE + 1) * speed)
        shown, mask = patch.slid_over(image, box, share)
        place = true_pose(boxes[0], box)
        view = follower.look(shown) if matched else follower.compare(shown, place)
        declared = share > 0 and view.seen.share > follower.parameters.gamma
        if declared:
            break
        follower.take(view)
    covered = follower.on_template(mask, box)
    of_target, of_patch = (
        np.abs(follower.appearance.template - follower.truth(one, box)).mean(axis=2)
        for one in (image, shown)
    )
    return {
        "declared": float(declared),
        "coverage": float(covered.mean()),
        "contaminated": float(((of_patch < of_target) & covered).mean()),
    }
