"""Body of a person: head, neck, trunk, limbs and hands in working clothes.

Lengths are in metres. The head is one textured surface of skull, face, ears and hair; its origin is
the middle between chin and crown. The origin of a limb is its upper joint; the limb extends down.
"""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.figure.look import FigureLook
from trackmark.datasets.synthetic.render.figure.mesh import AROUND, Solid, loft, turns
from trackmark.datasets.synthetic.render.texture import creases, fractal, lerp

ROWS = 161  # number of rows of the texture, from the crown to below the chin

# rows as in `mesh.loft`
_SKULL = (
    (0.117, 0.003, 0.003, 0.003, 0.0, -0.012),
    (0.113, 0.031, 0.036, 0.036, 0.0, -0.010),
    (0.101, 0.053, 0.060, 0.066, 0.0, -0.006),
    (0.080, 0.067, 0.074, 0.087, 0.0, -0.002),
    (0.055, 0.074, 0.083, 0.099, 0.0, 0.0),
    (0.025, 0.076, 0.086, 0.104, 0.0, 0.0),
    (-0.005, 0.075, 0.086, 0.100, 0.0, 0.0),
    (-0.034, 0.072, 0.085, 0.088, 0.0, 0.0),
    (-0.060, 0.066, 0.083, 0.074, -0.004, 0.0),
    (-0.082, 0.057, 0.079, 0.062, -0.010, 0.0),
    (-0.098, 0.046, 0.072, 0.054, -0.017, 0.0),
    (-0.104, 0.032, 0.052, 0.046, -0.014, 0.0),
    (-0.100, 0.004, 0.006, 0.006, 0.0, 0.0),
)

# angles from the front at which `_LINES` gives the hair's lower end
_TURN = (0.0, 0.55, 0.85, 1.1, 1.35, 1.5, 1.85, 2.1, 3.15)
_LINES = {
    "short": (0.070, 0.068, 0.046, 0.012, -0.014, 0.012, -0.030, -0.062, -0.070),
    "full": (0.056, 0.052, 0.020, -0.016, -0.040, -0.046, -0.072, -0.084, -0.088),
    "wreath": (0.130, 0.130, 0.110, 0.020, -0.008, 0.010, -0.030, -0.060, -0.066),
}
_THICK = {"short": 0.009, "full": 0.017, "wreath": 0.006}


def head(look: FigureLook, random: Generator) -> Solid:
    """Return a head with its hair."""
    skull = loft(ROWS, _SKULL, 2.15)
    strands = _pattern(random, 32, 128, 0.9, stretched=4)
    hair = _hair(look, skull, strands)
    surface = _with_features(skull)
    outward = 1 + hair * _THICK[look.cut] * (1 + 0.25 * strands) / 0.09
    surface = surface * outward[..., None]
    skin = _skin(look, skull, random)
    shine = 1 + 0.20 * strands + 0.8 * skull[..., 1]
    texture = lerp(skin, np.asarray(look.hair, np.float64) * shine[..., None], hair)
    return Solid(surface, texture[:, :-1], (4, 4))


