"""Boxes, ellipses and contours on images, with sub-pixel accuracy, and film strips of them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.reports.palette import TRUTH_COLOUR, colours, to_bgr

Shape: TypeAlias = Literal["box", "ellipse", "contour"]
"""Drawn shape: the edges of a box, the ellipse inscribed in a box, or a polygon."""

TRUTH = "ground truth"
"""Label of the ground truth, which is drawn as white dashes on a thin black line."""

BACKGROUND = 16  # grey level around images

STRIP_WIDTH = 1680
"""Approximate width of a film strip [px]."""

_GAP = 4  # between the frames of a film strip [px]

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_SHIFT = 4  # coordinates in cv2 are multiples of 2**-4 px
_DASH = 4.0
_DARK, _LIGHT = (0, 0, 0), (255, 255, 255)
_MAX_COORDINATE = 1e5
"""Largest coordinate that is drawn [px]: OpenCV cannot draw much larger ones."""


def overlay(
    image: NDArray[np.uint8],
    boxes: Mapping[str, NDArray[np.float64]],
    colours: Mapping[str, str],
    scale: float = 1.0,
    caption: str = "",
    shape: Shape = "box",
    lines: Mapping[str, NDArray[np.float64]] = MappingProxyType({}),
) -> NDArray[np.uint8]:
    """Return a copy of a BGR image, enlarged by a factor, with boxes.

    `boxes`: boxes `[x, y, width, height]` by label [px]; NaN boxes are not drawn. With the shape
    `contour`: points (n, 2), in which a row of NaN separates two polygons. `colours`: `#rrggbb` by
    label; the label `truth` is white and dashed. `caption`: text in the upper left corner. `lines`:
    further contours, drawn with thinner lines.
    """
    interpolation = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
    size = [max(1, round(side * scale)) for side in image.shape[1::-1]]
    drawn = np.asarray(cv2.resize(image, size, interpolation=interpolation), np.uint8)
    if caption:
        _write_caption(drawn, caption)  # below the boxes, so that it hides none
    # Sizes are whole pixels: the actual factors differ slightly from `scale`.
    factors = np.divide(drawn.shape[1::-1], image.shape[1::-1])
    placed = {label: _polygons(box, shape, factors) for label, box in boxes.items()}
    truth = placed.pop(TRUTH, [])
    # The dark line of the ground truth is below all boxes, its light dashes are above: it is
    # visible on any background, and both are visible if a box has the same position.
    _draw(drawn, truth, _DARK, 1)
    for label, polygons in placed.items():
        # A dark line below keeps every colour visible on any background.
        _draw(drawn, polygons, _DARK, 3)
        _draw(drawn, polygons, to_bgr(colours[label]), 2)
    for label, line in lines.items():
        outline = _polygons(line, "contour", factors)
        _draw(drawn, outline, _DARK, 2)
        shade = to_bgr(TRUTH_COLOUR if label == TRUTH else colours[label])
        _draw(drawn, outline, shade, 1, dashed=label == TRUTH)
    _draw(drawn, truth, to_bgr(TRUTH_COLOUR), 1, dashed=True)
    return drawn


def _write_caption(image: NDArray[np.uint8], caption: str) -> None:
    """Write light text on a dark plate in the upper left corner, larger in wider images."""
    caption = _replace_surrogates(caption)
    size = min(max(image.shape[1] / 480, 0.5), 0.8)
    width = cv2.getTextSize(caption, _FONT, size, 1)[0][0]
    bottom, base_line = round(40 * size), round(28 * size)  # the same for all letters
    cv2.rectangle(image, (0, 0), (width + 9, bottom), _DARK, cv2.FILLED)
    cv2.putText(image, caption, (5, base_line), _FONT, size, _LIGHT, 1, cv2.LINE_AA)


def legend(labels: Iterable[str], colours: Mapping[str, str], width: int) -> NDArray[np.uint8]:
    """Return a dark image of this width with all labels and their colours, in several lines."""
    line_height, margin, key = 24, 10, 26
    positions: list[tuple[int, int, str]] = []
    x, y = margin, 3 + line_height // 2
    for label in labels:
        needed = key + 8 + cv2.getTextSize(_replace_surrogates(label), _FONT, 0.5, 1)[0][0] + 22
        if margin < x > width - needed:
            x, y = margin, y + line_height
        positions.append((x, y, label))
        x += needed
    band = np.full((y + line_height // 2 + 3, width, 3), BACKGROUND, np.uint8)
    for x, y, label in positions:
        shade = to_bgr(TRUTH_COLOUR if label == TRUTH else colours[label])
        ends = np.array([[x, y], [x + key, y]], np.float64)
        _draw(band, [ends], shade, 2, dashed=label == TRUTH)
        write_line(band, label, (x + key + 8, y + 5))
    return band


def _replace_surrogates(line: str) -> str:
    """Replace surrogates, which names that are not UTF-8 contain and on which OpenCV crashes."""
    return line.encode(errors="replace").decode()


def write_line(image: NDArray[np.uint8], line: str, origin: tuple[int, int]) -> None:
    """Write light text with a dark outline; `origin`: left end (x, y) of the base line."""
    line = _replace_surrogates(line)
    x, y = origin
    for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        cv2.putText(image, line, (x + dx, y + dy), _FONT, 0.5, _DARK, 1, cv2.LINE_AA)
    cv2.putText(image, line, origin, _FONT, 0.5, _LIGHT, 1, cv2.LINE_AA)


def _polygons(
    box: NDArray[np.float64], shape: Shape, factors: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Return the closed outlines of a shape, (points, 2), in an enlarged image; none for NaN."""
    box = np.asarray(box, np.float64).clip(-_MAX_COORDINATE, _MAX_COORDINATE)
    if shape == "contour":
        contours = np.split(box, np.flatnonzero(np.isnan(box[:, 0])))
        outlines = [contour[np.isfinite(contour[:, 0])] for contour in contours]
    elif shape == "box":
        outlines = [box[:2] + box[2:] * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])]
    else:  # the sides are as long as two dashes
        n_sides = np.clip(np.pi * (box[2:] * factors).mean() / (2 * _DASH), 24, 400)
        angles = np.linspace(0, 2 * np.pi, int(np.nan_to_num(n_sides)), endpoint=False)
        unit = np.column_stack([np.cos(angles), np.sin(angles)])
        outlines = [box[:2] + box[2:] * (1 + unit) / 2]
    return [np.vstack([ring, ring[:1]]) * factors for ring in outlines if np.isfinite(ring).all()]


