"""Small things of a street: lamp posts, signs, bins."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.render.prop import Prop

__all__ = ["litter_bin", "post", "sign"]

Array = NDArray[np.float64]


def post(
    random: np.random.Generator, x: float, z: float, scale: float, thickness: float | None = None
) -> Prop:
    """Lamp post or pillar, higher than the picture.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws its colour and, where none is given, its thickness.
    x, z : float
        Where it stands [metres].
    scale : float
        At its depth [pixels/metre].
    thickness : float, optional
        [metres].
    """
    thick = random.uniform(0.10, 0.18) if thickness is None else thickness
    colour, coverage = _upright(4.5 * scale, thick * scale, _metal(random))
    base = round(0.5 * scale)
    wide = _upright(base, 1.7 * thick * scale, _metal(random) * 0.9)
    return _stacked(x, z, colour, coverage, *wide)


def sign(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Round or square sign on a pole."""
    colour, coverage = _upright(2.2 * scale, 0.07 * scale, np.array([150.0, 152.0, 154.0]))
    radius = random.uniform(0.26, 0.34) * scale
    size = int(np.ceil(2 * radius)) + 2
    y, x_ = (np.indices((size, size)) + 0.5 - size / 2) / radius
    far = np.hypot(x_, y) if random.random() < 0.6 else np.maximum(np.abs(x_), np.abs(y))
    plate = np.clip((1 - far) * radius + 0.5, 0, 1)
    rim, inner = ((44, 40, 170), (220, 222, 224)) if random.random() < 0.5 else (
        (220, 222, 224), (150, 84, 40))  # fmt: skip
    face = np.where((far > 0.78)[..., None], np.array(rim, np.float64), np.array(inner, np.float64))
    return _stacked(x, z, face, plate, colour, coverage)


def litter_bin(random: np.random.Generator, x: float, z: float, scale: float) -> Prop:
    """Litter bin."""
    paint = np.array(
        [[58, 84, 44], [60, 58, 58], [120, 70, 40], [44, 110, 150]][random.integers(4)]
    )
    body, cover = _upright(0.8 * scale, 0.46 * scale, paint.astype(np.float64))
    rows = np.arange(len(body))[:, None] / len(body)
    body = body * np.where((rows > 0.14) & (rows < 0.24), 0.45, 1.0)[..., None]
    lid, lid_cover = _upright(0.1 * scale, 0.54 * scale, paint * 0.7)
    return _stacked(x, z, lid, lid_cover, body, cover)


def _metal(random: np.random.Generator) -> Array:
    tone = random.uniform(60, 150)
    return np.array([tone, tone * random.uniform(0.98, 1.06), tone * 0.97])


def _upright(height: float, width: float, colour: Array) -> tuple[Array, Array]:
    """A cylinder: its picture and coverage."""
    rows, columns = max(1, round(height)), int(np.ceil(width)) + 2
    u = (np.arange(columns) + 0.5 - columns / 2) / (width / 2)
    cover = np.clip((1 - np.abs(u)) * width / 2 + 0.5, 0, 1)
    shade = 0.55 + 0.5 * np.sqrt(np.clip(1 - u * u, 0, 1)) - 0.18 * np.clip(u, -1, 1)
    picture = np.broadcast_to(colour * shade[:, None], (rows, columns, 3)).copy()
    return picture, np.broadcast_to(cover, (rows, columns)).copy()


def _stacked(
    x: float, z: float, upper: Array, upper_cover: Array, lower: Array, lower_cover: Array
) -> Prop:
    """One thing on another, in the middle; the whole stands on the ground."""
    width = max(upper.shape[1], lower.shape[1])
    height = len(upper) + len(lower)
    colour, coverage = np.zeros((height, width, 3)), np.zeros((height, width))
    for part, cover, top in ((upper, upper_cover, 0), (lower, lower_cover, len(upper))):
        left = (width - part.shape[1]) // 2
        colour[top : top + len(part), left : left + part.shape[1]] = part
        coverage[top : top + len(part), left : left + part.shape[1]] = cover
    return Prop(x, z, colour, coverage, height)
