"""Whether a colour distribution changes when the target is turned or scaled.

A frame is turned or scaled about the target's centre, and the histogram of the ellipse that is
turned or scaled with it compared with the one before.
"""

from math import ceil

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.nummiaro2003.checks.appearance import Model, clear_frames, ellipses_in
from datasets import Sequence
from trackers.base.interface import Image
from trackers.histograms.colour.joint import JointBins

__all__ = ["measure", "turned", "turned_histogram"]

Array = NDArray[np.float64]

FRAMES = 5
DEGREES = (15, 30, 45, 60, 75, 90, 120, 150, 180)
FACTORS = (0.5, 0.65, 0.8, 1.25, 1.6, 2.0)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `transformed` and `transformed_upright`; see `bench.papers.nummiaro2003.checks`."""
    whole, upright = [], []
    for frame in clear_frames(sequence, 1 if quick else FRAMES):
        ellipse = ellipses_in(sequence.boxes[frame])
        patch, centred = _cut_out(sequence[frame], ellipse)
        model = Model(patch, centred)
        for degrees in DEGREES:
            image = turned(patch, centred, degrees)
            histogram = turned_histogram(image, centred, degrees)
            labels = {"frame": frame, "transformation": "rotation", "amount": float(degrees)}
            coefficient = float(np.sqrt(model.histogram * histogram).sum())
            whole.append(labels | {"coefficient": coefficient})
            for region, reference, other in _upright(centred, degrees):
                changed = Model(patch, reference).coefficients(image, other[np.newaxis])[0]
                upright.append(labels | {"region": region, "coefficient": float(changed)})
        for factor in FACTORS:
            # A camera farther away averages; one nearer makes no colours between neighbours.
            way = cv2.INTER_AREA if factor < 1 else cv2.INTER_NEAREST
            scaled = cv2.resize(patch, None, fx=factor, fy=factor, interpolation=way)
            sizes = np.array([scaled.shape[1] / patch.shape[1], scaled.shape[0] / patch.shape[0]])
            other = centred * np.tile(sizes, 2)
            changed = model.coefficients(np.asarray(scaled, np.uint8), other[np.newaxis])[0]
            labels = {"frame": frame, "transformation": "scale", "amount": factor}
            whole.append(labels | {"coefficient": float(changed)})
    return {"transformed": pd.DataFrame(whole), "transformed_upright": pd.DataFrame(upright)}


def turned(image: Image, ellipse: Array, degrees: float) -> Image:
    """The image turned about an ellipse's centre, against the clock as it is seen."""
    # OpenCV puts pixel centres at whole numbers.
    x, y = (ellipse[:2] - 0.5).tolist()
    rotation = cv2.getRotationMatrix2D((x, y), degrees, 1.0)
    size = image.shape[1], image.shape[0]
    # Colours between neighbours, which interpolation would make, are not the target's.
    nearest, mirrored = cv2.INTER_NEAREST, cv2.BORDER_REFLECT
    found = cv2.warpAffine(image, rotation, size, flags=nearest, borderMode=mirrored)
    return np.asarray(found, np.uint8)


def turned_histogram(image: Image, ellipse: Array, degrees: float) -> Array:
    """Histogram of an ellipse that is turned with the image, kernel as written.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        BGR.
    ellipse : ndarray of float64, shape (4,)
        Centre x and y, and half axes before it is turned [pixels].
    degrees : float
        As of `turned`.
    """
    colours = JointBins()
    rows, columns = np.mgrid[: image.shape[0], : image.shape[1]] + 0.5
    dx, dy = columns - ellipse[0], rows - ellipse[1]
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    along = (cosine * dx - sine * dy) / ellipse[2]
    across = (sine * dx + cosine * dy) / ellipse[3]
    inside = along**2 + across**2 <= 1
    distance = (dx**2 + dy**2) / (ellipse[2:] ** 2).sum()
    weights = 1 - distance[inside]
    counts = np.bincount(colours.codes(image)[inside], weights, colours.n_bins)
    return np.asarray(counts / counts.sum())


def _upright(ellipse: Array, degrees: float) -> list[tuple[str, Array, Array]]:
    """Upright ellipses to compare: what it is called, before, after the turn."""
    half_width, half_height = ellipse[2:]
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    extents = [
        np.hypot(half_width * cosine, half_height * sine),
        np.hypot(half_width * sine, half_height * cosine),
    ]
    circle = np.array([*ellipse[:2], *[min(half_width, half_height)] * 2])
    return [
        ("extents", ellipse, np.array([*ellipse[:2], *extents])),
        ("circle", circle, circle),
    ]


def _cut_out(image: Image, ellipse: Array) -> tuple[Image, Array]:
    """The target's surroundings, mirrored where the image ends, and the ellipse in them."""
    reach = ceil(float(np.hypot(*ellipse[2:]))) + 2
    padded = cv2.copyMakeBorder(image, reach, reach, reach, reach, cv2.BORDER_REFLECT)
    left, top = np.floor(ellipse[:2]).astype(int).tolist()  # less than the centre by < 1
    patch = padded[top : top + 2 * reach + 1, left : left + 2 * reach + 1]
    centred = ellipse.copy()
    centred[:2] += reach - np.array([left, top])
    return np.ascontiguousarray(patch), centred
