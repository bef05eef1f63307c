"""The way of a hand across somebody's face, and how it is held meanwhile."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.views import wandering

__all__ = ["CENTRED", "FINGERS", "FRAMES", "Pose", "drawn_pose", "drawn_way"]

Array = NDArray[np.float64]

FRAMES = 100
CENTRED = 48
"""Frame in which the hand is centred on the face: frame 49 of the paper."""

FINGERS = 5
"""The thumb first, the little finger last."""

JOINTS = 3


@dataclass(frozen=True)
class Pose:
    """How a hand is held in every frame; angles are in radians.

    Attributes
    ----------
    tilt, arm_tilt : ndarray of float64, shape (n,)
        Of hand and forearm, to the right from upright.
    yaw, pitch : ndarray of float64, shape (n,)
        Turn of the palm to the right, and of the fingers towards the camera.
    spread : ndarray of float64, shape (FINGERS, n)
        Turn of a finger away from where it usually points, in the palm's plane.
    bend : ndarray of float64, shape (FINGERS, 3, n)
        Of each joint, towards the palm.
    """

    tilt: Array
    arm_tilt: Array
    yaw: Array
    pitch: Array
    spread: Array
    bend: Array


def drawn_way(random: np.random.Generator, side: int) -> Array:
    """Places [pixels] relative to the one in frame `CENTRED`, shape (FRAMES, 2).

    It is faster in the middle than at the ends, and neither straight nor even.

    Parameters
    ----------
    random : numpy.random.Generator
    side : {-1, 1}
        1 goes to the right.
    """
    time = np.arange(FRAMES) - CENTRED
    slow, fast, long = random.uniform(0.95, 1.02), random.uniform(1.4, 1.65), random.uniform(22, 27)
    swell = np.clip(1 - np.square(time / long), 0, None)
    across = np.cumsum(slow + (fast - slow) * swell * swell)
    across += wandering(random, FRAMES, (1.2, 3.5), 0.5)
    sag = random.uniform(3, 7) * np.square(time / CENTRED)  # about an elbow
    lean = random.uniform(-4, 4) * time / CENTRED
    down = sag + lean + wandering(random, FRAMES, (1.2, 4.0), 1.3)
    way = np.stack([side * across, down], axis=1)
    return np.asarray(way - way[CENTRED])


def drawn_pose(random: np.random.Generator, way: Array) -> Pose:
    """An open hand, held easily; the forearm leans the more, the farther it has to reach.

    Parameters
    ----------
    random : numpy.random.Generator
    way : ndarray of float64, shape (FRAMES, 2)
        See `drawn_way`.
    """

    def wave(periods: tuple[float, float], degrees: float) -> Array:
        return np.radians(wandering(random, FRAMES, periods, degrees))

    reach = way[:, 0] / np.abs(way[:, 0]).max()
    arm_tilt = np.radians(random.uniform(14, 20)) * reach + wave((2.0, 5.0), 1.5)
    tilt = np.radians(random.uniform(6, 12)) * reach + wave((1.2, 3.5), 4.0)
    rest = np.radians(random.uniform(8, 17, (FINGERS, JOINTS, 1)))
    together = wave((1.5, 4.0), 5.0)
    bends = [[wave((0.9, 2.5), 2.0) for _ in range(JOINTS)] for _ in range(FINGERS)]
    return Pose(
        tilt,
        arm_tilt,
        np.radians(random.uniform(-14, 14)) + wave((1.5, 4.0), 6.0),
        np.radians(random.uniform(-6, 6)) + wave((1.5, 4.0), 4.0),
        np.array([wave((1.0, 3.0), 2.5) for _ in range(FINGERS)]) + wave((1.5, 4.0), 1.0),
        rest + together + np.array(bends),
    )
