"""Agreement of masks: region similarity J and contour accuracy F, and what a run makes of them.

The definitions are those of the DAVIS benchmark: Perazzi, Pont-Tuset, McWilliams, Van Gool,
Gross, Sorkine-Hornung, "A benchmark dataset and evaluation methodology for video object
segmentation", CVPR 2016, with the conventions of its published evaluation
(github.com/davisvideochallenge/davis2017-evaluation).
"""

from dataclasses import dataclass
from math import ceil, hypot
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

TOLERANCE = 0.008
"""Distance up to which contours agree, in shares of the image's diagonal."""

RECALL_THRESHOLD = 0.5
"""Similarity or accuracy above which a frame counts for the recall."""

_QUARTERS = 4

_SQUARE = np.ones((2, 2), np.uint8)


@dataclass(frozen=True)
class Segmentation:
    """Agreement of a tracker's masks with the ground truth, by frame, in [0, 1].

    Values are NaN if there is no true mask, up to the frame of initialisation, before the tracker's
    first mask, and after a failure.
    """

    region_similarity: NDArray[Any]
    contour_accuracy: NDArray[Any]


def region_similarity(estimate: NDArray[np.bool_], truth: NDArray[np.bool_]) -> float:
    r"""Region similarity J, the Jaccard index of two masks.

    .. math:: |E \cap T| \,/\, |E \cup T|

    Parameters
    ----------
    estimate, truth : ndarray of bool, shape (height, width)
        Masks.

    Returns
    -------
    float
        In [0, 1]; 1 where both are empty.

    Raises
    ------
    ValueError
        For masks of different shapes.

    Examples
    --------
    >>> left, all_of_it = np.array([[True, False]]), np.array([[True, True]])
    >>> region_similarity(left, all_of_it)
    0.5
    """
    _check_shapes(estimate, truth)
    union = np.count_nonzero(estimate | truth)
    return float(np.count_nonzero(estimate & truth) / union) if union else 1.0


def contour_accuracy(
    estimate: NDArray[np.bool_], truth: NDArray[np.bool_], tolerance: float = TOLERANCE
) -> float:
    """Contour accuracy F, the harmonic mean of the contours' precision and recall.

    Precision is the share of the estimate's contour pixels with a contour pixel of the truth
    within the tolerance, recall the reverse. A pixel is on a contour where its right, lower, or
    right lower neighbour differs from it; the image's border is no contour.

    Parameters
    ----------
    estimate, truth : ndarray of bool, shape (height, width)
        Masks.
    tolerance : float
        In shares of the image's diagonal, rounded up to whole pixels.

    Returns
    -------
    float
        In [0, 1]; 1 where neither mask has a contour, 0 where one alone has.

    Raises
    ------
    ValueError
        For masks of different shapes.
    """
    _check_shapes(estimate, truth)
    # What lies beyond both masks has no contour: all is done on what is left.
    x, y, width, height = cv2.boundingRect((estimate | truth).view(np.uint8))
    part = np.s_[max(y - 1, 0) : y + height + 1, max(x - 1, 0) : x + width + 1]
    e, t = _contour(estimate[part]), _contour(truth[part])
    n_estimate, n_truth = np.count_nonzero(e), np.count_nonzero(t)
    if not (n_estimate and n_truth):
        return float(n_estimate == n_truth)
    disc = _disc(ceil(tolerance * hypot(*truth.shape)))
    precision = np.count_nonzero(cv2.bitwise_and(e, cv2.dilate(t, disc))) / n_estimate
    recall = np.count_nonzero(cv2.bitwise_and(t, cv2.dilate(e, disc))) / n_truth
    both = precision + recall
    return float(2 * precision * recall / both) if both else 0.0


def mean_recall_decay(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """What DAVIS tells of a run by one of the two measures.

    Parameters
    ----------
    values : ndarray of float64, shape (n,)
        The measure by frame; NaN where there is none.

    Returns
    -------
    mean : float
        Over the frames that have one, as the others are; NaN where none has.
    recall : float
        Share of frames above `RECALL_THRESHOLD`.
    decay : float
        Mean over the first quarter of the frames less that over the last; neighbouring
        quarters share a frame. NaN where one of these quarters has no value.
    """
    n = len(values)
    # As the published evaluation does it: counting from 1, halves go upwards.
    bounds = np.round(np.linspace(1, n, _QUARTERS + 1) + 1e-10).astype(int) - 1
    first, last = values[: bounds[1] + 1], values[bounds[-2] :]
    known, first, last = (part[np.isfinite(part)] for part in (values, first, last))
    return _mean(known), _mean(known > RECALL_THRESHOLD), _mean(first) - _mean(last)


def segmentation_scores(found: Segmentation, initialised: int) -> dict[str, float]:
    """Mean, recall and decay of both measures, over the frames after that of initialisation.

    DAVIS leaves out the last frame, too; here it counts, and so do frames without target, where an
    empty mask scores 1 and any other 0.

    Parameters
    ----------
    found : Segmentation
        The measures by frame.
    initialised : int
        Frame of initialisation.

    Returns
    -------
    dict of str to float
        `mean_region_similarity`, `region_recall`, `region_decay`, `mean_contour_accuracy`,
        `contour_recall`, `contour_decay`; see `mean_recall_decay`.
    """
    scores: dict[str, float] = {}
    for kind, name, values in (
        ("region", "region_similarity", found.region_similarity),
        ("contour", "contour_accuracy", found.contour_accuracy),
    ):
        mean, recall, decay = mean_recall_decay(values[initialised + 1 :])
        scores |= {f"mean_{name}": mean, f"{kind}_recall": recall, f"{kind}_decay": decay}
    return scores


def _contour(mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Contour pixels of a mask as 0 and 1."""
    contour = cv2.morphologyEx(
        mask.view(np.uint8),
        cv2.MORPH_GRADIENT,
        _SQUARE,
        anchor=(0, 0),
        borderType=cv2.BORDER_REPLICATE,
    )
    return np.asarray(contour, np.uint8)


def _disc(radius: int) -> NDArray[np.uint8]:
    y, x = np.ogrid[-radius : radius + 1, -radius : radius + 1]
    return np.asarray(x * x + y * y <= radius * radius, np.uint8)


def _check_shapes(estimate: NDArray[np.bool_], truth: NDArray[np.bool_]) -> None:
    if estimate.shape != truth.shape:
        raise ValueError(f"the mask has shape {estimate.shape}, the truth {truth.shape}.")


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")