def _draw(
    image: NDArray[np.uint8],
    lines: Sequence[NDArray[np.float64]],
    shade: tuple[int, int, int],
    thickness: int,
    *,
    dashed: bool = False,
) -> None:
    """Draw lines through points in continuous coordinates (pixel i spans [i, i + 1))."""
    for start, stop in (ends for line in lines for ends in pairwise(line)):
        length = float(np.hypot(*(stop - start)))
        n_dashes = max(1, int(length / (2 * _DASH))) if dashed else 1
        for dash in range(n_dashes):
            shares = np.array([[dash], [dash + (0.5 if dashed else 1.0)]]) / n_dashes
            # Coordinates of OpenCV count from pixel centres.
            ends = (start + (stop - start) * shares - 0.5) * (1 << _SHIFT)
            first, last = np.round(ends).astype(int).tolist()
            cv2.line(image, first, last, shade, thickness, cv2.LINE_AA, _SHIFT)


def evenly_spaced(first: int, last: int, count: int) -> list[int]:
    """Return at most `count` frame numbers from `first` to `last`, including both."""
    count = min(count, last - first + 1)
    return sorted({int(number) for number in np.linspace(first, last, count).round()})


def film_strip(
    image_of: Callable[[int], NDArray[np.uint8]],
    frames: Sequence[int],
    boxes: Mapping[str, NDArray[np.float64]],
    title: str = "",
    columns: int = 5,
    *,
    shades: Mapping[str, str] | None = None,
    lines_of: Callable[[int], Mapping[str, NDArray[np.float64]]] = lambda _: {},
) -> NDArray[np.uint8]:
    """Return a film strip: a BGR image, uint8 (height, width, 3).

    `image_of`: function that returns the BGR image of a frame. `frames`: frames, at least one.
    `boxes`: boxes (n, 4) by label, one row per frame. `title`: text above the strip. `columns`:
    maximum number of frames in a row. `shades`: colours `#rrggbb` by label; by order of the labels
    by default. `lines_of`: function of the frame number that returns outlines by label; see
    `overlay`.
    """
    columns = min(columns, len(frames))
    shades = shades or colours([label for label in boxes if label != TRUTH])
    tiles = []
    for frame in frames:
        image = image_of(frame)
        scale = (STRIP_WIDTH - _GAP * (columns - 1)) / columns / image.shape[1]
        frame_boxes = {label: rows[frame] for label, rows in boxes.items()}
        tiles.append(overlay(image, frame_boxes, shades, scale, str(frame), lines=lines_of(frame)))
    height, wide = tiles[0].shape[:2]
    title_height, n_rows = 28 if title else 0, -(-len(tiles) // columns)
    size = title_height + n_rows * (height + _GAP), columns * (wide + _GAP) - _GAP
    strip = np.full((*size, 3), BACKGROUND, np.uint8)
    if title:
        write_line(strip[:title_height], title, (10, 19))
    for index, tile in enumerate(tiles):
        row, column = divmod(index, columns)
        top, left = title_height + row * (height + _GAP), column * (wide + _GAP)
        strip[top : top + height, left : left + wide] = tile
    return np.vstack([strip, legend(boxes, shades, size[1])]) if boxes else strip


def save_png(file: Path, image: NDArray[np.uint8]) -> None:
    """Save a BGR image, such as a film strip, as PNG."""
    file.write_bytes(cv2.imencode(".png", image)[1].tobytes())
