"""Scores of masks: region similarity J and contour accuracy F of the DAVIS benchmark.

Source: Perazzi, Pont-Tuset, McWilliams, Van Gool, Gross, Sorkine-Hornung, "A benchmark dataset and
evaluation methodology for video object segmentation", CVPR 2016, with the conventions of the
published evaluation (github.com/davisvideochallenge/davis2017-evaluation).
"""

from dataclasses import dataclass
from math import ceil, hypot
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

CONTOUR_TOLERANCE = 0.008
"""Largest distance of matching contour pixels, as a share of the image diagonal."""

RECALL_THRESHOLD = 0.5
"""Value above which a frame counts for the recall."""

_QUARTERS = 4

_NEIGHBOURHOOD = np.ones((2, 2), np.uint8)


@dataclass(frozen=True)
class Segmentation:
    """Agreement of a tracker's masks with the ground truth, by frame, in [0, 1].

    A value is NaN without a ground-truth mask, up to the initialisation, before the first mask of
    the tracker and after a failure.
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
    estimate: NDArray[np.bool_], truth: NDArray[np.bool_], tolerance: float = CONTOUR_TOLERANCE
) -> float:
    """Return the contour accuracy F, the harmonic mean of the contours' precision and recall.

    Precision is the share of contour pixels of the estimate that have a contour pixel of the ground
    truth within the tolerance. Recall exchanges the two. A pixel is on a contour if its right,
    lower or lower right neighbour differs; the border of the image is not a contour. F is 1 if
    neither mask has a contour and 0 if only one has. `tolerance`: share of the image diagonal,
    rounded up to whole pixels. Raises `ValueError` for masks of different shapes.
    """
    _check_shapes(estimate, truth)
    # Contours exist only near the masks: the computation is restricted to this part.
    x, y, width, height = cv2.boundingRect((estimate | truth).view(np.uint8))
    window = np.s_[max(y - 1, 0) : y + height + 1, max(x - 1, 0) : x + width + 1]
    e, t = _contour(estimate[window]), _contour(truth[window])
    n_estimate, n_truth = np.count_nonzero(e), np.count_nonzero(t)
    if not (n_estimate and n_truth):
        return float(n_estimate == n_truth)
    disc = _disc(ceil(tolerance * hypot(*truth.shape)))
    precision = np.count_nonzero(cv2.bitwise_and(e, cv2.dilate(t, disc))) / n_estimate
    recall = np.count_nonzero(cv2.bitwise_and(t, cv2.dilate(e, disc))) / n_truth
    both = precision + recall
    return float(2 * precision * recall / both) if both else 0.0


def mean_recall_decay(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return mean, recall and decay of a measure by frame, shape (n,), as DAVIS defines them.

    Recall is the share of frames above `RECALL_THRESHOLD`. Decay is the mean over the first quarter
    of the frames minus the mean over the last one; adjacent quarters share a frame. NaN values are
    ignored; without values a result is NaN.
    """
    n = len(values)
    # The published evaluation counts from 1 and rounds halves up.
    bounds = np.round(np.linspace(1, n, _QUARTERS + 1) + 1e-10).astype(int) - 1
    first, last = values[: bounds[1] + 1], values[bounds[-2] :]
    values, first, last = (part[np.isfinite(part)] for part in (values, first, last))
    return _mean(values), _mean(values > RECALL_THRESHOLD), _mean(first) - _mean(last)


def segmentation_scores(segmentation: Segmentation, initialised: int) -> dict[str, float]:
    """Return mean, recall and decay of both measures over the frames after the initialisation.

    Unlike in DAVIS, the last frame counts. Frames without target count, too: an empty mask scores 1
    and any other mask 0.
    """
    scores: dict[str, float] = {}
    for prefix, name, values in (
        ("region", "region_similarity", segmentation.region_similarity),
        ("contour", "contour_accuracy", segmentation.contour_accuracy),
    ):
        mean, recall, decay = mean_recall_decay(values[initialised + 1 :])
        scores |= {f"mean_{name}": mean, f"{prefix}_recall": recall, f"{prefix}_decay": decay}
    return scores


def _contour(mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return the contour pixels of a mask as 0 and 1."""
    image, border = mask.view(np.uint8), cv2.BORDER_REPLICATE
    contour = cv2.morphologyEx(
        image, cv2.MORPH_GRADIENT, _NEIGHBOURHOOD, anchor=(0, 0), borderType=border
    )
    return np.asarray(contour, np.uint8)


def _disc(radius: int) -> NDArray[np.uint8]:
    y, x = np.ogrid[-radius : radius + 1, -radius : radius + 1]
    return np.asarray(x * x + y * y <= radius * radius, np.uint8)


def _check_shapes(estimate: NDArray[np.bool_], truth: NDArray[np.bool_]) -> None:
    if estimate.shape != truth.shape:
        raise ValueError(
            f"The estimated mask has shape {estimate.shape}. Expected: {truth.shape}, as the "
            "ground truth."
        )


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if len(values) else np.nan
