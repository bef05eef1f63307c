"""How bat and ball move: the bat as the player wants it, the ball as physics has it.

Until the paper's frame 11 the ball lies on the bat, which sinks a little and lifts it slowly.
Then comes the one stroke that the paper's words tell of ("the speed of the upward motion grows
in frame 12"): the bat sends the ball up, by about its diameter in that frame. In the first version
the arm flings it, and goes up as fast for nearly two frames. In the second the wrist tips the
blade by some pixels, and the arm goes on as slowly as before: the ball alone gets faster. All that
follows is physics: the ball flies under the gravity of a ball of 40 mm filmed at 25 frames a
second, lands on the bat, which is held in its way, and bounces lower and lower until it lies on it
again. The paper tells of no other change of speed, so that there is no second stroke; the
landings after frame 17, where the ball turns from falling to rising, are what a stroke entails.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from datasets.synthetic.render.path import quantised
from datasets.synthetic.scene import part_generator

__all__ = ["FRAMES", "FRAMES_PER_SECOND", "STROKE", "Play"]

Array = NDArray[np.float64]

FRAMES = 50
FRAMES_PER_SECOND = 25.0

STROKE = 11
"""First frame that shows the ball struck: the paper's frame 12."""

STEPS = 64
"""Of the simulation, in a frame."""

REST = 0.4
"""Slower than this off the bat, the ball stays on it [pixels/frame]."""


class Play:
    """A player's play with bat and ball in a picture of a size [pixels].

    `diameter` is the ball's [pixels], `gravity` its fall [pixels/frame²], `restitution` the speed
    with which it leaves the bat over that with which it came; the arm comes from the left where
    `side` is -1, from the right where it is 1.
    """

    def __init__(self, seed: int, width: int, height: int, version: int = 1) -> None:
        random = part_generator(seed, "table-tennis play")
        self.diameter = float(quantised(random.uniform(10.0, 11.0, 1))[0])
        self.gravity = 9.81 * (self.diameter / 0.040) / FRAMES_PER_SECOND**2
        self.restitution = random.uniform(0.70, 0.78)
        self.side = int(random.choice([-1, 1]))
        self._times = np.arange(-STEPS, (FRAMES + 1) * STEPS) / STEPS
        start = width / 2 - self.side * random.uniform(4, 14), height - random.uniform(21, 25)
        sideways = self._sideways(random)
        arm = self._flung(random) if version == 1 else self._lifted(random)
        wrist = np.zeros_like(arm) if version == 1 else self._tipped(random)
        self._tip: Array = -np.cumsum(wrist) / STEPS
        pace = np.stack([sideways, -(arm + wrist)], axis=1)
        way = np.cumsum(pace, axis=0) / STEPS
        self._bat: Array = start + way - way[STEPS]
        self._ball = self._follow(pace, random)

    def bat(self, times: ArrayLike) -> Array:
        """Middle of the bat's upper face (x, y) [pixels], shape `times.shape + (2,)`."""
        return self._at(self._bat, times)

    def tip(self, times: ArrayLike) -> Array:
        """How far down the wrist has tipped that place [pixels], shape `times.shape`."""
        return quantised(np.interp(np.asarray(times, np.float64), self._times, self._tip))

    def ball(self, times: ArrayLike) -> Array:
        """Middle of the ball (x, y) [pixels], shape `times.shape + (2,)`."""
        return self._at(self._ball, times)

    def _at(self, way: Array, times: ArrayLike) -> Array:
        axes = [np.interp(np.asarray(times, np.float64), self._times, axis) for axis in way.T]
        return quantised(np.stack(axes, axis=-1))

    def _flung(self, random: np.random.Generator) -> Array:
        """Speed of arm and bat upwards at each step [pixels/frame]: they fling the ball."""
        stroke = random.uniform(1.05, 1.15) * self.diameter
        begins = STROKE - 1
        knots = [
            (0.0, random.uniform(-0.8, 0.4)),
            (3.5, random.uniform(-1.6, -0.6)),
            (7.0, random.uniform(0.8, 1.6)),
            (begins - 0.1, random.uniform(2.0, 3.0)),
            (begins + 0.25, stroke),
            (begins + 1.7, stroke),
            (begins + 2.5, 0.0),
            (begins + 3.5, -3.5),
            (begins + 6.5, -3.0),
            (begins + 9.0, random.uniform(-0.5, 0.0)),
            (28.0, random.uniform(-0.8, 0.4)),
            (36.0, random.uniform(-0.4, 0.8)),
            (43.0, random.uniform(0.6, 1.8)),
            (FRAMES, random.uniform(-1.5, 1.0)),
        ]
        times, speeds = np.array(knots).T
        return np.asarray(np.interp(self._times, times, speeds))

    def _lifted(self, random: np.random.Generator) -> Array:
        """The same where the wrist sends the ball up: the arm slows, and sinks to catch it."""
        begins = STROKE - 1
        knots = [
            (0.0, random.uniform(-0.8, 0.4)),
            (3.5, random.uniform(-1.6, -0.6)),
            (7.0, random.uniform(0.8, 1.6)),
            (begins - 0.1, random.uniform(1.0, 1.6)),
            (begins + 2.5, 0.0),
            (begins + 4.0, -1.2),
            (begins + 7.0, -1.2),
            (begins + 9.0, random.uniform(-0.5, 0.0)),
            (28.0, random.uniform(-0.8, 0.4)),
            (36.0, random.uniform(-0.4, 0.8)),
            (43.0, random.uniform(0.6, 1.8)),
            (FRAMES, random.uniform(-1.5, 1.0)),
        ]
        times, speeds = np.array(knots).T
        return np.asarray(np.interp(self._times, times, speeds))

    def _tipped(self, random: np.random.Generator) -> Array:
        """Speed upwards that the wrist adds: by a third of a diameter, and slowly back."""
        begins = STROKE - 1
        fast = random.uniform(1.1, 1.2) * self.diameter
        back = -0.07 * fast  # for five frames in all: the blade is level again
        knots = [
            (begins - 0.1, 0.0),
            (begins + 0.35, fast),
            (begins + 0.6, 0.0),
            (begins + 2.0, 0.0),
            (begins + 3.0, back),
            (begins + 7.0, back),
            (begins + 8.0, 0.0),
        ]
        times, speeds = np.array(knots).T
        return np.asarray(np.interp(self._times, times, speeds))

    def _sideways(self, random: np.random.Generator) -> Array:
        """Speed of the bat to the right at each step [pixels/frame]: to and fro."""
        knots = random.uniform(-0.9, 0.9, 8)
        when = np.linspace(0, FRAMES, len(knots))
        return np.asarray(np.interp(self._times, when, knots - knots.mean()))

    def _follow(self, pace: Array, random: np.random.Generator) -> Array:
        """Where the ball is at each step: on the bat, or in free flight."""
        above = np.array([0.0, self.diameter / 2])
        rests = self._bat - above
        place = rests[0] + (random.uniform(-4, 4), 0.0)
        velocity = pace[0].copy()
        fall = np.array([0.0, self.gravity / STEPS])
        way = np.empty_like(self._bat)
        for step, rest in enumerate(rests):
            place = place + (velocity + fall / 2) / STEPS
            velocity = velocity + fall
            if place[1] >= rest[1]:
                place[1] = rest[1]
                off = self.restitution * (velocity[1] - pace[step, 1])
                velocity = pace[step].copy()
                if off > REST:  # the bat is held so that the ball comes back to its middle
                    aside = random.uniform(-0.3, 0.3) - 0.06 * (place[0] - rest[0])
                    velocity += (aside, -off)
            way[step] = place
        return way
