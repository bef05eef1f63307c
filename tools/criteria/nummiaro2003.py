"""Criteria of the nummiaro2003 scenes."""

from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from tools.criteria.shared import (
    SceneImages,
    bhattacharyya,
    box_mask,
    colour_histogram,
)
from trackmark.datasets.synthetic.nummiaro2003.driving.scene import DrivingScene
from trackmark.datasets.synthetic.nummiaro2003.head import HeadScene


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


def mean_colour(scene: SceneImages, frame: int) -> NDArray[np.float64]:
    """Return the mean CIELAB colour of the target's visible pixels, shape (3,)."""
    colours = scene.target_colours(frame).astype(np.float32) / 255
    return np.asarray(cv2.cvtColor(colours[None], cv2.COLOR_BGR2LAB)[0].mean(axis=0), np.float64)


def mean_colours(scene: SceneImages, step: int) -> NDArray[np.float64]:
    """Return the mean CIELAB colour of every `step`-th frame from the first, shape (n, 3)."""
    frames = range(scene.sequence.first_frame, len(scene), step)
    return np.stack([mean_colour(scene, frame) for frame in frames])


def recoloured_share(scene: SceneImages, *, difference: float, step: int = 5) -> float:
    """Return the share of frames whose mean colour differs by ΔE >= `difference` from the first.

    ΔE is the Euclidean distance in CIELAB (CIE 1976), measured in every `step`-th frame.
    """
    colours = mean_colours(scene, step)
    return float(np.mean(np.linalg.norm(colours - colours[0], axis=1) >= difference))


def recolouring(
    scene: SceneImages, *, frames: int = 10, percentile: float = 95, step: int = 5
) -> float:
    """Return a percentile of ΔE between the mean colours of two frames, `frames` apart."""
    colours, lag = mean_colours(scene, step), frames // step
    return float(np.percentile(np.linalg.norm(colours[lag:] - colours[:-lag], axis=1), percentile))


def viewing_angle(scene: SceneImages) -> float:
    """Return the largest angle between the line of sight and the heading of the car [degrees]."""
    plan = renderer(scene, DrivingScene).plan
    return float(np.degrees(np.abs(plan.viewing_angles).max()))


def turned_share(scene: SceneImages, *, angle: float) -> float:
    """Return the share of frames in which the head points >= `angle` degrees away from the start.

    The angle lies between the directions of the face in the frame and in the first frame.
    """
    directions = renderer(scene, HeadScene).worker.directions
    cosines = (directions * directions[scene.sequence.first_frame]).sum(axis=1)
    return float(np.mean(cosines <= np.cos(np.radians(angle))))


Renderer = TypeVar("Renderer")


def renderer(scene: SceneImages, kind: type[Renderer]) -> Renderer:
    """Return the renderer of a scene, which must have the type `kind`."""
    frames = scene.sequence.frames
    if not isinstance(frames, kind):
        raise TypeError(f"{scene.sequence.name}: the renderer is no {kind.__name__}.")
    return frames


def attribute_share(scene: SceneImages, *, attribute: str) -> float:
    """Return the share of frames that have an attribute."""
    return float(scene.sequence.attributes[attribute].mean())
