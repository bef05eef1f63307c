"""Outlines of what runs and truth tell besides boxes: masks, contours, ellipses."""

from collections.abc import Callable, Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.evaluation.record import Run
from datasets import Sequence
from reports.overlay import TRUTH

Outlines = Mapping[int, NDArray[np.float64]]
"""Polygons by frame, (points, 2) [pixels]; a row of NaN parts one from the next."""

_GAP = np.full((1, 2), np.nan)
_CORNERS = 64  # of the polygon that stands for an ellipse


def is_round(run: Run) -> bool:
    """Whether the target is the ellipse inscribed in the box: the tracker tells its half axes."""
    return {"half_width", "half_height"} <= run.details.keys()


def mask_outlines(mask: NDArray[Any]) -> list[NDArray[np.float64]]:
    """Outlines of a mask's parts and holes, (points, 2) each; pixel centres lie at halves."""
    whole = np.ascontiguousarray(mask, np.uint8)
    found, _ = cv2.findContours(whole, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    return [np.asarray(outline[:, 0] + 0.5, np.float64) for outline in found]


def outlines_of_run(run: Run) -> Outlines:
    """Contours or masks where the run kept them; else ellipses, where they are meant."""
    found = {}
    for frame, arrays in run.arrays.items():
        lines = [np.asarray(arrays["contour"], np.float64)] if "contour" in arrays else []
        if not lines and "mask" in arrays:
            lines = mask_outlines(arrays["mask"])
        if lines:
            found[frame] = _parted(lines)
    if not found and is_round(run):
        angles = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
        unit = np.column_stack([np.cos(angles), np.sin(angles)])
        for frame in np.flatnonzero(np.isfinite(run.boxes).all(axis=1)).tolist():
            box = run.boxes[frame]
            found[frame] = box[:2] + box[2:] / 2 * (1 + unit)
    return found


def outlines_on(
    sequence: Sequence, said: Mapping[str, Outlines]
) -> Callable[[int], dict[str, NDArray[np.float64]]]:
    """What gives the outlines of a frame by label: those that trackers said, and the true mask."""

    def on(frame: int) -> dict[str, NDArray[np.float64]]:
        here = {label: outlines[frame] for label, outlines in said.items() if frame in outlines}
        mask = sequence.mask(frame)
        lines = [] if mask is None else mask_outlines(mask)
        return {TRUTH: _parted(lines), **here} if lines else here

    return on


def _parted(lines: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.vstack([part for line in lines for part in (line, _GAP)])
