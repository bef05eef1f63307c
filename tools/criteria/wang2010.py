"""Criteria of the wang2010 scenes. Options count frames from 1, as the paper does."""

from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from tools.criteria.shared import SceneImages, ring_distance


def upward_speed(scene: SceneImages, *, first: int, last: int) -> float:
    """Return the mean upward speed of the steps to frames `first` to `last` [px/frame]."""
    rows = scene.centres[:, 1]
    return float((rows[first - 2] - rows[last - 1]) / (last - first + 1))


def velocity_changes(scene: SceneImages) -> NDArray[np.float64]:
    """Return by how much the step to each frame differs from the step before [px/frame].

    The first value belongs to frame 3.
    """
    changes = np.diff(scene.centres, n=2, axis=0)
    return np.asarray(np.hypot(changes[:, 0], changes[:, 1]))


def velocity_change(scene: SceneImages, *, frame: int) -> float:
    """Return the change of the target's velocity in one frame [px/frame]."""
    return float(velocity_changes(scene)[frame - 3])


def other_velocity_change(scene: SceneImages, *, frame: int) -> float:
    """Return the largest change of velocity in other frames, divided by the change in `frame`."""
    changes = velocity_changes(scene)
    return float(np.delete(changes, frame - 3).max() / changes[frame - 3])


def brightness_contrast(scene: SceneImages) -> float:
    """Return the median over frames of the target's mean (R + G + B) / 3 minus the background's."""
    differences = []
    for frame in range(len(scene)):
        grey, mask = scene.image(frame).mean(axis=2), scene.mask(frame)
        differences.append(grey[mask].mean() - grey[~mask].mean())
    return float(np.median(differences))


def motion_marks(scene: SceneImages, frame: int) -> NDArray[np.bool_]:
    """Return the pixels that the paper's motion map marks in a frame from 3 on (section 2.1.2)."""
    greys = [scene.image(frame - back).astype(int).sum(axis=2) for back in (1, 2, 3)]
    difference = sum(
        cv2.boxFilter(
            np.abs(later - earlier).astype(float),
            -1,
            (5, 5),
            normalize=False,
            borderType=cv2.BORDER_CONSTANT,
        )
        for later, earlier in pairwise(greys)
    )
    return np.asarray(difference > np.mean(difference) + 2 * np.std(difference))


def colour_weights(scene: SceneImages, frame: int) -> NDArray[np.float64]:
    """Return the colour map of a frame, by hue and saturation of the first box (section 2.1.1)."""
    left, top = scene.boxes[0, :2].round().astype(int)
    right, bottom = (scene.boxes[0, :2] + scene.boxes[0, 2:]).round().astype(int)
    bins, box_bins = (
        cv2.cvtColor(image, cv2.COLOR_BGR2HSV_FULL)[..., :2].astype(int) // 8
        for image in (scene.image(frame - 1), scene.image(0)[top:bottom, left:right])
    )
    counts = [np.bincount(box_bins[..., k].ravel(), minlength=32) for k in (0, 1)]
    hue, saturation = (counts[k][bins[..., k]] / counts[k].max() for k in (0, 1))
    return np.asarray(0.7 * hue + 0.3 * saturation)


def motion_marked_share(scene: SceneImages) -> float:
    """Return the share of the target that the motion map marks, mean over frames from 3 on."""
    shares = [
        motion_marks(scene, frame)[scene.mask(frame - 1)].mean()
        for frame in range(3, len(scene) + 1)
    ]
    return float(np.mean(shares))


def motion_map_on_target(scene: SceneImages, *, frame: int) -> float:
    """Return the share of the motion map (colour times motion) that lies on the target."""
    weights = colour_weights(scene, frame) * motion_marks(scene, frame)
    return float(weights[scene.mask(frame - 1)].sum() / weights.sum())


def surroundings_distance(scene: SceneImages, *, first: int, last: int) -> float:
    """Return the median over frames of the distance between the colours of target and ring."""
    return float(np.median([ring_distance(scene, k - 1) for k in range(first, last + 1)]))


def visible_deviation(scene: SceneImages, *, share: float, first: int, last: int) -> float:
    """Return the largest deviation of the visible share from `share`, frames `first` to `last`."""
    return float(np.abs(scene.visibility[first - 1 : last] - share).max())


def first_overlap(scene: SceneImages) -> float:
    """Return the first frame in which the boxes of hand and face overlap."""
    return float(np.argmax(scene.sequence.attributes["on the face"]) + 1)
