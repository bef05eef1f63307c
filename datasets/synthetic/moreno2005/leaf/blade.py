"""A leaf: its outline and veins, and how it bends.

A leaf lies with its base at the origin and its tip upwards; its middle vein may bend and its
halves be folded up along it.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.render.triangles import Mesh, grid, turned_axes

Array = NDArray[np.float64]

COLUMNS, ROWS, STALK = 9, 34, 3  # vertices across; along the blade; along the stalk before it
TALL, WIDE = 128, 96  # texels along the leaf, and across it
SIDE = 128  # of the textures from which its own is cut [texels]
# Of the stalk: its length and half its width [lengths of the blade].
STALK_LENGTH, STALK_WIDTH = 0.13, 0.016


@dataclass(frozen=True)
class Shape:
    """How a leaf is held and bent."""

    place: Array  # (2,): of the middle of its blade: column and row [pixels]
    angle: float  # from upright to the right [radians]
    yaw: float  # how far it has turned from the camera to the right [radians]
    pitch: float  # and down [radians]
    bend: float  # how far its tip has turned from its base, away from the camera [radians]
    fold: float  # how far each half is folded up towards the camera [radians]


@dataclass(frozen=True)
class Blade:
    """A leaf as it grew."""

    length: float  # of the blade, without the stalk [pixels]
    mesh: Mesh
    # Places of its vertices when it is flat, both of shape (rows, COLUMNS) [pixels]:
    along: Array  # from the base to the tip
    across: Array  # from the middle vein to the right


def drawn_blade(random: np.random.Generator, length: float, colour: ArrayLike) -> Blade:
    """A leaf with a blade of a length [pixels], whose colours vary about one, BGR in [0, 255]."""
    s = np.linspace(0, 1, ROWS)
    rise, fall = random.uniform(0.55, 0.75), random.uniform(0.8, 1.05)
    half = s**rise * (1 - s) ** fall
    half *= random.uniform(0.27, 0.36) / half.max()
    half *= 1 + random.uniform(0.02, 0.06) * np.where(np.arange(ROWS) % 2, 1, -1)  # teeth
    half = np.maximum(half, STALK_WIDTH * (1 - 0.7 * s))
    stalk = np.linspace(-STALK_LENGTH, 0, STALK, endpoint=False)
    along = np.concatenate([stalk, s])
    half = np.concatenate([np.full(STALK, STALK_WIDTH), half])
    share = np.linspace(-1, 1, COLUMNS)
    across = half[:, None] * share + random.uniform(-0.12, 0.12) * (along * (1 - along))[:, None]
    texels = np.stack(
        [
            np.broadcast_to((share + 1) / 2 * WIDE, across.shape),
            np.broadcast_to(TALL * np.maximum(along, 0)[:, None], across.shape),
        ],
        axis=2,
    ).reshape(-1, 2)
    mesh = Mesh(grid(len(along), COLUMNS), texels, _texture(random, colour), closed=False)
    rows = np.repeat(along[:, None], COLUMNS, axis=1)
    return Blade(length, mesh, length * rows, length * across)


def placed(blade: Blade, shape: Shape) -> tuple[Array, Array]:
    """Where a leaf's vertices are: column, row and nearness [pixels], shape (v, 3).

    And the directions of its upper side there, of length 1.
    """
    middle = blade.length / 2
    turn = shape.bend * (blade.along - middle) / blade.length
    # A bent vein is an arc, nearly: what it rises and falls by is the integral of its turn.
    up = (blade.along - middle) * np.sinc(turn / (2 * np.pi)) * np.cos(turn / 2)
    near = -(blade.along - middle) * np.sinc(turn / (2 * np.pi)) * np.sin(turn / 2)
    lift = np.abs(blade.across) * np.sin(shape.fold)
    points = np.stack(
        [blade.across * np.cos(shape.fold), -up - lift * np.sin(turn), near + lift * np.cos(turn)],
        axis=2,
    )
    down, right = np.gradient(points, axis=(0, 1))
    normals = np.cross(down, right)
    normals /= np.sqrt((normals * normals).sum(axis=2, keepdims=True)) + 1e-12
    axes = turned_axes(shape.angle, shape.yaw, shape.pitch)
    seen = points.reshape(-1, 3) @ axes.T
    seen[:, :2] += shape.place
    return seen, normals.reshape(-1, 3) @ axes.T


def _texture(random: np.random.Generator, colour: ArrayLike) -> NDArray[np.float32]:
    """Veins, patches of other tones, a rim, spots; linear."""
    down, right = (np.arange(TALL) + 0.5) / TALL, (np.arange(WIDE) + 0.5) / WIDE * 2 - 1
    s, w = down[:, None], np.abs(right)[None]
    pairs, slope = random.uniform(6, 9), random.uniform(0.22, 0.34)
    phase = (s - slope * w * (1.1 - 0.5 * w)) * pairs + 0.12 * np.sign(right)
    phase = phase - np.floor(phase)
    vein = np.exp(-(((phase - 0.5) / 0.07) ** 2)) * (1 - 0.5 * w)
    main = np.exp(-((w / (0.075 - 0.04 * s)) ** 2))
    rough = fractal(random, SIDE, 4, 64, 0.7)[:TALL, :WIDE]
    wide = fractal(random, SIDE, 2, 4)[:TALL, :WIDE]
    ageing = np.clip(0.6 * wide + 0.5 * (w - 0.5) + random.uniform(-0.4, 0.1), 0, 1)[..., None]
    base = np.asarray(colour, np.float64)
    old = base * random.uniform(0.75, 1.05) + [-6.0, 4.0, 34.0]
    tone = 1 + 0.07 * rough + 0.10 * (phase - 0.5) + 0.05 * np.sign(right)
    leaf = (base * (1 - ageing) + old * ageing) * tone[..., None]
    pale = base * 0.55 + [70.0, 104.0, 96.0]
    ribs = np.clip(0.5 * vein + 0.85 * main, 0, 1)[..., None]
    leaf = leaf * (1 - ribs) + pale * ribs
    holes = random.uniform(0, 1, (int(random.integers(0, 6)), 2)) * [TALL, WIDE]
    for row, column in holes.tolist():
        disc = np.zeros((TALL, WIDE))
        cv2.circle(disc, (round(column), round(row)), int(random.integers(2, 5)), 1.0, -1)
        spot = np.asarray(cv2.GaussianBlur(disc, (0, 0), 1.0))[..., None]
        leaf = leaf * (1 - 0.7 * spot) + 0.7 * spot * np.array([30.0, 52.0, 84.0])
    return np.asarray((np.clip(leaf, 0, 255) / 255) ** 2, np.float32)
