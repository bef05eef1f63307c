"""Criteria of the multipart scenes, computed from the margins of `margins.py`."""

import numpy as np

from trackmark.bench.papers.criteria import margins
from trackmark.bench.papers.criteria.shared import SceneImages, box_mask, longest_stretch


def right_choice(scene: SceneImages, *, two_coloured: bool) -> float:
    """Return the share of jittered init boxes for which Eq. 7 selects the right representation."""
    frame = scene.sequence.first_frame
    box = scene.sequence.regions["full"][frame]
    return margins.right_choice(scene.image(frame), box, two_coloured)


def low_margin_share(scene: SceneImages, *, parts: int, below: float, until: float = 1.0) -> float:
    """Return the share of frames with a margin below a limit, before `until` times the length."""
    frames, values = margins.margins(scene.sequence)
    return float((values[parts - 1][frames < until * len(scene)] < below).mean())


def low_margin_stretch(scene: SceneImages, *, parts: int, below: float) -> float:
    """Return the longest run of measured frames with a margin below a limit [frames]."""
    frames, values = margins.margins(scene.sequence)
    step = margins.sampled_frames(len(scene))[1]
    low = np.zeros(len(scene) // step + 1, bool)
    low[frames // step] = values[parts - 1] < below
    return float(max(longest_stretch(low) - 1, 0) * step + 1)


def crossing_time(scene: SceneImages, *, after: float) -> float:
    """Return the time of strongest occlusion after `after`, both as parts of the length."""
    first = round(after * len(scene))
    return float((first + scene.visibility[first:].argmin()) / len(scene))


def crossing_margin(scene: SceneImages, *, after: float) -> float:
    """Return the smallest margin of the single histogram after `after`, a part of the length."""
    frames = tuple(range(round(after * len(scene)), len(scene), 2))
    return float(margins.margins(scene.sequence, frames)[1][0].min())


def background_in_person(scene: SceneImages) -> float:
    """Return the share of the person's first rectangle that does not show the target."""
    frame = scene.sequence.first_frame
    inside = box_mask(scene.mask(frame).shape, scene.sequence.regions["full"][frame])
    return float(1.0 - (scene.mask(frame) & inside).sum() / inside.sum())
