"""The light on the scene, and how it changes."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.moreno2005.ellipse.plan import FRAMES, SIZE, Plan
from datasets.synthetic.render.path import smooth_step
from datasets.synthetic.scene import part_generator

__all__ = ["Lighting", "Shadow", "Uniform", "drawn_lighting"]

Array = NDArray[np.float64]

AROUND_THE_MIDDLE = 45, 56  # frames in which a single jump may be
DIMMED = 0.45, 0.8  # what is left of the light on one side of a single jump
CAST = 0.45  # of what is left: length of its colour's logarithm
EARLIEST = 5  # frame before which the light does not change, where it does so repeatedly
OFTEN = 0.3  # probability of a change in a frame from then on
LEFT = 0.4, 1.0  # what is left of the light from one change to the next
TINT = 0.2  # by what part of it every channel differs from that, at most
SHADE = 0.35, 0.6  # what is left in the shadow
SHADE_TINT = 0.35  # by what part of it every channel differs from that, at most
PACE = 7.0, 11.0  # of the shadow [pixels/frame]
WIDTH = 200.0, 300.0  # of the shadow, along its way [pixels]
SOFT = 4.0, 10.0  # of its edges, between light and shade [pixels]
WAVE = 9.0  # how far its edges bend out at most, by each of two waves [pixels]


@dataclass(frozen=True)
class Uniform:
    """The same light on all that is seen."""

    gains: Array  # (FRAMES, 3): RGB, of the light that a colour is named by

    def at(self, frame: int) -> Array:
        """Gains of RGB, shape (3,)."""
        return np.asarray(self.gains[frame])

    def changes(self, plan: Plan) -> NDArray[np.bool_]:
        """Frames in which the light is another than in the one before."""
        changed = np.zeros(FRAMES, np.bool_)
        changed[1:] = (np.diff(self.gains, axis=0) != 0).any(axis=1)
        return changed


@dataclass(frozen=True)
class Shadow:
    """A band of coloured shade that passes."""

    gains: Array  # (3,): RGB, in full shade
    direction: float  # in which it goes, from x towards y [radians]
    front: Array  # (FRAMES,): how far it has come, from the picture's middle [pixels]
    width: float  # [pixels]
    soft: float  # width of its edges [pixels]
    waves: Array  # (k, 3): of its edges: size [pixels], length [pixels], phase

    def at(self, frame: int) -> Array:
        """Gains of RGB, shape (height, width, 3)."""
        return 1 - self.shade(frame)[..., None] * (1 - self.gains)

    def shade(self, frame: int) -> Array:
        """How much every pixel is in the shade, in [0, 1], shape (height, width)."""
        ahead = self._along - self.front[frame]
        inside = np.minimum(-ahead, ahead + self.width) / self.soft + 0.5
        return smooth_step(inside, 0.0, 1.0)

    def changes(self, plan: Plan) -> NDArray[np.bool_]:
        """Frames in which the ellipse lies partly in the shade and partly not."""
        shades = (self.shade(frame)[plan.covers(frame)] for frame in range(FRAMES))
        return np.array([shade.min() < 0.5 < shade.max() for shade in shades])

    @cached_property
    def _along(self) -> Array:
        """Where pixels are along the shadow's way, as a straight edge would see them."""
        rows, columns = np.indices(SIZE[::-1]) + 0.5
        x, y = columns - SIZE[0] / 2, rows - SIZE[1] / 2
        cosine, sine = np.cos(self.direction), np.sin(self.direction)
        along, across = x * cosine + y * sine, y * cosine - x * sine
        for size, length, phase in self.waves:
            along = along + size * np.sin(2 * np.pi * across / length + phase)
        return np.asarray(along)


Lighting: TypeAlias = Uniform | Shadow


def drawn_lighting(seed: int, kind: Literal["even", "jump", "repeated", "shadow"]) -> Lighting:
    """The light of a kind, drawn at random."""
    random = part_generator(seed, f"moreno2005/ellipse light {kind}")
    if kind == "shadow":
        return _drawn_shadow(random)
    gains = np.ones((FRAMES, 3))
    if kind == "jump":
        jump = int(random.integers(*AROUND_THE_MIDDLE))
        cast = random.normal(size=3)
        cast -= cast.mean()
        dimmed = random.uniform(*DIMMED) * np.exp(CAST * cast / np.linalg.norm(cast))
        side = slice(jump, None) if random.random() < 0.5 else slice(jump)
        gains[side] = dimmed
    if kind == "repeated":
        for frame in range(EARLIEST, FRAMES):
            if random.random() < OFTEN:
                gains[frame:] = random.uniform(*LEFT) * (1 + random.uniform(-TINT, TINT, 3))
    return Uniform(gains)


def _drawn_shadow(random: np.random.Generator) -> Shadow:
    """A shadow that comes in from outside, some frames after the first."""
    direction = random.uniform(0, 2 * np.pi)
    pace, width = random.uniform(*PACE), random.uniform(*WIDTH)
    reach = (abs(np.cos(direction)) * SIZE[0] + abs(np.sin(direction)) * SIZE[1]) / 2
    waves = [
        [random.uniform(0, WAVE), random.uniform(50, 160), random.uniform(0, 2 * np.pi)]
        for _ in range(2)
    ]
    soft = random.uniform(*SOFT)
    start = -reach - 2 * WAVE - soft - pace * random.uniform(5, 15)
    return Shadow(
        random.uniform(*SHADE) * (1 + random.uniform(-SHADE_TINT, SHADE_TINT, 3)),
        direction,
        start + pace * np.arange(FRAMES),
        width,
        soft,
        np.array(waves),
    )
