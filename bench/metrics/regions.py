"""Agreement of masks: region similarity J and contour accuracy F, and a run's scores by them.

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
    r"""Return the region similarity J of two masks of one shape, their Jaccard index, in [0, 1].

    It is 1 if both masks are empty. Raises `ValueError` for masks of different shapes.

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
    """Return the contour accuracy F, the harmonic mean of the contours' precision and recall.

    Precision is the share of the estimate's contour pixels with a contour pixel of the truth
    within the tolerance, recall the reverse. A pixel is on a contour if its right, lower, or right
    lower neighbour differs from it; the border of the image is no contour. F is 1 if neither mask
    has a contour, 0 if only one has. `tolerance`: in shares of the image's diagonal, rounded up to
    whole pixels. Raises `ValueError` for masks of different shapes.
    """
    _check_shapes(estimate, truth)
    # There is no contour beyond both masks: compute on the rest.
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
    """Return mean, recall and decay of a measure by frame, shape (n,), as DAVIS has them.

    Recall is the share of frames above `RECALL_THRESHOLD`. Decay is the mean over the first quarter
    of the frames minus that over the last; neighbouring quarters share a frame. NaN values are left
    out; without values a result is NaN.
    """
    n = len(values)
    # As the published evaluation does it: counting from 1, halves go upwards.
    bounds = np.round(np.linspace(1, n, _QUARTERS + 1) + 1e-10).astype(int) - 1
    first, last = values[: bounds[1] + 1], values[bounds[-2] :]
    values, first, last = (part[np.isfinite(part)] for part in (values, first, last))
    return _mean(values), _mean(values > RECALL_THRESHOLD), _mean(first) - _mean(last)


def segmentation_scores(segmentation: Segmentation, initialised: int) -> dict[str, float]:
    """Return mean, recall and decay of both measures, over the frames after that of initialisation.

    DAVIS leaves out the last frame, too; here it counts, and so do frames without target, in which
    an empty mask scores 1 and any other 0.
    """
    scores: dict[str, float] = {}
    for kind, name, values in (
        ("region", "region_similarity", segmentation.region_similarity),
        ("contour", "contour_accuracy", segmentation.contour_accuracy),
    ):
        mean, recall, decay = mean_recall_decay(values[initialised + 1 :])
        scores |= {f"mean_{name}": mean, f"{kind}_recall": recall, f"{kind}_decay": decay}
    return scores


def _contour(mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return the contour pixels of a mask as 0 and 1."""
    image, border = mask.view(np.uint8), cv2.BORDER_REPLICATE
    contour = cv2.morphologyEx(image, cv2.MORPH_GRADIENT, _SQUARE, anchor=(0, 0), borderType=border)
    return np.asarray(contour, np.uint8)


def _disc(radius: int) -> NDArray[np.uint8]:
    y, x = np.ogrid[-radius : radius + 1, -radius : radius + 1]
    return np.asarray(x * x + y * y <= radius * radius, np.uint8)


def _check_shapes(estimate: NDArray[np.bool_], truth: NDArray[np.bool_]) -> None:
    if estimate.shape != truth.shape:
        raise ValueError(f"the mask has shape {estimate.shape}, the truth {truth.shape}.")


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if len(values) else np.nan
