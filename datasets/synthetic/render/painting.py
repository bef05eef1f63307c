"""Painting operations in metres: plates, discs, wires, labels."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array

Colour = Array

Point = tuple[float, float]


class Painting:
    """Canvas on which positions and sizes are in metres, from its upper left corner.

    Operations change `picture` in place. `scale` is in pixels/metre; (`left`, `top`) is the
    position of the canvas in the picture [metres].
    """

    def __init__(
        self, picture: NDArray[np.uint8], scale: float, left: float = 0.0, top: float = 0.0
    ) -> None:
        self.picture = picture
        self.scale = scale
        self.left, self.top = left, top

    def part(self, x: float, y: float) -> "Painting":
        """Return a canvas on the same picture with its origin at a point."""
        return Painting(self.picture, self.scale, self.left + x, self.top + y)

    def patch(self, x: float, y: float, width: float, height: float, colour: ArrayLike) -> None:
        """Paint a flat rectangle."""
        (x0, y0), (x1, y1) = self._to_pixel((x, y)), self._to_pixel((x + width, y + height))
        cv2.rectangle(self.picture, (x0, y0), (max(x1 - 1, x0), max(y1 - 1, y0)), _bgr(colour), -1)

    def plate(
        self,
        x: float,
        y: float,
        width: float,
        height: float,
        colour: ArrayLike,
        depth: float = 0.012,
    ) -> None:
        """Paint a raised rectangle, lit from the upper left, with a shadow at the lower right."""
        paint = np.asarray(colour, np.float64)
        self.darken(x + depth, y + depth, width, height, 0.62)
        self.patch(x, y, width, height, paint)
        rim = min(depth * 0.4, 0.006)
        self.patch(x, y, width, rim, paint * 1.22)
        self.patch(x, y, rim, height, paint * 1.14)
        self.patch(x, y + height - rim, width, rim, paint * 0.62)
        self.patch(x + width - rim, y, rim, height, paint * 0.70)

    def hole(self, x: float, y: float, width: float, height: float, colour: ArrayLike) -> None:
        """Paint a recessed rectangle with the shadow of its upper left rim."""
        self.patch(x, y, width, height, colour)
        rim = min(0.03, 0.25 * width, 0.25 * height)
        self.darken(x, y, width, rim, 0.55)
        self.darken(x, y + rim, rim, height - rim, 0.65)

    def darken(self, x: float, y: float, width: float, height: float, gain: float) -> None:
        """Multiply the colours in a rectangle by a gain."""
        (x0, y0), (x1, y1) = self._to_pixel((x, y)), self._to_pixel((x + width, y + height))
        area = self.picture[max(y0, 0) : max(y1, 0), max(x0, 0) : max(x1, 0)]
        area[:] = np.clip(np.round(area * gain), 0, 255).astype(np.uint8)

    def disc(self, x: float, y: float, radius: float, colour: ArrayLike) -> None:
        """Paint a filled circle."""
        cv2.circle(
            self.picture,
            self._to_pixel((x, y)),
            self._to_pixels(radius),
            _bgr(colour),
            -1,
            cv2.LINE_AA,
        )

    def knob(self, x: float, y: float, radius: float, colour: ArrayLike) -> None:
        """Paint a raised disc with a shadow and a highlight."""
        paint = np.asarray(colour, np.float64)
        self.disc(x + 0.3 * radius, y + 0.35 * radius, radius, (38, 38, 40))
        self.disc(x, y, radius, paint * 0.8)
        self.disc(x - 0.08 * radius, y - 0.1 * radius, 0.8 * radius, paint)
        self.disc(x - 0.3 * radius, y - 0.35 * radius, 0.25 * radius, paint * 0.5 + 110)

    def line(self, points: Sequence[Point], width: float, colour: ArrayLike) -> None:
        """Paint an open polyline."""
        placed = np.array([self._to_pixel(point) for point in points], np.int32)
        thick = max(1, round(width * self.scale))
        cv2.polylines(self.picture, [placed], False, _bgr(colour), thick, cv2.LINE_AA)

    def area(self, points: Sequence[Point], colour: ArrayLike) -> None:
        """Paint a filled polygon."""
        placed = np.array([self._to_pixel(point) for point in points], np.int32)
        cv2.fillPoly(self.picture, [placed], _bgr(colour), cv2.LINE_AA)

    def pipe(self, start: Point, end: Point, radius: float, colour: ArrayLike) -> None:
        """Paint a round pipe with a shadow, lit from the upper left."""
        paint = np.asarray(colour, np.float64)
        off = 0.7 * radius
        self.line(
            [(start[0] + off, start[1] + off), (end[0] + off, end[1] + off)],
            2 * radius,
            (44, 46, 48),
        )
        for shift, wide, gain in (
            (0.0, 2.0, 0.6),
            (-0.15, 1.5, 0.85),
            (-0.3, 0.9, 1.1),
            (-0.4, 0.35, 1.4),
        ):
            offset = shift * radius
            self.line(
                [(start[0] + offset, start[1] + offset), (end[0] + offset, end[1] + offset)],
                wide * radius,
                paint * gain,
            )

    def wire(self, start: Point, end: Point, sag: float, width: float, colour: ArrayLike) -> None:
        """Paint a cable that hangs between two points."""
        t = np.linspace(0, 1, 14)
        x = start[0] + (end[0] - start[0]) * t
        y = start[1] + (end[1] - start[1]) * t + 4 * sag * t * (1 - t)
        self.line(list(zip(x.tolist(), y.tolist(), strict=True)), width, colour)

    def label(
        self, random: Generator, x: float, y: float, width: float, height: float,
        paper: ArrayLike = (214, 218, 220), ink: ArrayLike = (60, 56, 54),
    ) -> None:  # fmt: skip
        """Paint a label with lines of illegible text."""
        self.patch(x, y, width, height, paper)
        rows = max(1, int(height / 0.022))
        for row in range(rows):
            place = x + 0.08 * width
            middle = y + (row + 0.5) * height / rows
            while place < x + 0.88 * width:
                word = min(random.uniform(0.08, 0.3) * width, x + 0.92 * width - place)
                self.line([(place, middle), (place + word, middle)], 0.35 * height / rows, ink)
                place += word + 0.06 * width

    def _to_pixel(self, point: Point) -> tuple[int, int]:
        return round((self.left + point[0]) * self.scale), round((self.top + point[1]) * self.scale)

    def _to_pixels(self, length: float) -> int:
        return max(1, round(length * self.scale))


def _bgr(colour: ArrayLike) -> tuple[float, ...]:
    return tuple(np.clip(np.asarray(colour, np.float64), 0, 255).tolist())
