"""Film strips of a paper's figures: frames around the target, with outlines of both settings.

A strip has a column per frame and a row per tracker. White dashes are the ground truth, orange is
the setting as-written, and blue is the setting recommended.
"""

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import PIL.Image
from numpy.typing import NDArray
from PIL import ImageDraw, ImageFont

from trackmark.bench.papers import SETTING_LABELS
from trackmark.reports.overlay import TRUTH, Shape, overlay
from trackmark.reports.palette import DARK, LIGHT, to_bgr

Image = NDArray[np.uint8]
Outline = NDArray[np.float64]
"""Box `[x, y, width, height]`, or contour (points, 2) [px]."""

BOTH = "both settings"
"""Label of a run with equal parameters in both settings."""

PAPER = "paper"
"""Label of a note on the state of the target in the paper."""

SHADES = dict(zip([*SETTING_LABELS.values(), BOTH], [DARK[1], LIGHT[0], LIGHT[0]], strict=True))
COLOUR_SENTENCE = "White: ground truth; orange: as written; blue: recommended, or both settings."

MARGIN = 3.0  # width of a cut-out [target widths]
MIN_SIDE = 72  # of a cut-out [px of the frame]
TILE_WIDTH = 320  # of a frame in a strip [px]
GAP = 8  # between frames [px]
QUALITIES = (75, 65, 55, 45)  # of WebP; the first within the limit is used
MAX_BYTES = 150_000  # of a picture

_FONT_SIZE, _HEADING = 18, 30  # size of the text, and height of a line above a row [px]
_INK, _PAPER = (21, 24, 28), (255, 255, 255)


class Note(NamedTuple):
    """Text below a frame: label, remark and tone, which is a class of the page or empty."""

    label: str
    remark: str
    tone: str = ""


@dataclass(frozen=True)
class StripRow:
    """Row of a strip.

    Attributes
    ----------
    name : str
        Tracker, or content of the images.
    images : sequence of Image
        One BGR image per column.
    outlines : sequence of mapping of str to Outline
        Outlines by setting label, one mapping per column.
    notes : sequence of sequence of Note
        Texts below each image; empty for none.
    """

    name: str
    images: Sequence[Image]
    outlines: Sequence[Mapping[str, Outline]]
    notes: Sequence[Sequence[Note]] = ()


@dataclass(frozen=True)
class Strip:
    """Frames of a scene, with the same frames in all rows.

    Attributes
    ----------
    scene : str
        Specification of the scene, and how it was chosen.
    labels : sequence of str
        Labels of the columns, such as `frame 12`.
    truth : sequence of Outline
        Ground truth by column; NaN if the target is absent.
    rows : sequence of StripRow
        Rows in reading order.
    shape : str
        Shape of all outlines.
    """

    scene: str
    labels: Sequence[str]
    truth: Sequence[Outline]
    rows: Sequence[StripRow]
    shape: Shape = "box"

    @property
    def windows(self) -> list[tuple[int, ...]]:
        """Cut-out `(x, y, width, height)` of each column, of equal size around the target [px]."""
        height, width = self.rows[0].images[0].shape[:2]
        boxes = np.array([_bounds(outline, self.shape) for outline in self.truth])
        present = np.isfinite(boxes).all(axis=1)
        wide, tall = boxes[present, 2:].max(axis=0)
        side = max(MARGIN * max(wide, tall * width / height), MIN_SIDE)
        size = np.minimum(np.rint([side, side * height / width]), (width, height))
        windows, centre = [], boxes[present][0, :2] + boxes[present][0, 2:] / 2
        for box, is_present in zip(boxes, present, strict=True):
            centre = box[:2] + box[2:] / 2 if is_present else centre
            corner = np.clip(np.rint(centre - size / 2), 0, (width, height) - size)
            windows.append(tuple(int(value) for value in (*corner, *size)))
        return windows

    def tile(self, row: StripRow, column: int) -> Image:
        """Return a cut-out with its outlines, the label of the column and the paper's state.

        A dot at the edge marks the direction of an estimate outside the cut-out.
        """
        x, y, width, height = self.windows[column]
        image = row.images[column][y : y + height, x : x + width]
        scale = TILE_WIDTH / width
        outlines = {TRUTH: self.truth[column], **row.outlines[column]}
        moved = {label: _moved(outline, x, y, self.shape) for label, outline in outlines.items()}
        notes = row.notes[column] if row.notes else ()
        states = [f"paper: {note.remark}" for note in notes if note.label == PAPER]
        label = ", ".join([self.labels[column], *states])
        drawn = overlay(image, moved, SHADES, scale, label, self.shape)
        for label, outline in moved.items():
            _mark_outside(drawn, _bounds(outline, self.shape) * scale, SHADES.get(label, ""))
        return drawn


def draw_picture(strip: Strip) -> PIL.Image.Image:
    """Return all tiles of a strip, with the name of each row above it."""
    rows = [[strip.tile(row, column) for column in range(len(strip.labels))] for row in strip.rows]
    height, width = rows[0][0].shape[:2]
    size = len(strip.labels) * (width + GAP) - GAP, len(rows) * (_HEADING + height + GAP) - GAP
    picture = PIL.Image.new("RGB", size, _PAPER)
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(_FONT_SIZE)
    for index, (row, tiles) in enumerate(zip(strip.rows, rows, strict=True)):
        top = index * (_HEADING + height + GAP)
        draw.text((2, top + 4), row.name, _INK, font)
        for column, tile in enumerate(tiles):
            corner = column * (width + GAP), top + _HEADING
            picture.paste(PIL.Image.fromarray(np.ascontiguousarray(tile[..., ::-1])), corner)
    return picture


def to_webp(picture: PIL.Image.Image, qualities: Iterable[int] = QUALITIES) -> bytes:
    """Encode a picture as WebP, with the first quality that needs at most `MAX_BYTES`."""
    encoded = b""
    for quality in qualities:
        stream = io.BytesIO()
        picture.save(stream, "WEBP", quality=quality, method=6)
        encoded = stream.getvalue()
        if len(encoded) <= MAX_BYTES:
            break
    return encoded


def _bounds(outline: Outline, shape: Shape) -> Outline:
    """Return the box around an outline; NaN for an outline without points."""
    if shape != "contour":
        return outline
    points = outline[np.isfinite(outline).all(axis=1)]
    if not len(points):
        return np.full(4, np.nan)
    corner = points.min(axis=0)
    return np.concatenate([corner, points.max(axis=0) - corner])


def _moved(outline: Outline, x: int, y: int, shape: Shape) -> Outline:
    moved: Outline = outline - np.array([x, y] if shape == "contour" else [x, y, 0, 0])
    return moved


def _mark_outside(image: Image, box: Outline, shade: str) -> None:
    """Draw a dot at the edge of a tile if the centre of a box is outside the tile."""
    height, width = image.shape[:2]
    centre = box[:2] + box[2:] / 2
    if not shade or not np.isfinite(centre).all():
        return
    edge = np.clip(centre, 8, (width - 9, height - 9))
    if ((centre >= 0) & (centre <= (width, height))).all():
        return
    rows, columns = np.mgrid[:height, :width]
    distance = np.hypot(columns - edge[0], rows - edge[1])
    image[distance <= 8] = 0
    image[distance <= 6] = to_bgr(shade)
