"""What a camera sees of things, before any light is on them."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.finish import GAMMA, Thing
from datasets.synthetic.render.rays import NOTHING, View, what_is_seen

__all__ = ["PITCH", "Surface", "looked_at"]

Array = NDArray[np.float64]

PITCH = 0.27
"""How far the camera looks down [radians]."""

EDGE = 0.5
"""How far slopes on two sides of a sample differ where there is an edge [pixels/sample]."""

BEYOND = 1e9
"""Stands for the rise to another thing [pixels]."""

VIEW = View(PITCH, (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Surface:
    """Surfaces, sample by sample.

    Attributes
    ----------
    which : ndarray of int64, shape (h, w)
        Index of the thing that is seen, or `NOTHING`.
    colour : ndarray of float64, shape (h, w, 3)
        Part of the light that comes back, BGR; zeros where there is nothing, as in `gloss`.
    normal : ndarray of float64, shape (h, w, 3)
        Outwards: to the right, down, towards the camera.
    depth : ndarray of float64, shape (h, w)
        How far it is from the origin towards the camera [pixels].
    gloss : ndarray of float64, shape (h, w)
        How much of a lamp it mirrors.
    """

    which: NDArray[np.int64]
    colour: Array
    normal: Array
    depth: Array
    gloss: Array

    def reduced(self, fine: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Colour with coverage, and normal with gloss, means over blocks of samples.

        Parameters
        ----------
        fine : int
            Width and height of a block.

        Returns
        -------
        two ndarray of float32, shape (h // fine, w // fine, 4)
            Premultiplied by the coverage.
        """
        there = (self.which != NOTHING)[..., None]
        sheets = (self.colour, there), (self.normal * there, self.gloss[..., None])
        size = self.which.shape[1] // fine, self.which.shape[0] // fine
        colour, normal = (
            np.asarray(
                cv2.resize(np.concatenate(parts, axis=2), size, interpolation=cv2.INTER_AREA),
                np.float32,
            )
            for parts in sheets
        )
        return colour, normal


def looked_at(
    things: Sequence[Thing], corner: tuple[float, float], size: tuple[int, int], fine: int
) -> Surface:
    """Look at things; arguments as of `kitchen.rays.what_is_seen`."""
    solids = [thing.solids for thing in things]
    which, places, _ = what_is_seen(solids, VIEW, corner, size, fine, shaded=False)
    colour, gloss = np.zeros((*which.shape, 3)), np.zeros(which.shape)
    for k, thing in enumerate(things):
        there = which == k
        painted = np.asarray(thing.finish.colour) * thing.finish.pattern(places[there])
        colour[there] = np.clip(painted / 255, 0, 1) ** GAMMA
        gloss[there] = thing.finish.gloss
    depth = places[..., 1] * np.sin(PITCH) + places[..., 2] * np.cos(PITCH)
    return Surface(which, colour, _normals(which, depth, 1 / fine), depth, gloss)


def _normals(which: NDArray[np.int64], depth: Array, step: float) -> Array:
    """From the slopes of the depth, across the gentler side of an edge."""
    slopes = [_slope(which, depth, axis) / step for axis in (1, 0)]
    normal = np.stack([-slopes[0], -slopes[1], np.ones(depth.shape)], axis=2)
    return np.asarray(normal / np.sqrt((normal * normal).sum(axis=2, keepdims=True)))


def _slope(which: NDArray[np.int64], depth: Array, axis: int) -> Array:
    """Rise of the depth from sample to sample: both sides' mean, but for edges."""
    rise = np.diff(depth, axis=axis)
    rise[np.diff(which, axis=axis) != 0] = BEYOND
    end = np.full_like(np.take(depth, [0], axis=axis), BEYOND)
    before, after = (np.concatenate(p, axis=axis) for p in ([end, rise], [rise, end]))
    gentler = np.where(np.abs(before) < np.abs(after), before, after)
    smooth = np.abs(before - after) < EDGE
    return np.where(smooth, (before + after) / 2, gentler) * (np.abs(gentler) < BEYOND)
