"""Hint on trackers that return corners `[x1, y1, x2, y2]` instead of `[x, y, width, height]`."""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.metrics.boxes import overlap
from trackmark.bench.protocols import TIMING
from trackmark.bench.store.runs import Runs

_MIN_GAIN = 0.3
"""Gain of mean overlap above which boxes are likely to be corners."""

_FIRST_FRAMES = 10
"""Number of frames after the init box in which most trackers still follow the target."""

_MAX_RUNS = 3
"""Maximum number of runs of a tracker that are read."""


def corner_boxes(runs: Runs, protocol: str = "") -> list[str]:
    """Return a hint for each tracker whose boxes match the targets only as corners.

    Of each tracker, the first finished runs with a low or unknown overlap are checked, by default
    those by any protocol.
    """
    hints, table = [], runs.table
    is_checked = table["protocol"] == protocol if protocol else table["protocol"] != TIMING
    finished = table[(table["status"] == "finished") & is_checked]
    overlaps = finished.reindex(columns=["mean_overlap"])["mean_overlap"]
    low = finished[~(overlaps >= 1 - _MIN_GAIN)]
    for tracker, rows in low.groupby("tracker", sort=False):
        for _, run, truth in runs.read(rows.head(_MAX_RUNS).to_dict("records")):
            gain = _gain(run, truth.boxes)
            if gain > _MIN_GAIN:
                hints.append(
                    f"{tracker}: the boxes look like [x1, y1, x2, y2]. Expected: [x, y, width, "
                    f"height]. Read as corners, they overlap the target by {gain:.2f} more."
                )
                break
    return hints


def _gain(run: Run, truth: NDArray[np.float64]) -> float:
    """Return by how much the mean overlap rises if boxes are read as corners; 0 without truth.

    The mean is that of all frames or, if more, of the first frames: the target may be lost later.
    """
    frames = np.concatenate(run.segments) if run.segments else np.arange(len(run.boxes))
    is_later = frames != frames[0]
    boxes, truth = run.boxes[is_later], truth[frames][is_later]
    is_known = np.isfinite(np.hstack([boxes, truth])).all(axis=1)
    boxes, truth = boxes[is_known], truth[is_known]
    if not len(boxes):
        return 0.0
    with np.errstate(over="ignore"):  # coordinates of 1e308
        corners = np.column_stack([boxes[:, :2], boxes[:, 2:] - boxes[:, :2]])
    gains = overlap(truth, corners) - overlap(truth, boxes)
    return float(max(gains.mean(), gains[:_FIRST_FRAMES].mean()))
