"""Criteria of the nummiaro2003 scenes."""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.papers.criteria.shared import (
    SceneImages,
    bhattacharyya,
    box_mask,
    colour_histogram,
)


def occlusions(visibility: NDArray[np.float64], visible: float) -> list[tuple[int, int]]:
    """Stretches of frames (first, end) with less than `visible` of the target seen.

    The target is seen before and after each of them: entering and leaving the view do not count.
    """
    seen = np.flatnonzero(visibility >= visible)
    gaps = np.flatnonzero(np.diff(seen) > 1)
    return [(int(seen[gap]) + 1, int(seen[gap + 1])) for gap in gaps]


def tree_occlusion(visibility: NDArray[np.float64], visible: float) -> tuple[int, int]:
    """Longest of the `occlusions`, that by the tree: first frame and end."""
    return max(occlusions(visibility, visible), key=lambda stretch: stretch[1] - stretch[0])


def frame_after_tree(visibility: NDArray[np.float64]) -> int:
    """First frame after the longest occlusion in which the target is wholly visible (>= 0.99).

    A tracker that starts there meets the short occlusions only: `sequence[frame:]`.
    """
    _, end = tree_occlusion(visibility, 0.5)
    return end + int(np.argmax(visibility[end:] >= 0.99))


def short_occlusions(scene: SceneImages) -> list[tuple[int, int]]:
    """Occlusions after the tree's with less than half of the target seen."""
    start = frame_after_tree(scene.visibility)
    return [stretch for stretch in occlusions(scene.visibility, 0.5) if stretch[0] > start]


def tree_frames(scene: SceneImages, *, visible: float) -> float:
    """Frames in which less than `visible` of the target is seen at the tree."""
    start, end = tree_occlusion(scene.visibility, visible)
    return float(end - start)


def least_visible_at_tree(scene: SceneImages) -> float:
    """Smallest visible share of the target at the tree."""
    start, end = tree_occlusion(scene.visibility, 0.5)
    return float(scene.visibility[start:end].min())


def number_of_short_occlusions(scene: SceneImages) -> float:
    """Return the number of occlusions of more than half of the target after the tree's."""
    return float(len(short_occlusions(scene)))


def longest_short_occlusion(scene: SceneImages) -> float:
    """Frames of the longest occlusion after the tree's, with less than half seen."""
    return float(max((end - start for start, end in short_occlusions(scene)), default=0))


def frames_before_short_occlusions(scene: SceneImages) -> float:
    """Frames from `frame_after_tree` to the first short occlusion."""
    first = min((start for start, _ in short_occlusions(scene)), default=0)
    return float(first - frame_after_tree(scene.visibility))


def hider_distance(scene: SceneImages, stretch: tuple[int, int]) -> float:
    """Bhattacharyya distance of the target's colours and of what hides it in a stretch.

    What hides it are the pixels in the middle half of the box, in the frame of least visibility,
    that do not show the target. The target's colours are those of its first frame.
    """
    frame = stretch[0] + int(np.argmin(scene.visibility[stretch[0] : stretch[1]]))
    middle = box_mask(scene.mask(frame).shape, scene.boxes[frame], 0.5)
    hider = scene.image(frame)[middle & ~scene.mask(frame)]
    target = scene.target_colours(scene.sequence.first_frame)
    return bhattacharyya(colour_histogram(target), colour_histogram(hider))


def distance_of_students(scene: SceneImages) -> float:
    """Smaller distance of the target's colours and a hiding student's clothes."""
    return min((hider_distance(scene, stretch) for stretch in short_occlusions(scene)), default=0.0)


def distance_of_tree(scene: SceneImages) -> float:
    """Distance of the target's colours and those of the tree that hides it."""
    return hider_distance(scene, tree_occlusion(scene.visibility, 0.5))


def changed_share(scene: SceneImages, *, distance: float, step: int = 5) -> float:
    """Share of the frames with a target histogram at least `distance` from the first frame's."""
    first = colour_histogram(scene.target_colours(scene.sequence.first_frame))
    changes = [
        bhattacharyya(first, colour_histogram(scene.target_colours(frame)))
        for frame in range(scene.sequence.first_frame, len(scene), step)
    ]
    return float(np.mean(np.array(changes) >= distance))


def attribute_share(scene: SceneImages, *, attribute: str) -> float:
    """Share of the frames that have an attribute."""
    return float(scene.sequence.attributes[attribute].mean())
