"""Outlines of targets: stored contours and masks, or ellipses of round targets."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.run_record import Run
from trackmark.reports.overlay import TRUTH

Outlines: TypeAlias = Mapping[int, NDArray[np.float64]]
"""Polygons by frame, (points, 2) [px]; a row of NaN separates two polygons."""

_GAP = np.full((1, 2), np.nan)
_CORNERS = 64
"""Number of points of the polygon that replaces an ellipse."""


def is_round(run: Run) -> bool:
    """Return whether the target is the ellipse in the box, of which the run has half axes."""
    return {"half_width", "half_height"} <= run.details.keys()


def mask_outlines(mask: NDArray[Any]) -> list[NDArray[np.float64]]:
    """Return outlines of a mask's parts and holes, (points, 2); pixel centres lie at halves."""
    whole = np.ascontiguousarray(mask, np.uint8)
    contours, _ = cv2.findContours(whole, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    return [np.asarray(points[:, 0] + 0.5, np.float64) for points in contours]


def outlines_of_run(run: Run) -> Outlines:
    """Return the stored contours or masks of a run, or else ellipses if the target is round."""
    outlines = {}
    for frame, arrays in run.arrays.items():
        lines = [np.asarray(arrays["contour"], np.float64)] if "contour" in arrays else []
        if not lines and "mask" in arrays:
            lines = mask_outlines(arrays["mask"])
        if lines:
            outlines[frame] = _joined(lines)
    if not outlines and is_round(run):
        angles = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
        unit = np.column_stack([np.cos(angles), np.sin(angles)])
        for frame in np.flatnonzero(np.isfinite(run.boxes).all(axis=1)).tolist():
            box = run.boxes[frame]
            outlines[frame] = box[:2] + box[2:] / 2 * (1 + unit)
    return outlines


def outlines_on(
    sequence: datasets.Sequence, by_tracker: Mapping[str, Outlines]
) -> Callable[[int], dict[str, NDArray[np.float64]]]:
    """Return a function of the frame that returns outlines by label, the true mask first."""

    def in_frame(frame: int) -> dict[str, NDArray[np.float64]]:
        here = {label: lines[frame] for label, lines in by_tracker.items() if frame in lines}
        mask = sequence.mask(frame)
        lines = [] if mask is None else mask_outlines(mask)
        return {TRUTH: _joined(lines), **here} if lines else here

    return in_frame


def _joined(lines: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.vstack([part for line in lines for part in (line, _GAP)])
