"""Boxes, ellipses or contours drawn on an image, at their exact place, with a legend beneath."""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.reports.palette import TRUTH_COLOUR, to_bgr

Shape: TypeAlias = Literal["box", "ellipse", "contour"]
"""What is drawn: a box by its edges, or by the ellipse inscribed in it; or a polygon."""

TRUTH = "truth"
"""Label of the boxes that are drawn as white dashes on a thin black line."""

GROUND = 28  # grey level of what surrounds images

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_SHIFT = 4  # cv2 takes coordinates in sixteenths of a pixel
_DASH = 4.0
_DARK, _LIGHT = (0, 0, 0), (255, 255, 255)
_FAR_ENOUGH = 60  # between two numbers of a ruler [pixels], so that they don't touch
_FARTHEST = 1e8
"""Largest coordinate that is drawn [px]: products of larger ones could overflow."""


def overlay(
    image: NDArray[np.uint8],
    boxes: Mapping[str, NDArray[np.float64]],
    colours: Mapping[str, str],
    scale: float = 1.0,
    words: str = "",
    shape: Shape = "box",
    lines: Mapping[str, NDArray[np.float64]] = MappingProxyType({}),
) -> NDArray[np.uint8]:
    """A copy of a BGR image, enlarged by a factor, with boxes on it.

    `boxes` are `[x, y, width, height]` in pixels of the image, by label; NaN boxes are not drawn.
    Contours are of shape (points, 2) instead, and a row of NaN parts one polygon from the next;
    `lines` are contours that are drawn besides, more thinly.
    `colours` are `#rrggbb` by label; `truth` is white and dashed. `words` are written into the left
    top corner.
    """
    interpolation = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
    size = [max(1, round(side * scale)) for side in image.shape[1::-1]]
    drawn = np.asarray(cv2.resize(image, size, interpolation=interpolation), np.uint8)
    # Sizes are whole pixels: the factors that came out differ a little from the one asked for.
    factors = np.divide(drawn.shape[1::-1], image.shape[1::-1])
    scales = factors if shape == "contour" else np.tile(factors, 2)
    placed = {
        label: np.clip(np.asarray(box, np.float64), -_FARTHEST, _FARTHEST) * scales
        for label, box in boxes.items()
        if shape == "contour" or np.isfinite(box).all()
    }
    truth = placed.pop(TRUTH, None)
    # Truth's dark line lies beneath all, its light dashes above all: seen on any ground, and
    # where a box is right on it, both are seen.
    if truth is not None:
        _draw(drawn, truth, shape, _DARK, 1)
    for label, box in placed.items():
        # A rim beneath keeps every colour readable on every ground.
        _draw(drawn, box, shape, _DARK, 3)
        _draw(drawn, box, shape, to_bgr(colours[label]), 2)
    for label, line in lines.items():
        outline = np.clip(np.asarray(line, np.float64), -_FARTHEST, _FARTHEST) * factors
        shade = to_bgr(TRUTH_COLOUR if label == TRUTH else colours[label])
        _draw(drawn, outline, "contour", _DARK, 2)
        _draw(drawn, outline, "contour", shade, 1, dashed=label == TRUTH)
    if truth is not None:
        _draw(drawn, truth, shape, to_bgr(TRUTH_COLOUR), 1, dashed=True)
    if words:
        write_words(drawn, words, (5, 17))
    return drawn


def legend(labels: Iterable[str], colours: Mapping[str, str], width: int) -> NDArray[np.uint8]:
    """A dark band of the given width that names every label beside its colour; wraps."""
    line_height, margin, key = 24, 10, 26
    rows: list[list[tuple[int, str]]] = [[]]
    x = margin
    for label in labels:
        needed = key + 8 + cv2.getTextSize(_text(label), _FONT, 0.5, 1)[0][0] + 22
        if x + needed > width and rows[-1]:
            rows.append([])
            x = margin
        rows[-1].append((x, label))
        x += needed
    band = np.full((line_height * len(rows) + 6, width, 3), GROUND, np.uint8)
    for number, row in enumerate(rows):
        y = 3 + line_height * number + line_height // 2
        for x, label in row:
            shade = to_bgr(TRUTH_COLOUR if label == TRUTH else colours[label])
            ends = np.array([[x, y], [x + key, y]], np.float64)
            _draw_line(band, ends, shade, 2, dashed=label == TRUTH)
            write_words(band, label, (x + key + 8, y + 5))
    return band


