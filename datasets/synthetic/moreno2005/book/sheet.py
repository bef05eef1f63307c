"""A sheet that bends without stretching, and which of its parts is in another's way.

It is held at the middle of its lower edge, which is the origin: u to the right, v down (from
minus its height to 0), w towards the camera. It is part of a cylinder whose rulings are parallel
but whose section is any curve, so that it stays developable: as it turns away from the plane in
which it is held, lengths upon it stay as they are.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEPS = 48  # pieces of a section
NEAR = 1.0  # what is nearer along a ray than this is the surface itself [pixels]


@dataclass(frozen=True)
class Bending:
    """How far a sheet is bent."""

    left: float  # by how much its left end has turned away from the camera [radians]
    right: float  # and its right end [radians]
    slant: float  # of the rulings, from upright to the left [radians]


@dataclass(frozen=True)
class Section:
    """Curve across the rulings of a sheet."""

    along: Array  # (n,): length along it, from the ruling through the origin
    across: Array  # (n,): where its points are, at right angles to the rulings
    near: Array  # (n,): and towards the camera
    turn: Array  # (n,): from the plane, to the right where it goes away [radians]


def bent(bending: Bending, half_width: float, u: Array, v: Array) -> tuple[Array, Array, Section]:
    """Bend a sheet of half a width, with places u, v (k,) on it when it is flat [pixels].

    Gives where they are, (k, 3), the directions of the sheet's front there, (k, 3) of length 1,
    and the section.
    """
    cosine, sine = np.cos(bending.slant), np.sin(bending.slant)
    along, ruling = u * cosine + v * sine, v * cosine - u * sine
    section = _section(bending, half_width, float(along.min()), float(along.max()))
    across = np.interp(along, section.along, section.across)
    near = np.interp(along, section.along, section.near)
    turn = np.interp(along, section.along, section.turn)
    points = np.stack([across * cosine - ruling * sine, across * sine + ruling * cosine, near], 1)
    aside = np.sin(turn)
    normals = np.stack([aside * cosine, aside * sine, np.cos(turn)], axis=1)
    return points, normals, section


def _section(bending: Bending, half_width: float, low: float, high: float) -> Section:
    along = np.linspace(low, high, STEPS + 1)
    distance = np.minimum(np.abs(along) / half_width, 1)
    turn = distance * np.where(along < 0, -bending.left, bending.right)
    middle = (turn[1:] + turn[:-1]) / 2
    step = along[1] - along[0]
    across, near = (
        np.concatenate([[0.0], np.cumsum(step * part)])
        for part in (np.cos(middle), -np.sin(middle))
    )
    return Section(
        along, across - np.interp(0.0, along, across), near - np.interp(0.0, along, near), turn
    )


def unshaded(
    section: Section, bending: Bending, size: tuple[float, float], u: Array, v: Array, lamp: Array
) -> Array:
    """Part of a lamp, in [0, 1], that a bent sheet leaves in view of each of its places (k,).

    It does not say whether the place faces the lamp. `size` is half the sheet's width, and its
    height [pixels]; `lamp` are directions to points of the lamp, (m, 3) as u, v and w; for the
    rest see `bent`.
    """
    cosine, sine = float(np.cos(bending.slant)), float(np.sin(bending.slant))
    along, ruling = u * cosine + v * sine, v * cosine - u * sine
    curve = np.stack([section.along, section.across, section.near], axis=1)
    starts = np.stack([np.interp(along, section.along, part) for part in curve.T[1:]], axis=1)
    towards = np.stack(
        [
            lamp[:, 0] * cosine + lamp[:, 1] * sine,
            lamp[:, 1] * cosine - lamp[:, 0] * sine,
            lamp[:, 2],
        ],
        axis=1,
    )
    blocked = _blocked(curve, starts, ruling, towards, cosine, sine, *size)
    return 1 - blocked / len(lamp)


@njit(cache=True, error_model="numpy")
def _blocked(
    curve: Array,
    starts: Array,
    ruling: Array,
    towards: Array,
    cosine: float,
    sine: float,
    half_width: float,
    height: float,
) -> NDArray[np.int64]:
    """How many of the rays from each place meet the sheet again.

    Across the rulings a ray and a piece of the section are straight lines in a plane; where
    they meet, the ray has gone some way along the ruling, perhaps beyond the sheet's edge.
    """
    counts = np.zeros(len(starts), np.int64)
    for i in range(len(starts)):
        for k in range(len(towards)):
            dx, dz = towards[k, 0], towards[k, 2]
            for j in range(len(curve) - 1):
                ex, ez = curve[j + 1, 1] - curve[j, 1], curve[j + 1, 2] - curve[j, 2]
                fx, fz = curve[j, 1] - starts[i, 0], curve[j, 2] - starts[i, 1]
                across = dx * ez - dz * ex
                far, share = (fx * ez - fz * ex) / across, (fx * dz - fz * dx) / across
                if not (far > NEAR and 0.0 <= share <= 1.0):
                    continue
                a = curve[j, 0] + share * (curve[j + 1, 0] - curve[j, 0])
                b = ruling[i] + far * towards[k, 1]
                u, v = a * cosine - b * sine, a * sine + b * cosine
                if abs(u) <= half_width and -height <= v <= 0.0:
                    counts[i] += 1
                    break
    return counts
