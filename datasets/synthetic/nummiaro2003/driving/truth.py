"""Truth of a scene with cars."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.plan import FRAMES_PER_SECOND, SIZE, Plan
from datasets.synthetic.scene import Truth

__all__ = ["driving_truth"]

OCCLUDED = 0.9
"""Visible fraction below which the target counts as occluded."""

TURNING = np.radians(15)
"""The side that is seen turns if it does so by this much in a second [radians]."""

FASTEST = 0.2
"""Share of the frames that count as fast."""


def driving_truth(plan: Plan, shade: NDArray[np.bool_]) -> Truth:
    """Truth of all frames.

    `boxes` are the extents of the whole car. Attributes are `occlusion` (less than 0.9 of the
    target is seen), `out_of_view` (a part of the box), `scale_change` (width outside 0.8 to
    1.25 of the first), `turning` (the side from which it is seen turns by more than 15 degrees
    in a second), `fast` (the fifth of the frames in which it moves most in the picture) and
    `shade`.

    Parameters
    ----------
    plan : Plan
    shade : ndarray of bool, shape (n,)
        Where the target is in the shade of a tree.
    """
    boxes, visibility = plan.boxes, plan.visibility
    inside = (boxes[:, :2] >= 0).all(axis=1) & (boxes[:, :2] + boxes[:, 2:] <= SIZE).all(axis=1)
    size = boxes[:, 2] / boxes[0, 2]
    course = plan.cars[0][1]
    places = np.array([view.place for view in plan.views])
    sight = np.unwrap(np.arctan2(course.x - places[:, 0], course.z - places[:, 2]))
    half = round(FRAMES_PER_SECOND) // 2
    aspect = np.pad(course.heading - sight, half, mode="edge")
    turned = np.abs(aspect[2 * half :] - aspect[: len(plan)])
    steps = np.gradient(boxes[:, :2] + boxes[:, 2:] / 2, axis=0)
    speed = np.sqrt((steps * steps).sum(axis=1))
    return Truth(
        boxes,
        visibility,
        {
            "occlusion": np.less(visibility, OCCLUDED),
            "out_of_view": np.logical_not(inside),
            "scale_change": np.logical_or(size < 0.8, size > 1.25),
            "turning": np.greater(turned, TURNING),
            "fast": np.greater(speed, np.quantile(speed, 1 - FASTEST)),
            "shade": shade,
        },
    )