def _text(words: str) -> str:
    """Words without what is no text, of which OpenCV dies: parts of names that are no UTF-8."""
    return words.encode(errors="replace").decode()


def write_words(image: NDArray[np.uint8], words: str, at: tuple[int, int]) -> None:
    """Write light words with a dark rim, left end of the base line at `at` (x, y)."""
    words = _text(words)
    x, y = at
    for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        cv2.putText(image, words, (x + dx, y + dy), _FONT, 0.5, _DARK, 1, cv2.LINE_AA)
    cv2.putText(image, words, at, _FONT, 0.5, _LIGHT, 1, cv2.LINE_AA)


def draw_ruler(image: NDArray[np.uint8], scale: float) -> None:
    """Mark the pixels of an image that was enlarged by a factor, along its upper and left edge."""
    far = max(image.shape[:2]) / scale
    step = next(
        digit * 10**power
        for power in range(9)
        for digit in (1, 2, 5)
        if digit * 10**power * scale >= _FAR_ENOUGH
    )
    for number, pixel in enumerate(np.arange(0, far, step / 5).tolist()):
        at, length = round(pixel * scale), 5 if number % 5 else 10
        for shade, thickness in ((_DARK, 3), (_LIGHT, 1)):
            cv2.line(image, (at, 0), (at, length), shade, thickness)
            cv2.line(image, (0, at), (length, at), shade, thickness)
        if number and number % 5 == 0:
            write_words(image, f"{pixel:g}", (at + 4, 17))
            write_words(image, f"{pixel:g}", (12, at + 5))


def _draw(
    image: NDArray[np.uint8],
    box: NDArray[np.float64],
    shape: Shape,
    shade: tuple[int, int, int],
    thickness: int,
    *,
    dashed: bool = False,
) -> None:
    if shape == "contour":
        for polygon in np.split(box, np.flatnonzero(np.isnan(box[:, 0]))):
            ring = polygon[np.isfinite(polygon[:, 0])]
            _draw_line(image, np.vstack([ring, ring[:1]]), shade, thickness, dashed=dashed)
        return
    x, y, width, height = box
    if shape == "box":
        corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height], [x, y]]
        _draw_line(image, np.array(corners), shade, thickness, dashed=dashed)
        return
    # An even number of sides, each about as long as a dash: every other one is left out.
    sides = 2 * int(np.clip(np.pi * (width + height) / 4 / _DASH, 12, 400))
    angles = np.linspace(0, 2 * np.pi, sides + 1)
    unit = np.column_stack([np.cos(angles), np.sin(angles)])
    rim = np.array([x, y]) + np.array([width, height]) * (1 + unit) / 2
    for side in list(pairwise(rim))[:: 2 if dashed else 1]:
        _draw_line(image, np.array(side), shade, thickness, dashed=False)


def _draw_line(
    image: NDArray[np.uint8],
    points: NDArray[np.float64],
    shade: tuple[int, int, int],
    thickness: int,
    *,
    dashed: bool,
) -> None:
    """A line through points given in continuous coordinates (pixel i spans [i, i + 1))."""
    for start, stop in pairwise(points):
        length = float(np.hypot(*(stop - start)))
        pieces = max(1, int(length / (2 * _DASH))) if dashed else 1
        for piece in range(pieces):
            first = start + (stop - start) * piece / pieces
            last = start + (stop - start) * (piece + (0.5 if dashed else 1.0)) / pieces
            ends = [_fixed_point(end) for end in (first, last)]
            cv2.line(image, ends[0], ends[1], shade, thickness, cv2.LINE_AA, _SHIFT)


def _fixed_point(point: NDArray[np.float64]) -> tuple[int, int]:
    """Half a pixel less: cv2 counts from pixel centres. Kept within what cv2 can hold."""
    x, y = np.clip(np.round((point - 0.5) * (1 << _SHIFT)), -(1 << 24), 1 << 24).astype(int)
    return int(x), int(y)
