"""What a person wears, and the textures that are wrapped around the parts of the body."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.multipart.bands import AROUND, ROWS
from datasets.synthetic.render.texture import fractal
from datasets.synthetic.scene import part_generator

__all__ = ["Colour", "Look", "wrapped"]

Colour: TypeAlias = tuple[int, int, int]
Array: TypeAlias = NDArray[np.float64]

_QUARTER = AROUND // 4


@dataclass(frozen=True)
class Look:
    """Clothes and build. Colours are BGR in [0, 255].

    Attributes
    ----------
    shirt, trousers, hair, skin, shoes : Colour
        Of what is always seen.
    jacket : Colour or None
        Worn open over the shirt: the shirt is then seen from the front alone.
    bag : Colour or None
        A backpack, seen from behind and from the side.
    weave : {'plain', 'stripes', 'knit'}
        Of the upper garment.
    long_hair : bool
        Down to the shoulders.
    hem : float
        Lower end of the upper garment, in standing heights above the ground.
    bulk, loose : float
        Breadth of the body and of the trousers, 1 is usual.
    """

    shirt: Colour
    trousers: Colour
    hair: Colour = (38, 46, 58)
    skin: Colour = (132, 160, 205)
    shoes: Colour = (44, 44, 50)
    jacket: Colour | None = None
    bag: Colour | None = None
    weave: Literal["plain", "stripes", "knit"] = "plain"
    long_hair: bool = False
    hem: float = 0.475
    bulk: float = 1.0
    loose: float = 1.0


def wrapped(look: Look, seed: int) -> NDArray[np.uint8]:
    """Textures of the parts in the order of `body.PARTS`, shape (9, 128, 256, 3)."""
    random = part_generator(seed, "clothes")
    rows = np.arange(ROWS)[:, None] / ROWS
    turn = np.arange(AROUND, dtype=np.float64)[None, :]
    turn = np.minimum(turn, AROUND - turn)  # from the front, 0 to 128
    upper = np.array(look.jacket or look.shirt, np.float64)
    folded = _Folds(random)
    legs = [_leg(look, folded, rows, turn) for _ in range(2)]
    shoes = [_shoe(look, random, rows)] * 2
    arms = [_arm(look, upper, folded, rows) for _ in range(2)]
    parts = [*legs, *shoes, *arms, _torso(look, upper, folded, rows, turn)]
    parts += [_head(look, random, rows, turn), _pack(look, folded, rows, turn)]
    return np.clip(np.round(np.stack(parts)), 0, 255).astype(np.uint8)


class _Folds:
    """Folds of cloth: broad creases across a part, steep ones along it, and grain.

    One pair of patterns serves a person; each part takes another piece of it.
    """

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random
        self._broad = fractal(random, AROUND, 4, 16, 0.6)
        steep = fractal(random, AROUND, 8, 32, 0.7)
        self._slope = steep - np.roll(steep, 2, axis=0)

    def __call__(self, strength: float) -> Array:
        """Gain of light, shape (ROWS, AROUND)."""
        down, around = self._random.integers(0, AROUND, 2)
        rows = np.arange(ROWS)[:, None]
        columns = np.arange(AROUND)[None, :] + around
        broad = self._broad[(2 * rows + down) % AROUND, columns % AROUND]
        slope = self._slope[(rows + down) % AROUND, (columns + rows // 3) % AROUND]
        grain = self._random.normal(0, 0.016, (ROWS, AROUND))
        return np.asarray(1 + strength * (0.10 * broad + 0.34 * slope) + grain)


def _plain(colour: Array | Colour) -> Array:
    return np.broadcast_to(np.asarray(colour, np.float64), (ROWS, AROUND, 3)).copy()


def _leg(look: Look, folded: _Folds, rows: Array, turn: Array) -> Array:
    cloth = _plain(look.trousers) * folded(1.0)[..., None]
    knee = np.exp(-np.square((rows - 0.5) / 0.07)) * np.clip(1 - turn / 60, 0, 1)
    behind = np.exp(-np.square((rows - 0.53) / 0.05)) * np.clip((turn - 70) / 50, 0, 1)
    seam = np.abs(turn - _QUARTER) < 2
    hem = rows > 0.97
    gain = 1 + 0.07 * knee - 0.18 * behind - 0.10 * seam - 0.16 * hem
    return np.asarray(cloth * gain[..., None])


def _shoe(look: Look, random: np.random.Generator, rows: Array) -> Array:
    leather = _plain(look.shoes) * (1 + 0.05 * random.normal(0, 1, (ROWS, AROUND)))[..., None]
    sole = np.broadcast_to(rows > 0.8, (ROWS, AROUND))[..., None]
    return np.where(sole, leather * 0.45 + 22, leather * (1.15 - 0.3 * rows)[..., None])


def _arm(look: Look, upper: Array, folded: _Folds, rows: Array) -> Array:
    cloth = _weave(look, upper, rows) * folded(1.1)[..., None]
    inner = np.exp(-np.square((rows - 0.45) / 0.05))
    cuff = (rows > 0.80) & (rows < 0.83)
    cloth = cloth * (1 - 0.14 * inner - 0.2 * cuff)[..., None]
    hand = _plain(look.skin) * (1.0 - 0.25 * np.clip((rows - 0.9) / 0.1, 0, 1))[..., None]
    return np.where(np.broadcast_to(rows >= 0.83, (ROWS, AROUND))[..., None], hand, cloth)


def _torso(look: Look, upper: Array, folded: _Folds, rows: Array, turn: Array) -> Array:
    cloth = _weave(look, upper, rows) * folded(0.8)[..., None]
    shoulder_blades = np.exp(-np.square((rows - 0.3) / 0.12)) * np.clip((turn - 90) / 30, 0, 1)
    cloth = cloth * (1 + 0.05 * shoulder_blades)[..., None]
    if look.jacket is None:
        collar = (rows < 0.06) & (turn < 200)
        buttons = (turn < 2) & (rows < 0.98)
        cloth = cloth * (1 - 0.16 * collar - 0.12 * buttons)[..., None]
    else:
        width = 9 + 9 * rows
        opened = np.clip(width - turn + 0.5, 0, 1)[..., None]
        shirt = _plain(look.shirt) * folded(0.5)[..., None]
        edge = np.clip(1 - np.abs(turn - width - 2) / 3, 0, 1)
        cloth = (cloth * (1 - 0.3 * edge)[..., None]) * (1 - opened) + shirt * opened
    if look.bag is not None:  # its straps
        strap = np.clip(2.5 - np.abs(turn - (34 - 14 * rows)), 0, 1) * (rows < 0.55)
        cloth = cloth + (np.array(look.bag) * 0.8 - cloth) * strap[..., None]
    hem = rows > 0.965
    return cloth * (1 - 0.2 * hem)[..., None]


def _weave(look: Look, colour: Array, rows: Array) -> Array:
    cloth = _plain(colour)
    if look.weave == "stripes":
        band = (np.sin(rows * 2 * np.pi * 9) > 0.25)[..., None]
        cloth = np.where(np.broadcast_to(band, cloth.shape), cloth * 0.72 + 14, cloth)
    elif look.weave == "knit":
        ribs = np.sin(np.arange(AROUND)[None, :] * 2 * np.pi / 8)[..., None]
        cloth = cloth * (1 + 0.05 * ribs)
    return cloth


def _head(look: Look, random: np.random.Generator, rows: Array, turn: Array) -> Array:
    skin = _plain(look.skin)
    v = rows * np.ones_like(turn)
    cheeks = np.exp(-np.square((v - 0.52) / 0.1) - np.square((turn - 26) / 12))
    skin = skin * (1 + np.array([-0.06, -0.06, 0.05]) * cheeks[..., None])
    skin = skin * (1 - 0.22 * np.clip((v - 0.68) / 0.1, 0, 1))[..., None]  # below the chin
    eyes = np.exp(-np.square((v - 0.40) / 0.035) - np.square((turn - 17) / 6))
    brows = np.exp(-np.square((v - 0.34) / 0.02) - np.square((turn - 17) / 9))
    mouth = np.exp(-np.square((v - 0.61) / 0.022) - np.square(turn / 10))
    nose = np.exp(-np.square((v - 0.49) / 0.05) - np.square((turn - 4) / 3))
    dark = np.clip(0.75 * eyes + 0.5 * brows + 0.35 * mouth + 0.2 * nose, 0, 1)[..., None]
    skin = skin * (1 - dark) + np.array([40.0, 44.0, 70.0]) * dark
    ears = np.exp(-np.square((v - 0.46) / 0.07) - np.square((turn - 66) / 6))
    skin = skin * (1 - 0.12 * ears)[..., None]
    strands = fractal(random, AROUND, 8, 128, 0.8)[::2, :]
    hair = _plain(look.hair) * (1 + 0.22 * strands + 0.12 * (0.3 - v))[..., None]
    line = 0.22 + 0.42 * np.clip((turn - 34) / 30, 0, 1)  # hair reaches lower at the sides
    line = np.where(turn > 78, 0.74, line)
    if look.long_hair:
        line = np.where(turn > 46, 1.2, line)
    covered = np.clip((line + 0.03 * strands - v) * 25, 0, 1)[..., None]
    return np.asarray(skin * (1 - covered) + hair * covered)


def _pack(look: Look, folded: _Folds, rows: Array, turn: Array) -> Array:
    cloth = _plain(look.bag or (0, 0, 0)) * folded(0.7)[..., None]
    pocket = ((rows > 0.5) & (rows < 0.53)) | (np.abs(rows - 0.14) < 0.012)
    return cloth * (1 - 0.3 * (pocket & (turn > 40)))[..., None]
