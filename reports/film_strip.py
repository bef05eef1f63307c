"""Film strips: frames of a sequence side by side, with boxes or contours of all trackers."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.reports.files import write_file
from trackmark.reports.overlay import (
    BACKGROUND,
    TRUTH,
    Shape,
    draw_ruler,
    legend,
    overlay,
    write_words,
)
from trackmark.reports.palette import colours

FrameShapes: TypeAlias = NDArray[np.float64] | Mapping[int, NDArray[np.float64]]

DEFAULT_WIDTH = 1680
MAX_COLUMNS = 5
_GAP = 4


def evenly_spaced(first: int, last: int, count: int) -> list[int]:
    """Return at most `count` frame numbers from `first` to `last`, including both."""
    count = min(count, last - first + 1)
    return sorted({int(number) for number in np.linspace(first, last, count).round()})


def film_strip(
    image_of: Callable[[int], NDArray[np.uint8]],
    numbers: Sequence[int],
    boxes: Mapping[str, FrameShapes],
    title: str = "",
    columns: int = MAX_COLUMNS,
    width: int = DEFAULT_WIDTH,
    *,
    shape: Shape = "box",
    shades: Mapping[str, str] | None = None,
    words: Mapping[int, str] | None = None,
    count_from: int = 0,
    ruler: bool = False,
    lines_of: Callable[[int], Mapping[str, NDArray[np.float64]]] = lambda _: {},
) -> NDArray[np.uint8]:
    """Return a film strip: a BGR image, uint8 (height, width, 3).

    `image_of`: function that returns the BGR image of a frame. `numbers`: frames, at least one.
    `boxes`: boxes (n, 4) by label, one row per frame, or contours by frame; see `overlay`.
    `title`: text above the strip. `columns`: maximum number of frames in a row. `width`:
    approximate width [px]. `shades`: colours `#rrggbb` by label; by order of the labels by default.
    `words`: text after the frame number. `count_from`: printed number of the first frame of
    the sequence. `ruler`: mark pixels along the upper and the left edge of each frame. `lines_of`:
    function of the frame number that returns further outlines by label; see `overlay`.
    """
    columns = min(columns, len(numbers))
    words = words or {}
    shades = shades or colours([label for label in boxes if label != TRUTH])
    tiles = []
    for number in numbers:
        image = image_of(number)
        scale = (width - _GAP * (columns - 1)) / columns / image.shape[1]
        frame_boxes = {label: rows[number] for label, rows in boxes.items()}
        text = f"{number + count_from} {words.get(number, '')}".strip()
        lines = lines_of(number)
        tile = overlay(image, frame_boxes, shades, scale, "" if ruler else text, shape, lines)
        tiles.append(tile)
        if ruler:
            draw_ruler(tile, scale)
            write_words(tile, text, (14, 36))  # below the numbers along the edge
    height, wide = tiles[0].shape[:2]
    head, n_rows = 28 if title else 0, -(-len(tiles) // columns)
    size = head + n_rows * (height + _GAP), columns * (wide + _GAP) - _GAP
    strip = np.full((*size, 3), BACKGROUND, np.uint8)
    if title:
        write_words(strip[:head], title, (10, 19))
    for place, tile in enumerate(tiles):
        row, column = divmod(place, columns)
        top, left = head + row * (height + _GAP), column * (wide + _GAP)
        strip[top : top + height, left : left + wide] = tile
    return np.vstack([strip, legend(boxes, shades, size[1])]) if boxes else strip


def write_film_strip(path: Path, strip: NDArray[np.uint8]) -> Path:
    """Write a strip as PNG; for errors see `write_file`."""

    def write(file: Path) -> None:
        encoded, data = cv2.imencode(".png", strip)
        if not encoded:
            raise OSError("OpenCV cannot encode the film strip as PNG")
        file.write_bytes(data.tobytes())

    return write_file(path, write)
