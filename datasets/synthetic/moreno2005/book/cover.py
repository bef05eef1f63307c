"""What is printed on the book: cloth of one colour, a title, a device, lines."""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.colours import any_of, varied
from datasets.synthetic.render.finish import GAMMA
from datasets.synthetic.render.painting import Colour, Painting
from datasets.synthetic.render.texture import fractal

__all__ = ["FINE", "PAGES", "printed"]

FINE = 3
"""Texels a pixel, in either direction."""

PAGES = 12
"""Rows of the texture below the cover: the pages' edges, then as many of the back's colour."""

CLOTHS = (
    (48, 44, 168), (34, 96, 196), (46, 150, 196), (72, 128, 58), (124, 120, 34), (158, 92, 42),
    (122, 58, 104), (88, 72, 158),
)  # fmt: skip
INKS = ((208, 224, 232), (70, 186, 226), (190, 206, 170), (46, 42, 44), (150, 176, 224))
SIDE = 512


def printed(random: np.random.Generator, half_width: float, height: float) -> NDArray[np.float32]:
    """A book's surface, linear, BGR.

    Returns
    -------
    ndarray of float32, shape (height + 2 * PAGES, 2 * half_width, 3), in texels
    """
    columns, rows = round(2 * half_width * FINE), round(height * FINE)
    picture = np.empty((rows + 2 * PAGES, columns, 3), np.uint8)
    cloth, ink = any_of(random, CLOTHS), any_of(random, INKS)
    if abs(float(ink.sum() - cloth.sum())) < 150:
        ink = varied(random, INKS[0])
    picture[:] = np.clip(cloth, 0, 255)
    _print(Painting(picture[:rows], float(columns)), random, cloth, ink, rows / columns)
    picture[rows : rows + PAGES] = _pages(random, columns)
    picture[rows + PAGES :] = np.clip(cloth * 0.8, 0, 255)
    woven = fractal(random, SIDE, 16, 256, 0.95)[:rows, :columns]
    blotched = fractal(random, SIDE, 4, 16)[:rows, :columns]
    gain = 1 + 0.05 * woven + 0.05 * blotched
    light = (picture / 255.0) ** GAMMA
    light[:rows] *= gain[..., None]
    return np.asarray(np.clip(light, 0, 1), np.float32)


def _print(
    cover: Painting, random: np.random.Generator, cloth: Colour, ink: Colour, high: float
) -> None:
    second = cloth * 0.55 + ink * 0.2
    cover.patch(0, 0, 0.08, high, cloth * 0.72)
    cover.patch(0.08, 0, 0.008, high, cloth * 0.5)
    left, right = 0.15, 0.93
    frame = [(left, 0.07), (right, 0.07), (right, high - 0.07), (left, high - 0.07), (left, 0.06)]
    cover.line(frame, 0.012, ink)
    for line in range(int(random.integers(1, 3))):
        _word(cover, random, 0.14 + 0.16 * line, 0.13, ink)
    _word(cover, random, high - 0.2, 0.06, ink)
    middle = high * random.uniform(0.58, 0.64)
    _device(cover, random, (left + right) / 2, middle, random.uniform(0.2, 0.26), second, ink)


def _word(
    cover: Painting, random: np.random.Generator, top: float, tall: float, ink: Colour
) -> None:
    """Letters, as wide together as the frame allows."""
    letters = "".join(random.choice(list("AEIORSTLNMDBKU"), int(random.integers(5, 8))))
    font, high = cv2.FONT_HERSHEY_DUPLEX, tall * cover.scale
    (wide, base), _ = cv2.getTextSize(letters, font, 1.0, 2)
    scale = min(high / base, 0.7 * cover.scale / wide)
    corner = round(0.54 * cover.scale - scale * wide / 2), round(top * cover.scale + scale * base)
    thick = max(1, round(0.13 * scale * base))
    cv2.putText(cover.picture, letters, corner, font, scale, ink.tolist(), thick, cv2.LINE_AA)


def _device(
    cover: Painting, random: np.random.Generator, x: float, y: float, radius: float,
    second: Colour, ink: Colour,
) -> None:  # fmt: skip
    """A disc with a star, with rings, or with a ship's sail."""
    cover.disc(x, y, radius, second)
    kind = int(random.integers(3))
    if kind == 0:
        turns = np.arange(10) * np.pi / 5 - np.pi / 2
        reach = radius * np.where(np.arange(10) % 2, 0.36, 0.86)
        cover.area(
            [(x + r * np.cos(t), y + r * np.sin(t)) for r, t in zip(reach, turns, strict=True)], ink
        )
    elif kind == 1:
        for share in (0.8, 0.62, 0.44, 0.26):
            cover.disc(x, y, share * radius, ink if share in (0.8, 0.44) else second)
    else:
        cover.area([(x - 0.05 * radius, y - 0.8 * radius), (x - 0.05 * radius, y + 0.3 * radius),
                    (x - 0.66 * radius, y + 0.3 * radius)], ink)  # fmt: skip
        cover.area([(x + 0.08 * radius, y - 0.6 * radius), (x + 0.6 * radius, y + 0.3 * radius),
                    (x + 0.08 * radius, y + 0.3 * radius)], ink)  # fmt: skip
        cover.area([(x - 0.6 * radius, y + 0.42 * radius), (x + 0.6 * radius, y + 0.42 * radius),
                    (x + 0.4 * radius, y + 0.66 * radius), (x - 0.4 * radius, y + 0.66 * radius)],
                   ink)  # fmt: skip


def _pages(random: np.random.Generator, columns: int) -> NDArray[np.uint8]:
    """Edges of leaves of paper, lighter and darker."""
    tones = random.uniform(0.72, 1.0, (PAGES, 1)) * random.uniform(0.97, 1.0, (PAGES, columns))
    return np.asarray(tones[..., None] * [196, 218, 228], np.uint8)
