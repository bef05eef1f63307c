"""Patches of the ellipse's own colour, which it meets on its way."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.ellipse.plan import FRAMES, SIZE, Plan
from datasets.synthetic.moreno2005.ellipse.shapes import FINE, Shape, drawn_shape
from datasets.synthetic.moreno2005.knobs import Clutter
from datasets.synthetic.scene import part_generator

__all__ = ["Patch", "drawn_patches", "touched"]

EVERY = 18
"""Frames from one pair to the next in moderate clutter."""

APART = 18.0, 45.0
"""How far its patches' centres are from the ellipse's, when it has their colour [pixels]."""

FIRST = 10
"""Frame from which on patches are met in dense clutter: the ellipse was seen without them."""

GAP = 12, 22
"""Frames from one meeting to the next."""

RADIUS = 10.0, 18.0
"""Of patches [pixels]."""

SHOWN = 0.2, 0.7
"""How far a patch's middle is beyond the ellipse's outline when they meet, in its own radii."""

ASIDE = 8.0, 26.0
"""How far the one that is not met is from the ellipse's outline [pixels]."""

SIMILAR = 0.15
"""Greatest distance between similar colours, in RGB of [0, 1]."""

ADJOINING = 8
"""Least number of pixels of a patch beside the ellipse's where one touches the other."""


@dataclass(frozen=True)
class Patch:
    """Something of the colour that the ellipse has at one time.

    Attributes
    ----------
    shape : Shape
        Where it lies.
    colour : ndarray of float64, shape (3,)
        RGB in [0, 1].
    """

    shape: Shape
    colour: NDArray[np.float64]


def drawn_patches(seed: int, plan: Plan, clutter: Clutter) -> list[Patch]:
    """Patches in pairs, of the colour that the ellipse has at one time, near where it then is."""
    random = part_generator(seed, "moreno2005/ellipse patches")
    if clutter == "dense":
        return _met(random, plan)
    patches = []
    for frame in range(0, FRAMES, EVERY):
        for _ in range(2):
            radius, direction = random.uniform(*RADIUS), random.uniform(0, 2 * np.pi)
            towards = np.array([np.cos(direction), np.sin(direction)])
            middle = plan.centre[frame] + random.uniform(*APART) * towards
            patches.append(Patch(drawn_shape(random, middle, radius), plan.colour[frame]))
    return patches


def _met(random: np.random.Generator, plan: Plan) -> list[Patch]:
    """One patch of each pair touches the ellipse while it has that colour, one is beside."""
    patches = []
    frame = FIRST + int(random.integers(GAP[0]))
    while frame < FRAMES:
        for met in (False, True):
            radius, direction = random.uniform(*RADIUS), random.uniform(0, 2 * np.pi)
            beyond = radius * random.uniform(*SHOWN) if met else radius + random.uniform(*ASIDE)
            towards = np.array([np.cos(direction), np.sin(direction)])
            middle = plan.centre[frame] + (plan.reach(frame, direction) + beyond) * towards
            patches.append(Patch(drawn_shape(random, middle, radius), plan.colour[frame]))
        frame += int(random.integers(*GAP))
    return patches


def touched(patches: Sequence[Patch], plan: Plan) -> NDArray[np.bool_]:
    """In which frames the ellipse touches a patch of about the colour that it has then.

    A patch that is hidden, by the ellipse or by another patch, does not count where it is.
    """
    topmost = np.full((SIZE[1], SIZE[0]), -1)
    for number, patch in enumerate(patches):
        topmost[patch.shape.samples()[FINE // 2 :: FINE, FINE // 2 :: FINE]] = number
    colours = np.stack([patch.colour for patch in patches])
    found = np.zeros(FRAMES, np.bool_)
    for frame in range(FRAMES):
        inside = plan.covers(frame)
        grown = cv2.dilate(inside.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        beside = topmost[grown & ~inside]
        counts = np.bincount(beside[beside >= 0], minlength=len(patches))
        alike = np.linalg.norm(colours - plan.colour[frame], axis=1) <= SIMILAR
        found[frame] = (counts[alike] >= ADJOINING).any()
    return found
