"""Motion of ball and bat: flights under gravity, soft catches, and one stroke.

The ball is in free flight or on the bat. The bat catches it by going down with it, and brings it up
again with the same deceleration: the ball's speed changes evenly there. The stroke is the one event
that the paper names ("the speed of the upward motion grows in frame 12"). Until then the bat lifts
the ball evenly; in the paper's frame 11 a flick of the wrist sends it up. Gravity is that of a ball
of 40 mm, filmed at 30 frames per second.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

FRAMES = 50
FRAMES_PER_SECOND = 30.0

STROKE = 11
"""First frame that shows the ball struck: the paper's frame 12."""

LIFTED = 7.0
"""Time at which the bat begins to lift the ball evenly, until the stroke [frames]."""

CATCH = 3.0
"""Deceleration of the ball on the bat [pixels/frame²]."""

STEPS = 64
"""Steps of the integration per frame."""

FLICK = 0.2
"""Time in which the bat loses most of its speed when the ball has left it [frames]."""


class Play:
    """Play with bat and ball in an image of `width` and `height` [pixels].

    Attributes
    ----------
    diameter : float
        Diameter of the ball [pixels].
    gravity : float
        Acceleration of the ball in flight [pixels/frame²].
    flights : ndarray of float64, shape (k, 2)
        Start and end of each flight [frames].
    side : int
        -1 if the arm comes from the left, 1 if it comes from the right.
    """

    def __init__(self, seed: int, width: int, height: int) -> None:
        random = part_generator(seed, "table-tennis play")
        self.diameter = float(quantised(random.uniform(10.0, 11.0, 1))[0])
        self.gravity = 9.81 * (self.diameter / 0.040) / FRAMES_PER_SECOND**2
        self.side = int(random.choice([-1, 1]))
        times = np.arange(-STEPS, (FRAMES + 10) * STEPS) / STEPS
        knots, self.flights = self._knots(random)
        speed = np.interp(times, *knots)
        rows = np.cumsum((speed[1:] + speed[:-1]) / 2) / STEPS
        rows = height - random.uniform(39, 42) + rows - rows[11 * STEPS - 1]
        self._times = times[1:]
        walk = random.uniform(1.0, 1.15) * (self._times - FRAMES / 2)
        walk += 2 * np.sin(np.pi * (self._times / 25 + random.uniform(-1, 1)))
        columns = width / 2 - self.side * random.uniform(0, 6) + random.choice([-1, 1]) * walk
        self._ball: Array = np.stack([columns, rows], axis=1)
        self._bat, self._tip = self._follow(speed[1:], random.uniform(-3, 3))

    def bat(self, times: ArrayLike) -> Array:
        """Middle of the bat's upper face (x, y) [pixels], shape `times.shape + (2,)`."""
        return self._at(self._bat, times)

    def tip(self, times: ArrayLike) -> Array:
        """Displacement of that point by the wrist, downwards [pixels], shape `times.shape`."""
        return quantised(np.interp(np.asarray(times, np.float64), self._times, self._tip))

    def ball(self, times: ArrayLike) -> Array:
        """Centre of the ball (x, y) [pixels], shape `times.shape + (2,)`."""
        return self._at(self._ball, times)

    def _at(self, way: Array, times: ArrayLike) -> Array:
        axes = [np.interp(np.asarray(times, np.float64), self._times, axis) for axis in way.T]
        return quantised(np.stack(axes, axis=-1))

    def _knots(self, random: np.random.Generator) -> tuple[Array, Array]:
        """Draw the ball's speed: times [frames] and speeds down, shape (2, k); and its flights."""
        lift, down, start = random.uniform(2.2, 2.6), random.uniform(5, 6), STROKE - 1.0
        landing = LIFTED - (down + lift) / CATCH
        flights = [(-1.0, landing)]
        knots = [(-1.0, down - self.gravity * (landing + 1)), (landing, down)]
        # Gravity takes half of its speed per frame from the first step of the flight.
        up = lift + random.uniform(6.8, 8.4) + self.gravity / 2
        knots += [(LIFTED, -lift), (start, -lift), (start + 1e-6, -up)]
        while start <= FRAMES:
            down = random.uniform(7, 8.5)
            landing = start + (up + down) / self.gravity
            flights.append((start, landing))
            up, start = down, landing + 2 * down / CATCH
            knots += [(landing, down), (start, -up)]
        return np.array(knots).T, np.array(flights)

    def _follow(self, speed: Array, aside: float) -> tuple[Array, Array]:
        """Return the bat's places, and how far the wrist tips it down [pixels]."""
        times, rest = self._times, self._ball[:, 1] + self.diameter / 2
        rows, tip = rest.copy(), np.zeros_like(rest)
        for start, end in self.flights:
            during = (times > start) & (times < end)
            t = times[during]
            share = smooth_step(t, start, end)
            places, speeds = (np.interp((start, end), times, values) for values in (rest, speed))
            if start == STROKE - 1:  # the wrist strikes, the arm goes on as before
                flick = speed[during][0] - speeds[0]
                tip[during] = (1 - share) * _eased(t - start, flick)
            leaving = places[0] + _eased(t - start, speeds[0])
            meeting = places[1] - _eased(end - t, speeds[1])
            rows[during] = (1 - share) * leaving + share * meeting + tip[during]
        return np.stack([self._ball[:, 0] + aside, np.maximum(rows, rest)], axis=1), tip


def _eased(times: Array, speed: float) -> Array:
    """Way at times since a speed that decays [pixels]."""
    return np.asarray(speed * FLICK * (1 - np.exp(-times / FLICK)))
