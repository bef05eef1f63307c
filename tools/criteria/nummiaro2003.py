"""Criteria of the nummiaro2003 scenes."""

import numpy as np
from numpy.typing import NDArray

from tools.criteria.shared import (
    SceneImages,
    bhattacharyya,
    box_mask,
    colour_histogram,
)


def occlusions(visibility: NDArray[np.float64], visible: float) -> list[tuple[int, int]]:
    """Return first frame and end of the occlusions with less than `visible` of the target visible.

    The target is visible before and after an occlusion. Entering and leaving the view do not count.
    """
    seen = np.flatnonzero(visibility >= visible)
    gaps = np.flatnonzero(np.diff(seen) > 1)
    return [(int(seen[gap]) + 1, int(seen[gap + 1])) for gap in gaps]


def tree_occlusion(visibility: NDArray[np.float64], visible: float) -> tuple[int, int]:
    """Return first frame and end of the longest occlusion, which is the occlusion by the tree."""
    return max(occlusions(visibility, visible), key=lambda stretch: stretch[1] - stretch[0])


def frame_after_tree(visibility: NDArray[np.float64]) -> int:
    """Return the first frame after the tree in which the target is fully visible (>= 0.99).

    After this frame only the short occlusions follow.
    """
    _, end = tree_occlusion(visibility, 0.5)
    return end + int(np.argmax(visibility[end:] >= 0.99))


def short_occlusions(scene: SceneImages) -> list[tuple[int, int]]:
    """Return the occlusions after the tree in which less than half of the target is visible."""
    start = frame_after_tree(scene.visibility)
    return [stretch for stretch in occlusions(scene.visibility, 0.5) if stretch[0] > start]


def tree_frames(scene: SceneImages, *, visible: float) -> float:
    """Return the number of frames at the tree with less than `visible` of the target visible."""
    start, end = tree_occlusion(scene.visibility, visible)
    return float(end - start)


def least_visible_at_tree(scene: SceneImages) -> float:
    """Return the smallest visible share of the target at the tree."""
    start, end = tree_occlusion(scene.visibility, 0.5)
    return float(scene.visibility[start:end].min())


def number_of_short_occlusions(scene: SceneImages) -> float:
    """Return the number of occlusions after the tree that hide more than half of the target."""
    return float(len(short_occlusions(scene)))


def longest_short_occlusion(scene: SceneImages) -> float:
    """Return the length of the longest short occlusion after the tree [frames]."""
    return float(max((end - start for start, end in short_occlusions(scene)), default=0))


def frames_before_short_occlusions(scene: SceneImages) -> float:
    """Return the number of frames from `frame_after_tree` to the first short occlusion."""
    first = min((start for start, _ in short_occlusions(scene)), default=0)
    return float(first - frame_after_tree(scene.visibility))


def hider_distance(scene: SceneImages, stretch: tuple[int, int]) -> float:
    """Return the Bhattacharyya distance between the colours of target and occluder.

    The target's colours are those of its first frame. The occluder's colours are those of the
    pixels in the middle half of the box that do not show the target, in the frame with the smallest
    visible share.
    """
    frame = stretch[0] + int(np.argmin(scene.visibility[stretch[0] : stretch[1]]))
    middle = box_mask(scene.mask(frame).shape, scene.boxes[frame], 0.5)
    hider = scene.image(frame)[middle & ~scene.mask(frame)]
    target = scene.target_colours(scene.sequence.first_frame)
    return bhattacharyya(colour_histogram(target), colour_histogram(hider))


def distance_of_students(scene: SceneImages) -> float:
    """Return the smaller of the distances between the colours of the target and each occluder."""
    return min((hider_distance(scene, stretch) for stretch in short_occlusions(scene)), default=0.0)


def distance_of_tree(scene: SceneImages) -> float:
    """Return the distance between the colours of the target and of the tree that occludes it."""
    return hider_distance(scene, tree_occlusion(scene.visibility, 0.5))


def changed_share(scene: SceneImages, *, distance: float, step: int = 5) -> float:
    """Return the share of frames with a histogram at least `distance` from the first one."""
    first = colour_histogram(scene.target_colours(scene.sequence.first_frame))
    changes = [
        bhattacharyya(first, colour_histogram(scene.target_colours(frame)))
        for frame in range(scene.sequence.first_frame, len(scene), step)
    ]
    return float(np.mean(np.array(changes) >= distance))


def attribute_share(scene: SceneImages, *, attribute: str) -> float:
    """Return the share of frames that have an attribute."""
    return float(scene.sequence.attributes[attribute].mean())
