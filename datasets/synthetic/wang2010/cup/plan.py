"""When what happens where: the cup's way, and where the things of its colour stand on it.

The paper's frame 36 is `EVENT` here. Before it the cup comes down towards the thing behind it
and the box before it; after it the cup rises and leaves both.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.render.solids import View

Array = NDArray[np.float64]

FRAMES = 80
SIZE = 108, 85
EVENT = 35

WALL = -45.0
"""Where the wall stands [pixels towards the camera, from the cup]."""

DOWN, UP = (12.0, 32.0), (45.0, 72.0)
"""Frames in which the cup comes down and rises again."""

HASTE = 12.0, 40.0
"""Frames in which the cup goes faster to the side: past the border of the thing behind it."""


@dataclass(frozen=True)
class Cup:
    """Measures of the cup, upright, with its foot at the origin [pixels]."""

    height: float
    # foot, rim: radii below and above
    foot: float
    rim: float
    handle: float  # how far the handle reaches from the wall
    hand: int  # on which side the hand is; the handle is on the other


@dataclass(frozen=True)
class Plan:
    """A kitchen in numbers, and the cup's way through it, from the left to the right."""

    view: View
    horizon: float  # row in which the wall meets the counter [pixels]
    cup: Cup
    mirrored: bool  # whether left and right are exchanged in the pictures
    pace: float  # of the cup, sideways [pixels/frame]
    haste: float  # way sideways that it goes in addition in the frames `HASTE` [pixels]
    unevenness: Array  # (2, 3), of its way and of its tilt: size, period [frames], phase
    # column, low: where the cup's middle is in frame `EVENT` [pixels]
    column: float
    low: float
    # fall, rise: how far it comes down before, and rises after [pixels]
    fall: float
    rise: float
    behind: tuple[float, float]  # left and right border of the thing behind [pixels]
    before: tuple[float, float]  # middle and half the width of the box before [pixels]
    # how far above the cup's middle, at its lowest, the box's upper edge is seen [pixels]
    hidden: float

    def middle(self, times: ArrayLike) -> Array:
        """Where the middle of the cup's axis is seen [pixels], shape `times.shape + (2,)`."""
        t = np.asarray(times, np.float64)
        x = self.column + self._across(t) - self._across(EVENT)
        down, up = smooth_step(t, *DOWN), smooth_step(t, *UP)
        y = self.low - self.fall * (1 - down) - self.rise * up
        return quantised(np.stack([x, y], axis=-1))

    def tilt(self, times: ArrayLike) -> Array:
        """How far the cup leans to the right [radians]."""
        return self._uneven(1, np.asarray(times, np.float64))

    def _across(self, times: ArrayLike) -> Array:
        t = np.asarray(times, np.float64)
        return self.pace * t + self.haste * smooth_step(t, *HASTE) + self._uneven(0, t)

    def _uneven(self, row: int, times: ArrayLike) -> Array:
        size, period, phase = self.unevenness[row]
        return np.asarray(size * np.sin(2 * np.pi * np.asarray(times) / period + phase))


def drawn_plan(random: np.random.Generator) -> Plan:
    """A kitchen, drawn at random."""
    side = random.choice([-1.0, 1.0]) * random.uniform(0.45, 0.8)
    light = np.array([side, random.uniform(0.55, 0.8), 1.0])
    light /= np.sqrt((light * light).sum())
    view = View(random.uniform(0.22, 0.32), (float(light[0]), float(light[1]), float(light[2])))
    rim = random.uniform(6.8, 7.5)
    cup = Cup(
        height=random.uniform(15.2, 16.6),
        foot=rim * random.uniform(0.76, 0.98),
        rim=rim,
        handle=random.uniform(4.0, 4.8),
        hand=int(random.choice([-1, 1])),
    )
    pace, haste = random.uniform(0.72, 0.80), random.uniform(9.5, 11.0)
    before = haste * float(smooth_step(np.array(EVENT), *HASTE))
    least = 14.5 + EVENT * pace + before
    column = random.uniform(least, 94.5 - (FRAMES - 1 - EVENT) * pace - (haste - before))
    left = column - random.uniform(11.5, 13.5)
    return Plan(
        view=view,
        horizon=random.uniform(59, 63),
        cup=cup,
        mirrored=bool(random.integers(2)),
        pace=pace,
        haste=haste,
        unevenness=np.array(
            [
                [random.uniform(0.3, 0.9), random.uniform(42, 70), random.uniform(0, 6.28)],
                [random.uniform(0.02, 0.06), random.uniform(40, 70), random.uniform(0, 6.28)],
            ]
        ),
        column=column,
        low=random.uniform(46, 49),
        fall=random.uniform(8, 11),
        rise=random.uniform(6, 11),
        behind=(left, left + random.uniform(34, 37)),
        before=(column + random.uniform(2, 5) * pace, random.uniform(10.5, 13.0)),
        hidden=random.uniform(-1.0, 0.5),
    )
