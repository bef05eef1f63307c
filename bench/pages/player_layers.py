"""Layers of the player in addition to boxes: outlines, particles, maps and numbers."""

from collections.abc import Iterable, Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.bench.analysis.outlines import mask_outlines
from trackmark.bench.evaluation.recorder import MAP
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.pages.content import FrameChunks
from trackmark.bench.pages.player_frames import encode_images
from trackmark.bench.store.truth import StoredTruth

_MAX_PARTICLES = 300  # per frame, approximately

_MAX_MAP_HEIGHT = 160  # pixels


def shapes(run: Run) -> dict[int, dict[str, Any]]:
    """Return outlines of masks and contours, and particles, as lists of points by frame."""
    shapes_by_frame: dict[int, dict[str, Any]] = {}
    for frame, arrays in run.arrays.items():
        contours = [_points(arrays["contour"])] if "contour" in arrays else []
        masks = _outlines(arrays["mask"]) if "mask" in arrays else []
        kinds = {"contours": contours, "masks": masks, "particles": _particles(arrays)}
        if nonempty := {kind: points for kind, points in kinds.items() if points}:
            shapes_by_frame[frame] = nonempty
    return shapes_by_frame


def true_shapes(truth: StoredTruth) -> dict[int, dict[str, Any]]:
    """Return outlines of the ground truth by frame, if it is more than a box."""
    shapes_by_frame = {}
    for frame, shape in enumerate(truth.shapes or ()):
        if shape is not None:
            is_mask = shape.dtype == np.bool_
            shape_type, lines = (
                ("masks", _outlines(shape)) if is_mask else ("contours", [_points(shape)])
            )
            shapes_by_frame[frame] = {shape_type: lines}
    return shapes_by_frame


def mask_shapes(masks: Iterable[tuple[int, NDArray[np.bool_] | None]]) -> dict[int, dict[str, Any]]:
    """Return outlines of masks by frame, in the form of `true_shapes`."""
    return {frame: {"masks": _outlines(mask)} for frame, mask in masks if mask is not None}


def maps(run: Run) -> dict[str, FrameChunks]:
    """Return weight maps in false colours by name; frames without a map are empty."""
    levels_by_name: dict[str, dict[int, NDArray[np.uint8]]] = {}
    for frame, arrays in run.arrays.items():
        for name, values in arrays.items():
            if name.startswith(MAP) and values.dtype == np.uint8 and values.ndim == 2:
                levels_by_name.setdefault(name.removeprefix(MAP), {})[frame] = values
            elif name == "posterior" and values.ndim == 2:
                levels = np.rint(255 * np.clip(np.nan_to_num(values), 0, 1)).astype(np.uint8)
                levels_by_name.setdefault(name, {})[frame] = levels
    n = len(run.boxes)
    return {
        name: list(
            encode_images((_coloured(levels.get(frame)) for frame in range(n)), _MAX_MAP_HEIGHT)
        )
        for name, levels in levels_by_name.items()
    }


def tracker_values(run: Run) -> dict[str, list[float | None]]:
    """Return the values of the tracker by name, to five digits; None for missing values."""
    values_by_name = {"confidence": run.confidence, **run.details}
    return {
        name: [float(f"{value:.5g}") if np.isfinite(value) else None for value in values.tolist()]
        for name, values in values_by_name.items()
        if np.isfinite(values).any()
    }


def _coloured(levels: NDArray[np.uint8] | None) -> NDArray[np.uint8] | None:
    if levels is None:
        return None
    return np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_INFERNO), np.uint8)


def _particles(arrays: Mapping[str, NDArray[Any]]) -> list[list[float]]:
    """Return positions (x, y) of particles with their weights as shares of the largest."""
    positions = np.asarray(arrays.get("particles", np.empty((0, 2))))
    if positions.ndim != 2 or positions.shape[1] < 2:
        return []
    weights = np.asarray(arrays.get("weights", ()), np.float64)
    if weights.shape != (len(positions),) or not weights.max(initial=0) > 0:
        weights = np.ones(len(positions))
    step = max(1, len(positions) // _MAX_PARTICLES)
    rows = np.column_stack([positions[:, :2], weights / weights.max(initial=1e-300)])[::step]
    rows = rows[np.isfinite(rows).all(axis=1)]
    return [[round(x, 1), round(y, 1), round(weight, 2)] for x, y, weight in rows.tolist()]


def _outlines(mask: NDArray[Any]) -> list[list[list[float]]]:
    return [_points(outline) for outline in mask_outlines(mask)]


def _points(points: NDArray[Any]) -> list[list[float]]:
    """Return the finite points (k, 2), rounded to a tenth of a pixel."""
    points = np.asarray(points, np.float64).reshape(-1, 2)
    rounded: list[list[float]] = points[np.isfinite(points).all(axis=1)].round(1).tolist()
    return rounded