def _pattern(
    random: Generator, coarsest: int, finest: int, fall: float, stretched: int = 1
) -> Array:
    """Return vertically stretched fractal noise around the head, shape (ROWS, AROUND + 1)."""
    values = fractal(random, AROUND, coarsest, finest, fall)[np.arange(ROWS) // stretched]
    return np.concatenate([values, values[:, :1]], axis=1)


def _bump(values: Array, middle: float, width: float) -> Array:
    u = (values - middle) / width
    return np.asarray(np.exp(-u * u))


def _hair(look: FigureLook, skull: Array, strands: Array) -> Array:
    """Return the fraction of each texel that hair covers, in [0, 1]."""
    _, angle = turns(ROWS)
    turn = np.minimum(angle, 2 * np.pi - angle)
    line = np.interp(turn, _TURN, _LINES[look.cut])
    height = skull[..., 1] + 0.006 * strands
    share = np.clip((height - line) / 0.006 + 0.5, 0, 1)
    if look.cut == "wreath":  # a wreath of hair leaves the crown bald
        share = share * np.clip((0.062 - height) / 0.012 + 0.5, 0, 1)
    return share


def _with_features(skull: Array) -> Array:
    x, y, z = skull[..., 0], skull[..., 1], skull[..., 2]
    before = np.clip(z / 0.03, 0, 1)
    nose = np.interp(y, (-0.046, -0.036, -0.026, 0.0, 0.034), (0.0, 0.75, 1.0, 0.55, 0.05))
    forward = 0.025 * _bump(x, 0, 0.011) * nose
    forward = forward - 0.008 * _bump(np.abs(x), 0.031, 0.015) * _bump(y, 0.016, 0.012)
    forward = forward + 0.004 * _bump(y, 0.036, 0.008) * _bump(x, 0, 0.045)
    forward = forward + 0.005 * _bump(y, -0.064, 0.008) * _bump(x, 0, 0.021)
    forward = forward + 0.005 * _bump(y, -0.100, 0.013) * _bump(x, 0, 0.018)
    ear = np.square((y + 0.004) / 0.031) + np.square((z + 0.014) / 0.016)
    ears = 0.015 * np.clip(1.25 - ear, 0, 0.6) / 0.6
    shifts = np.stack([np.sign(x) * ears, 0 * x, forward * before - 0.4 * ears], axis=2)
    return np.asarray(skull + shifts)


def _skin(look: FigureLook, skull: Array, random: Generator) -> Array:
    """Return the colours of face, ears and throat, with a beard and glasses if present."""
    x, y, z = skull[..., 0], skull[..., 1], skull[..., 2]
    before, aside = np.clip((z - 0.02) / 0.02, 0, 1), np.abs(x)
    skin = np.asarray(look.skin, np.float64) * (1 + 0.035 * _pattern(random, 8, 64, 0.7))[..., None]
    cheeks = _bump(aside, 0.045, 0.018) * _bump(y, -0.030, 0.02)
    tip = _bump(aside, 0, 0.012) * _bump(y, -0.028, 0.012)
    skin = skin * (1 + 0.10 * before * (cheeks + tip))[..., None] ** np.array([-1.0, -0.8, 0.5])
    hollow = 0.22 * _bump(aside, 0.031, 0.016) * _bump(y, 0.015, 0.011)
    hollow = hollow + 0.16 * _bump(aside, 0.012, 0.007) * _bump(y, -0.040, 0.006)
    hollow = hollow + 0.14 * _bump(y, -0.082, 0.006) * _bump(x, 0, 0.02)
    throat = 0.35 * np.clip((-y - 0.095) / 0.01, 0, 1)
    skin = skin * ((1 - before * hollow) * (1 - throat))[..., None]
    ear = _bump(z, -0.008, 0.009) * _bump(y, -0.004, 0.022) * (aside > 0.05)
    skin = skin * (1 - ear[..., None] * np.array([0.25, 0.25, 0.10]))
    if look.beard:
        line = -0.048 + 0.05 * np.clip((0.06 - z) / 0.05, 0, 1)
        grown = np.clip((line - y) / 0.016, 0, 1) * np.clip((z + 0.005) / 0.02, 0, 1)
        grown = grown * (1 - 0.9 * _bump(y, -0.064, 0.007) * _bump(x, 0, 0.022))
        skin = lerp(skin, np.asarray(look.hair, np.float64) * 0.9, 0.75 * grown)
    skin = _face(look, skin, before, aside, y)
    return _glasses(skin, before, skull) if look.glasses else skin


def _face(look: FigureLook, skin: Array, before: Array, aside: Array, y: Array) -> Array:
    lips = np.asarray(look.skin, np.float64) * np.array([0.62, 0.60, 0.84])
    white, dark = np.array([176.0, 182.0, 185.0]), np.array([44.0, 46.0, 52.0])
    eye = (_bump(aside, 0.031, 0.0135) ** 4 > 0.1) * (np.abs(y - 0.016) < 0.0055)
    iris = np.square(aside - 0.031) + np.square(y - 0.016) < 0.0062**2
    lid = _bump(y, 0.0225, 0.0025) * _bump(aside, 0.031, 0.016)
    brow = _bump(y, 0.036, 0.0045) * np.clip(1.5 - np.abs(aside - 0.031) / 0.014, 0, 1)
    nostril = _bump(aside, 0.008, 0.004) * _bump(y, -0.042, 0.003)
    skin = lerp(skin, white, 0.8 * before * eye)
    skin = lerp(skin, dark, 0.95 * before * iris)
    skin = lerp(skin, dark, 0.7 * before * np.maximum(lid, nostril))
    skin = lerp(skin, np.asarray(look.hair, np.float64) * 0.85, 0.8 * before * brow)
    skin = lerp(skin, lips, 0.75 * before * _bump(y, -0.064, 0.0065) * (aside < 0.024))
    between = np.array([36.0, 36.0, 70.0])
    return lerp(skin, between, 0.7 * before * _bump(y, -0.064, 0.002) * (aside < 0.025))


def _glasses(skin: Array, before: Array, skull: Array) -> Array:
    aside, y, z = np.abs(skull[..., 0]), skull[..., 1], skull[..., 2]
    u, v = (aside - 0.033) / 0.024, (y - 0.012) / 0.018
    far = np.sqrt(np.sqrt(u * u * u * u + v * v * v * v))
    rim = before * np.clip(1.6 - np.abs(far - 1) * 9, 0, 1)
    bridge = before * (aside < 0.010) * (np.abs(y - 0.018) < 0.003)
    temple = (aside > 0.045) * (np.abs(y - 0.018) < 0.0035) * (z > -0.01)
    skin = lerp(skin, np.array([150.0, 140.0, 128.0]), 0.18 * before * (far < 1))
    return lerp(skin, np.array([38.0, 36.0, 36.0]), np.clip(rim + bridge + temple, 0, 0.9))


UPPER_ARM, FOREARM, HAND = 0.29, 0.25, 0.19
NECK = 0.09
TRUNK = 0.52  # distance from the hips to the base of the neck
SHOULDER = 0.165, 0.065  # offset of the shoulder joint from the base of the neck, sideways and down

# rows as in `loft`; the trunk starts at the hips
_TRUNK = (
    (0.530, 0.050, 0.052, 0.056, -0.012, 0.000),
    (0.522, 0.072, 0.066, 0.068, -0.010, 0.000),
    (0.500, 0.116, 0.082, 0.084, -0.004, 0.000),
    (0.478, 0.162, 0.096, 0.096, 0.0, 0.0),
    (0.440, 0.186, 0.112, 0.106, 0.0, 0.0),
    (0.390, 0.194, 0.126, 0.112, 0.0, 0.0),
    (0.330, 0.188, 0.132, 0.112, 0.0, 0.0),
    (0.250, 0.176, 0.130, 0.104, 0.0, 0.0),
    (0.150, 0.168, 0.126, 0.098, 0.0, 0.0),
    (0.050, 0.172, 0.128, 0.104, 0.0, 0.0),
    (-0.040, 0.180, 0.126, 0.122, 0.0, 0.0),
    (-0.100, 0.120, 0.060, 0.060, 0.0, 0.0),
)
_LEG = (
    (0.060, 0.060, 0.060, 0.070, 0.0, 0.0),
    (0.000, 0.092, 0.096, 0.108, 0.0, 0.0),
    (-0.150, 0.092, 0.092, 0.098, 0.0, 0.0),
    (-0.450, 0.076, 0.076, 0.076, 0.0, 0.0),
    (-0.800, 0.070, 0.070, 0.070, 0.0, 0.0),
)
_NECK = (
    (0.120, 0.050, 0.046, 0.054, 0.0, 0.0),
    (0.075, 0.053, 0.050, 0.058, 0.0, 0.0),
    (0.020, 0.058, 0.056, 0.062, 0.0, 0.0),
    (-0.040, 0.074, 0.068, 0.072, 0.0, 0.0),
)
_COLLAR = (
    (0.030, 0.060, 0.056, 0.060, -0.026, 0.004),
    (0.034, 0.067, 0.064, 0.066, -0.026, 0.004),
    (0.010, 0.078, 0.078, 0.074, -0.020, 0.004),
    (-0.030, 0.090, 0.088, 0.080, -0.012, 0.0),
)


def body(look: FigureLook, random: Generator) -> list[Solid]:
    """Return neck, collar, trunk, upper arms, forearms, hands and legs; left before right."""
    folds = _Folds(random)
    sleeve = np.asarray(look.shirt if look.bib else look.clothes, np.float64)
    collar = np.asarray(look.shirt, np.float64) * 0.96
    trousers = np.asarray(look.clothes, np.float64)
    upper = [_sleeve(UPPER_ARM, (0.060, 0.058, 0.052), sleeve, folds(1.1)) for _ in range(2)]
    lower = [_sleeve(FOREARM, (0.052, 0.046, 0.037), sleeve, folds(1.1)) for _ in range(2)]
    return [
        _plain(loft(49, _NECK), np.asarray(look.skin, np.float64) * 0.86, folds(0.25)),
        _plain(loft(33, _COLLAR), collar, folds(0.5)),
        _trunk(look, folds),
        *upper,
        *lower,
        *[_hand(look, folds(0.2)) for _ in range(2)],
        *[_plain(loft(97, _LEG), trousers, folds(1.0)) for _ in range(2)],
    ]


class _Folds:
    """Shading of cloth by broad folds, steep folds and grain."""

    def __init__(self, random: Generator) -> None:
        self._random = random
        self._broad, self._slope = creases(random, AROUND)

    def __call__(self, strength: float) -> Array:
        """Return a light gain, shape (AROUND, AROUND), of a new piece of cloth at every call."""
        shift = tuple(self._random.integers(0, AROUND, 2))
        broad, slope = (np.roll(p, shift, axis=(0, 1)) for p in (self._broad, self._slope))
        grain = self._random.normal(0, 0.014, (AROUND, AROUND))
        return np.asarray(1 + strength * (0.09 * broad + 0.34 * slope) + grain)


def _plain(surface: Array, colour: Array, gain: Array) -> Solid:
    return Solid(surface, colour * gain[: len(surface), :, None], (4, 8))


def _sleeve(length: float, radii: tuple[float, float, float], colour: Array, gain: Array) -> Solid:
    rows = 65
    first, middle, last = radii
    ends = [(-0.6 * first, 0.3 * first), (-0.4 * first, 0.75 * first), (0.0, first)]
    ends += [(length / 2, middle), (length, last), (length + 0.3 * last, 0.8 * last)]
    ends += [(length + 0.6 * last, 0.02)]
    profile = [(-y, r, r, r, 0.0, 0.0) for y, r in ends]
    down, _ = turns(rows)
    seam = 1 - 0.22 * np.exp(-np.square((down[:, :-1] - 0.80) / 0.012))
    return Solid(loft(rows, profile), colour * (gain[:rows] * seam)[..., None], (4, 16))


def _hand(look: FigureLook, gain: Array) -> Solid:
    rows = 49
    knots = [(-0.02, 0.020, 0.024), (0.03, 0.026, 0.020), (0.08, 0.042, 0.018)]
    knots += [(0.13, 0.040, 0.016), (HAND - 0.02, 0.030, 0.012), (HAND, 0.008, 0.005)]
    profile = [(-y, w, d, d, 0.0, 0.0) for y, w, d in knots]
    down, angle = turns(rows)
    fingers = (down > 0.55) * np.clip(np.sin(4 * np.sin(angle) * np.pi) * 1.5 - 0.9, 0, 1)
    shade = 1 - 0.30 * fingers[:, :-1]
    skin = np.asarray(look.skin, np.float64) * (gain[:rows] * shade)[..., None]
    return Solid(loft(rows, profile), skin, (4, 16))


def _trunk(look: FigureLook, folds: _Folds) -> Solid:
    rows = 193
    surface = loft(rows, _TRUNK, 2.4) * np.array([look.bulk, 1.0, look.bulk])
    x, height, z = (surface[:, :-1, axis] for axis in range(3))
    cloth = np.asarray(look.clothes, np.float64) * folds(0.8)[:rows, :, None]
    shirt = np.asarray(look.shirt, np.float64) * folds(0.6)[:rows, :, None]
    covered = _bib(x, height, z > 0) if look.bib else _jacket(x, height, z > 0)
    texture = lerp(shirt, cloth, covered)
    pocket = np.maximum(np.abs(np.abs(x) - (0.0 if look.bib else 0.095)), np.abs(height - 0.265))
    seams = 4 * covered * (1 - covered) + (z > 0) * _within(np.abs(pocket - 0.052), 0.003)
    if not look.bib:  # zip in front and seam at the back
        seams = seams + np.where(
            z > 0, _within(np.abs(x), 0.004), _within(np.abs(height - 0.40), 0.003)
        )
    texture = texture * (1 - 0.3 * np.clip(seams, 0, 1))[..., None]
    metal = np.maximum(np.abs(np.abs(x) - 0.085), np.abs(height - 0.325))
    metal = look.bib * (z > 0) * _within(metal, 0.014)
    texture = lerp(texture, np.array([168.0, 172.0, 174.0]), metal)
    badge = (z > 0) * _within(np.abs(x - 0.10), 0.028) * _within(np.abs(height - 0.36), 0.012)
    return Solid(surface, lerp(texture, np.array([210.0, 214.0, 216.0]), badge), (4, 8))


def _bib(x: Array, height: Array, before: NDArray[np.bool_]) -> Array:
    """Return the coverage of dungarees over the shirt; their straps cross at the back."""
    middle = np.where(before, 0.085, 0.16 * (height - 0.02))
    brace = _within(np.abs(np.abs(x) - middle), 0.019)
    bib = before * _within(np.abs(x), 0.115) * _within(height, 0.33)
    return np.maximum(np.maximum(brace, bib), _within(height, 0.12))


def _jacket(x: Array, height: Array, before: NDArray[np.bool_]) -> Array:
    """Return the coverage of a jacket over the shirt, which remains visible below the neck."""
    return 1 - before * _within(np.abs(x), 0.6 * (height - 0.44))


def _within(values: Array, limit: float | Array) -> Array:
    """Return 1 below a limit and 0 above it; the transition is one texel wide."""
    return np.clip((limit - values) / 0.005 + 0.5, 0, 1)
