"""What the ellipse does: where it goes, what shape and what colour it has, in every frame."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Mask
from trackmark.datasets.synthetic.render.path import quantised
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

FRAMES = 100
SIZE = 320, 240
BORDER = 38.0  # how near its centre comes to the picture's border [pixels]
HALF_AXES = 11.0, 34.0  # least and greatest [pixels]
KEPT = 0.85  # part of the velocity that is kept from frame to frame; the rest is new
NEW_SPEED = 1.8  # standard deviation of each component of the new velocity [pixels/frame]
FASTEST = 6.9  # [pixels/frame]; two deviations of the shift that trackers have learnt (section 4)
# Standard deviation of independent steps: of either half axis's logarithm, of the angle [radians].
# Deviations that trackers have learnt before, elsewhere, are .03 for stretches, .05 for shears.
# With .03 trackers had been tried before, on other scenes (J .86): it was known to be followed.
NEW = 0.03
STEP = 0.05  # about how far its colour goes in a frame, in RGB of [0, 1]
# How much the way of its colour turns in a frame: what is added to a direction of length 1.
TURN = 0.45
COLOURS = 0.08, 0.92  # least and greatest of every channel


@dataclass(frozen=True)
class Plan:
    """An ellipse in every frame."""

    centre: Array  # (FRAMES, 2): in the picture, (x, y) [pixels]
    half_axes: Array  # (FRAMES, 2): [pixels]
    angle: Array  # (FRAMES,): of the first half axis, from x towards y [radians]
    colour: Array  # (FRAMES, 3): RGB in [0, 1]

    @cached_property
    def boxes(self) -> Array:
        """Extents, shape (FRAMES, 4): x, y, width, height [pixels]."""
        directions = np.stack([np.cos(self.angle), np.sin(self.angle)], axis=1)
        across = directions[:, ::-1]
        first, second = np.split(self.half_axes, 2, axis=1)
        half = np.sqrt((first * directions) ** 2 + (second * across) ** 2)
        return np.hstack([self.centre - half, 2 * half])

    def inwards(self, frame: int, points: Array) -> Array:
        """Points in the ellipse's own frame, in which it is the unit circle; shape (..., 2)."""
        cosine, sine = np.cos(self.angle[frame]), np.sin(self.angle[frame])
        turn = np.array([[cosine, -sine], [sine, cosine]])
        return np.asarray((points - self.centre[frame]) @ turn / self.half_axes[frame])

    def around(self, frame: int) -> tuple[tuple[slice, slice], Array]:
        """Rows and columns that the ellipse may touch, and `inwards` of their pixels' centres."""
        x, y, width, height = self.boxes[frame]
        left, top = int(x) - 1, int(y) - 1
        right, bottom = int(x + width) + 2, int(y + height) + 2
        rows, columns = np.mgrid[top:bottom, left:right] + 0.5
        window = slice(top, bottom), slice(left, right)
        return window, self.inwards(frame, np.stack([columns, rows], axis=2))

    def covers(self, frame: int) -> Mask:
        """Pixels whose centres lie within the ellipse, shape (height, width)."""
        window, inwards = self.around(frame)
        covered = np.zeros(SIZE[::-1], np.bool_)
        covered[window] = (inwards * inwards).sum(axis=2) <= 1
        return covered

    def reach(self, frame: int, direction: float) -> float:
        """How far its outline is from its centre in a direction [pixels].

        Parameters
        ----------
        frame : int
        direction : float
            From x towards y [radians].
        """
        towards = np.array([np.cos(direction), np.sin(direction)])
        return float(1 / np.linalg.norm(self.inwards(frame, self.centre[frame] + towards)))


def drawn_plan(seed: int) -> Plan:
    """Draw trajectory, shape and colour."""
    way, shape, colour = (
        part_generator(seed, f"moreno2005/ellipse {part}") for part in ("way", "shape", "colour")
    )
    far = np.array(SIZE) - BORDER
    least, greatest = (np.full(2, np.log(half)) for half in HALF_AXES)
    turn = np.array([4 * np.pi])
    half_axes = np.exp(_random_walk(shape, least, greatest))
    angle = _random_walk(shape, -turn, turn)[:, 0]
    centre = quantised(_trajectory(way, np.full(2, BORDER), far))
    return Plan(centre, quantised(half_axes), angle, _colour_path(colour))


def _trajectory(random: np.random.Generator, low: Array, high: Array) -> Array:
    """Walk with a first-order autoregressive velocity, reflected at (2,) bounds; (FRAMES, 2)."""
    place = random.uniform(low, high)
    rate = random.normal(0, NEW_SPEED / np.sqrt(1 - KEPT * KEPT), low.shape)
    places = np.empty((FRAMES, *low.shape))
    for frame in range(FRAMES):
        places[frame] = place
        rate = KEPT * rate + random.normal(0, NEW_SPEED, low.shape)
        rate *= min(1.0, FASTEST / float(np.linalg.norm(rate)))
        place, rate = _reflected(place + rate, rate, low, high)
    return places


def _random_walk(random: np.random.Generator, low: Array, high: Array) -> Array:
    """Random walk of independent steps, reflected at its bounds (k,); shape (FRAMES, k)."""
    places = [random.uniform(low, high)]
    for step in random.normal(0, NEW, (FRAMES - 1, *low.shape)):
        places.append(_reflected(places[-1] + step, step, low, high)[0])
    return np.array(places)


def _colour_path(random: np.random.Generator) -> Array:
    """Way through the colours, at about the same pace, that bends at random; shape (FRAMES, 3)."""
    low, high = (np.full(3, level) for level in COLOURS)
    place, heading = random.uniform(low, high), _unit(random.normal(size=3))
    places = np.empty((FRAMES, 3))
    for frame in range(FRAMES):
        places[frame] = place
        heading = _unit(heading + TURN * random.normal(size=3))
        step = STEP * random.uniform(0.5, 1.5)
        place, heading = _reflected(place + step * heading, heading, low, high)
    return places


def _reflected(place: Array, rate: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """What has gone beyond a bound comes back from it, its rate turned round."""
    beyond = (place < low) | (place > high)
    bound = np.clip(place, low, high)
    return 2 * bound - place, np.where(beyond, -rate, rate)


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))
