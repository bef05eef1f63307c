"""Film strips: chosen frames of a sequence side by side, with everybody's boxes or contours."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.reports.files import write_file
from trackmark.reports.overlay import GROUND, TRUTH, Shape, draw_ruler, legend, overlay, write_words
from trackmark.reports.palette import colours

Places: TypeAlias = NDArray[np.float64] | Mapping[int, NDArray[np.float64]]

WIDTH = 1680
COLUMNS = 5
_GAP = 4


def evenly_spaced(first: int, last: int, count: int) -> list[int]:
    """At most `count` frame numbers from `first` to `last`, both included."""
    count = min(count, last - first + 1)
    return sorted({int(number) for number in np.linspace(first, last, count).round()})


def film_strip(
    image_of: Callable[[int], NDArray[np.uint8]],
    numbers: Sequence[int],
    boxes: Mapping[str, Places],
    title: str = "",
    columns: int = COLUMNS,
    width: int = WIDTH,
    *,
    shape: Shape = "box",
    shades: Mapping[str, str] | None = None,
    words: Mapping[int, str] | None = None,
    count_from: int = 0,
    ruler: bool = False,
    lines_of: Callable[[int], Mapping[str, NDArray[np.float64]]] = lambda _: {},
) -> NDArray[np.uint8]:
    """Draw a film strip: a BGR image of about so much width [pixels], uint8 (height, width, 3).

    `image_of` gives the BGR image of a frame; `numbers`, at least one, are the frames to show, at
    most `columns` in a row. `boxes` (n, 4) are by label, a row a frame, or contours by frame (see
    `overlay`); `shades` are `#rrggbb` by label, in order of the labels by default. `title` is
    written above, `words` beside the number of a frame, and the first frame's number is said to be
    `count_from`. With `ruler`, pixels are marked along the upper and the left edge of each frame.
    `lines_of` gives outlines by label, of a frame's number, which are drawn, too; see `overlay`.
    """
    columns = min(columns, len(numbers))
    words = words or {}
    shades = shades or colours([label for label in boxes if label != TRUTH])
    tiles = []
    for number in numbers:
        image = image_of(number)
        scale = (width - _GAP * (columns - 1)) / columns / image.shape[1]
        here = {label: rows[number] for label, rows in boxes.items()}
        said = f"{number + count_from} {words.get(number, '')}".strip()
        lines = lines_of(number)
        tiles.append(overlay(image, here, shades, scale, "" if ruler else said, shape, lines))
        if ruler:
            draw_ruler(tiles[-1], scale)
            write_words(tiles[-1], said, (14, 36))  # beneath the numbers along the edge
    height, wide = tiles[0].shape[:2]
    head, n_rows = 28 if title else 0, -(-len(tiles) // columns)
    size = head + n_rows * (height + _GAP), columns * (wide + _GAP) - _GAP
    strip = np.full((*size, 3), GROUND, np.uint8)
    if title:
        write_words(strip[:head], title, (10, 19))
    for place, tile in enumerate(tiles):
        row, column = divmod(place, columns)
        top, left = head + row * (height + _GAP), column * (wide + _GAP)
        strip[top : top + height, left : left + wide] = tile
    return np.vstack([strip, legend(boxes, shades, size[1])]) if boxes else strip


def write_film_strip(path: Path, strip: NDArray[np.uint8]) -> Path:
    """Write a strip as PNG, whole or not at all; see `write_file`."""

    def write(file: Path) -> None:
        encoded, data = cv2.imencode(".png", strip)
        if not encoded:
            raise OSError("OpenCV can't encode it as PNG")
        file.write_bytes(data.tobytes())

    return write_file(path, write)
