"""Areas under success, precision and normalised precision as the TrackingNet devkit has them.

Boxes are rounded to whole pixels, halves to even numbers. The curves have 21 thresholds: overlaps
above 0 to 1, centre distances up to 0 to 50 pixels, and up to 0 to 0.5 in widths and heights of the
truth. Scores are areas by the trapezoid rule over the thresholds' share of their range, so that a
perfect tracker has a success of .975; they are shares here, not per cent. The first frame is
overwritten by the truth and counts; absent frames and malformed boxes are misses. Each sequence
counts once. Müller et al., "TrackingNet: a large-scale dataset and benchmark for object tracking in
the wild", ECCV 2018.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.metrics.curves import OVERLAPS, shares
from trackmark.bench.metrics.native import Truth
from trackmark.bench.metrics.overlap import is_well_formed, overlap
from trackmark.bench.metrics.preset import Answer, Axes, Column, Judged, Preset, started

_PIXELS = np.linspace(0, 50, 21)
_SIZES = np.linspace(0, 0.5, 21)


def judge(truth: Truth, answer: Answer) -> Judged:
    """Return scores and curves of a run."""
    run = started(truth, answer)
    # A box that only rounds to no size has a centre all the same.
    e = np.where(is_well_formed(run.estimate)[:, None], np.round(run.estimate), np.nan)
    t = np.round(run.truth)
    overlaps = np.nan_to_num(overlap(t, e))
    curves = {
        "success": shares(overlaps, OVERLAPS, above=True),
        "precision": shares(_centre_errors(t, e, 1.0), _PIXELS),
        "normalised_precision": shares(_centre_errors(t, e, t[:, 2:]), _SIZES),
    }
    scores = {f"{name}_auc": float(np.trapezoid(c[:, 1], OVERLAPS)) for name, c in curves.items()}
    return Judged(scores, curves)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # boxes of 1e308
def _centre_errors(
    truth: NDArray[np.float64], estimate: NDArray[np.float64], unit: NDArray[np.float64] | float
) -> NDArray[np.float64]:
    """Return the distance of centres in units of width and height, shape (n,).

    The distance is not a number at most a threshold if the target is absent, the unit is 0 or the
    estimate is not finite. Boxes need no size.
    """
    difference = estimate[:, :2] + estimate[:, 2:] / 2 - (truth[:, :2] + truth[:, 2:] / 2)
    return np.asarray(np.sqrt(((difference / unit) ** 2).sum(axis=1)))


PRESET = Preset(
    columns={
        "success_auc": Column("area under the success curve", 0.975),
        "precision_auc": Column("area under the precision curve, up to 50 px"),
        "normalised_precision_auc": Column("area under the normalised one, up to 0.5 sizes"),
    },
    judge=judge,
    curves={
        "success": Axes("overlap threshold", "share of frames"),
        "precision": Axes("centre distance [px]", "share of frames"),
        "normalised_precision": Axes("centre distance [target sizes]", "share of frames"),
    },
    agrees="the TrackingNet devkit (metrics.py), but for its factor of 100",
)
