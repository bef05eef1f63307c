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
_N_ELLIPSE_POINTS = 64


def is_round(run: Run) -> bool:
    """Return whether the target is the ellipse in the box: the run then contains its half axes."""
    return {"half_width", "half_height"} <= run.details.keys()


def mask_outlines(mask: NDArray[Any]) -> list[NDArray[np.float64]]:
    """Return outlines of parts and holes of a mask, (points, 2); pixel centres are at i + 0.5."""
    whole = np.ascontiguousarray(mask, np.uint8)
    contours, _ = cv2.findContours(whole, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    return [np.asarray(points[:, 0] + 0.5, np.float64) for points in contours]


def outlines_of_run(run: Run) -> Outlines:
    """Return outlines of a run by frame: stored contours, masks or ellipses of round targets."""
    outlines = {}
    for frame, arrays in run.arrays.items():
        lines = [np.asarray(arrays["contour"], np.float64)] if "contour" in arrays else []
        if not lines and "mask" in arrays:
            lines = mask_outlines(arrays["mask"])
        if lines:
            outlines[frame] = _join(lines)
    if not outlines and is_round(run):
        angles = np.linspace(0, 2 * np.pi, _N_ELLIPSE_POINTS, endpoint=False)
        unit = np.column_stack([np.cos(angles), np.sin(angles)])
        for frame in np.flatnonzero(np.isfinite(run.boxes).all(axis=1)).tolist():
            box = run.boxes[frame]
            outlines[frame] = box[:2] + box[2:] / 2 * (1 + unit)
    return outlines


def outlines_on(
    sequence: datasets.Sequence, by_tracker: Mapping[str, Outlines]
) -> Callable[[int], dict[str, NDArray[np.float64]]]:
    """Return a function `frame -> outlines by label`, with the ground-truth mask first."""

    def in_frame(frame: int) -> dict[str, NDArray[np.float64]]:
        outlines = {label: lines[frame] for label, lines in by_tracker.items() if frame in lines}
        mask = sequence.mask(frame)
        lines = [] if mask is None else mask_outlines(mask)
        return {TRUTH: _join(lines), **outlines} if lines else outlines

    return in_frame


def _join(lines: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.vstack([part for line in lines for part in (line, _GAP)])
