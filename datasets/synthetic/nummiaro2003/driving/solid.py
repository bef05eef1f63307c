"""Solids of plane facets: what is known of them before anything is seen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.nummiaro2003.driving.facets import MOST, Facets

__all__ = ["Face", "Ring", "assembled", "between", "flat", "upright"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Face:
    """A plane polygon.

    Attributes
    ----------
    corners : ndarray of float64, shape (n, 3)
        In order around it, at most MOST [metres].
    outwards : ndarray of float64, shape (3,)
        Some direction that it faces.
    kind : int
        Number of the picture on it.
    soft : bool
        Whether it is a shadow.
    """

    corners: Array
    outwards: Array
    kind: int
    soft: bool = False


@dataclass(frozen=True)
class Ring:
    """Outline of a solid at a height: a rectangle with its corners cut off.

    Attributes
    ----------
    height : float
        [metres].
    ahead, behind : float
        Where it ends along the solid's axis [metres].
    half_width : float
        [metres].
    """

    height: float
    ahead: float
    behind: float
    half_width: float

    def corners(self, cut: tuple[float, float]) -> Array:
        """Eight corners from the front's left end on; `cut` is across and along [metres]."""
        wide, narrow = self.half_width, self.half_width - cut[0]
        ahead, behind = self.ahead - cut[1], self.behind + cut[1]
        outline = [(-narrow, self.ahead), (narrow, self.ahead), (wide, ahead), (wide, behind),
                   (narrow, self.behind), (-narrow, self.behind), (-wide, behind),
                   (-wide, ahead)]  # fmt: skip
        return np.array([[x, self.height, z] for x, z in outline])


def between(
    lower: Ring, upper: Ring, kinds: tuple[int, int, int], cut: tuple[float, float] = (0.0, 0.0)
) -> Iterator[Face]:
    """Faces around a solid between two outlines.

    Parameters
    ----------
    lower, upper : Ring
    kinds : tuple of int
        Pictures on the front with its corners, the rear with its corners, and the sides.
    cut : tuple of float
        As in `Ring.corners`; the same at both, so that every face is plane.
    """
    below, above = lower.corners(cut), upper.corners(cut)
    front, rear, side = kinds
    for k, kind in enumerate((front, front, side, rear, rear, rear, side, front)):
        after = (k + 1) % 8
        corners = np.array([below[k], below[after], above[after], above[k]])
        if cut == (0.0, 0.0) and k % 2:
            continue
        middle = (below[k] + below[after]) / 2
        away = [middle[0], 0.0, middle[2] - (lower.ahead + lower.behind) / 2]
        yield Face(corners, np.array(away), kind)


def flat(
    height: float, x: tuple[float, float], z: tuple[float, float], kind: int, soft: bool = False
) -> Face:
    """Level rectangle that is seen from above."""
    outline = [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])]
    corners = np.array([[a, height, b] for a, b in outline])
    return Face(corners, np.array([0.0, 1.0, 0.0]), kind, soft)


def upright(corners: Sequence[tuple[float, float]], z: float, ahead: bool, kind: int) -> Face:
    """Polygon of corners (x, y) that stands across the axis at `z`, and faces along it."""
    places = np.array([[x, y, z] for x, y in corners])
    return Face(places, np.array([0.0, 0.0, 1.0 if ahead else -1.0]), kind)


def assembled(faces: Sequence[Face], projections: Array) -> Facets:
    """Facets of faces that are listed from front to back.

    Parameters
    ----------
    faces : sequence of Face
    projections : ndarray of float64, shape (pictures, 2, 4)
        Column and row in every picture, as in `Facets.places`.
    """
    corners = np.zeros((len(faces), MOST, 3))
    normals = np.empty((len(faces), 3))
    for k, face in enumerate(faces):
        corners[k, : len(face.corners)] = face.corners
        # The diagonals span the plane even where two corners are one.
        first, second = face.corners[2] - face.corners[0], face.corners[-1] - face.corners[1]
        normal = np.cross(first, second)
        normal /= np.sqrt((normal * normal).sum())
        normals[k] = normal if (normal * face.outwards).sum() > 0 else -normal
    kinds = np.array([face.kind for face in faces])
    return Facets(
        corners,
        np.array([len(face.corners) for face in faces]),
        normals,
        kinds,
        np.ascontiguousarray(projections[kinds]),
        np.array([face.soft for face in faces]),
    )
