"""Neck, trunk, limbs and hands in working clothes.

Lengths are in metres. The origin of a limb is its upper joint; the limb extends downwards.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.render.figure.look import FigureLook
from trackmark.datasets.synthetic.render.figure.mesh import AROUND, Solid, loft, turns
from trackmark.datasets.synthetic.render.texture import creases, lerp

Array = NDArray[np.float64]

UPPER_ARM, FOREARM, HAND = 0.29, 0.25, 0.19
NECK = 0.09
TRUNK = 0.52
"""Distance from the hips to the base of the neck."""

SHOULDER = 0.165, 0.065
"""Offset of the shoulder joint from the base of the neck, sideways and down."""

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


def body(look: FigureLook, random: np.random.Generator) -> list[Solid]:
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

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random
        self._broad, self._slope = creases(random, AROUND)

    def __call__(self, strength: float) -> Array:
        """Return a light gain, shape (AROUND, AROUND), for another piece of cloth at every call."""
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
