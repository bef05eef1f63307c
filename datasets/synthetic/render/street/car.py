"""Parked cars, seen from the side."""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.prop import Prop

__all__ = ["car"]

PAINTS = (
    (176, 180, 182),
    (60, 58, 58),
    (120, 84, 52),
    (52, 44, 130),
    (206, 210, 212),
    (84, 96, 60),
    (110, 110, 112),
    (70, 120, 150),
)
FINE = 3  # painted larger, then made smaller

# Outlines in metres, forward to the right, up from the ground.
_BODY = [(-2.05, 0.34), (-2.08, 0.62), (-2.0, 0.86), (-1.6, 0.94), (-1.05, 0.97), (-0.62, 1.38),
         (-0.3, 1.44), (0.4, 1.43), (0.72, 1.34), (1.22, 0.96), (1.78, 0.86), (2.04, 0.68),
         (2.1, 0.42), (2.06, 0.30), (-2.0, 0.28)]  # fmt: skip
_GLASS = [[(-0.9, 0.98), (-0.55, 1.33), (-0.04, 1.37), (-0.04, 0.98)],
          [(0.04, 0.98), (0.04, 1.37), (0.42, 1.36), (0.66, 1.28), (1.02, 0.97)]]  # fmt: skip
_WHEELS = (-1.3, 1.32)


def car(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """A small car, parked along the kerb, either way round.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws paint, size and direction.
    x, z : float
        Where its middle stands [metres].
    scale : float
        At its depth [pixels/metre].
    """
    metre = scale * random.uniform(0.98, 1.1)
    fine = FINE * metre
    height, width = round(1.75 * metre), round(4.7 * metre)
    foot = height - round(0.16 * metre)
    picture = np.zeros((FINE * height, FINE * width, 3), np.uint8)
    mask = np.zeros((FINE * height, FINE * width), np.uint8)
    stretch = np.array([1.0, random.uniform(0.95, 1.08)])

    def at(points: list[tuple[float, float]]) -> NDArray[np.int32]:
        placed = np.array(points) * stretch
        return np.round(
            np.stack([FINE * width / 2 + placed[:, 0] * fine, FINE * foot - placed[:, 1] * fine], 1)
        ).astype(np.int32)

    def paint(points: list[tuple[float, float]], colour: NDArray[np.float64]) -> None:
        cv2.fillPoly(picture, [at(points)], colour.tolist())

    body = np.array(PAINTS[random.integers(len(PAINTS))], np.float64) * random.uniform(0.85, 1.1)
    cv2.fillPoly(mask, [at(_BODY)], 255)
    paint(_BODY, body)
    # Sheet metal: sky above, dark street below, a crease between.
    for low, high, gain in ((0.28, 0.45, 0.55), (0.45, 0.62, 0.78), (0.80, 0.88, 1.16),
                            (0.88, 0.99, 1.3), (1.36, 1.5, 1.22)):  # fmt: skip
        top, bottom = at([(0, high)])[0, 1], at([(0, low)])[0, 1]
        band = picture[top:bottom]
        band[:] = np.clip(band * gain, 0, 255).astype(np.uint8)
    for pane in _GLASS:
        paint(pane, np.array([70.0, 62.0, 56.0]))
        upper = [(a, max(b, 1.17)) for a, b in pane]
        paint(upper, np.array([128.0, 118.0, 108.0]))
    dark = body * 0.55
    for place in (-0.95, 0.0, 0.98):
        start, end = at([(place, 0.4), (place, 0.97)]).tolist()
        cv2.line(picture, start, end, dark.tolist(), FINE)
    for place in (-0.82, 0.16):
        paint([(place, 0.84), (place + 0.16, 0.84), (place + 0.16, 0.87), (place, 0.87)], dark)
    paint([(1.86, 0.62), (2.06, 0.60), (2.02, 0.72), (1.84, 0.76)], np.array([216.0, 220.0, 222.0]))
    paint(
        [(-2.06, 0.66), (-1.94, 0.66), (-1.92, 0.84), (-2.0, 0.84)], np.array([40.0, 36.0, 150.0])
    )
    for place in _WHEELS:
        hub = at([(place, 0.31)])[0].tolist()
        cv2.circle(picture, hub, round(0.385 * fine), (24, 22, 22), -1)
        cv2.circle(mask, hub, round(0.31 * fine), 255, -1)
        cv2.circle(picture, hub, round(0.31 * fine), (38, 36, 36), -1)
        cv2.circle(picture, hub, round(0.2 * fine), (140, 142, 144), -1)
        for spoke in np.arange(5) * 2 * np.pi / 5 + random.uniform(0, 1):
            end = np.array(hub) + np.round(np.array([np.cos(spoke), np.sin(spoke)]) * 0.18 * fine)
            cv2.line(picture, hub, end.astype(int).tolist(), (90, 90, 92), FINE)
        cv2.circle(picture, hub, round(0.05 * fine), (60, 60, 60), -1)
    colour = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA).astype(np.float64)
    cover = cv2.resize(mask, (width, height), interpolation=cv2.INTER_AREA) / 255
    # Painted edges hold black from outside the body: its colour is taken out again.
    colour = colour / np.maximum(cover, 0.25)[..., None]
    colour, cover = _over_shadow(np.minimum(colour, 255), cover, foot, metre)
    if random.random() < 0.5:
        colour, cover = colour[:, ::-1].copy(), cover[:, ::-1].copy()
    return Prop(x, z, colour, cover, foot)


def _over_shadow(
    colour: NDArray[np.float64], cover: NDArray[np.float64], foot: float, metre: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lay the body over the dark that it stands in."""
    rows, columns = np.indices(cover.shape)
    u = (columns + 0.5 - cover.shape[1] / 2) / (2.15 * metre)
    v = (rows + 0.5 - foot + 0.02 * metre) / (0.15 * metre)
    dark = 0.75 * np.clip(1.3 - 1.3 * (u**8 + v * v), 0, 1)
    both = cover + dark * (1 - cover)
    share = np.divide(cover, both, out=np.zeros_like(cover), where=both > 0)
    return colour * share[..., None], both
