"""An octopus: mantle, head, eyes and eight arms with skin between them, as overlapping balls."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Body", "Posture", "drawn_body"]

Array = NDArray[np.float64]

ARMS = 8

JOINTS = 20
"""Balls along an arm."""

WEBBED = 8
"""Of these, from the head on: with skin between them and those of the next arm."""

WEB = np.array([0.25, 0.5, 0.75])
"""Where balls of that skin lie, from one arm to the next."""

MANTLE = np.array([[-7, 9], [-13, 12.5], [-19, 15.5], [-25, 17], [-31, 17], [-36, 15], [-41, 11]])
"""Along the body and radius of the balls of the mantle, the head being at 0 [pixels]."""

HEAD, EYE = 10.0, 3.6
"""Radii [pixels]."""

EYES = np.array([[2.0, -7.5], [2.0, 7.5]])
"""Where they are, forwards and to the right [pixels]."""

FIRST_ARM = 2.25
"""Directions of the outermost arms, from straight ahead [radians]."""

THICK, THIN = 6.8, 2.2
"""Radius of an arm at the head and at its tip [pixels]."""


@dataclass(frozen=True)
class Posture:
    """Balls as a camera above them sees them.

    Attributes
    ----------
    balls : ndarray of float64, shape (k, 5)
        Middle (x, y) and radius [pixels], how high its middle is, and its half height as a part
        of its radius.
    turns : ndarray of float64, shape (k,)
        How much each is turned [radians].
    """

    balls: Array
    turns: Array

    @property
    def box(self) -> Array:
        """Extents of the silhouette: x, y, width, height [pixels]."""
        places, radii = self.balls[:, :2], self.balls[:, 2:3]
        low, high = (places - radii).min(axis=0), (places + radii).max(axis=0)
        return np.concatenate([low, high - low])


@dataclass(frozen=True)
class Body:
    """Proportions and habits of an animal.

    Attributes
    ----------
    scale : float
        Size, about 1.
    arms : ndarray of float64, shape (ARMS, 3)
        Direction from straight ahead [radians], length [pixels], curl [radians].
    waves : ndarray of float64, shape (ARMS, 3)
        That run along the arms: size [radians], period [frames], phase.
    reaching : ndarray of float64, shape (ARMS, 3)
        How the arms stretch and curl more and less: size, period [frames], phase.
    breath : ndarray of float64, shape (3,)
        Of the mantle: the same.
    """

    scale: float
    arms: Array
    waves: Array
    reaching: Array
    breath: Array

    def at(self, time: float, place: Array, heading: float) -> Posture:
        """Posture at a time [frames], the head at a place [pixels], turned to a heading."""
        size, period, phase = self.waves.T[..., None]
        along = (np.arange(JOINTS) + 0.5) / JOINTS
        reach = _wave(self.reaching, time)[:, None]
        curl = self.arms[:, 2:] * (1 + 2 * reach) * along**1.5
        rising = 2 * np.pi * (time / period - 0.8 * along) + phase
        bends = curl + size * np.sqrt(along) * np.sin(rising)
        posture = self._posture(bends, 1 + reach, 1 + float(_wave(self.breath, time)))
        cosine, sine = np.cos(heading), np.sin(heading)
        turn = np.array([[cosine, sine], [-sine, cosine]])
        balls = posture.balls.copy()
        balls[:, :2] = place + balls[:, :2] @ turn
        return Posture(balls, posture.turns + heading)

    def at_rest(self) -> Posture:
        """With straight arms, the head at the origin, turned along x."""
        return self._posture(np.zeros((ARMS, JOINTS)), np.ones((ARMS, 1)), 1.0)

    def _posture(self, bends: Array, stretch: Array, breath: float) -> Posture:
        along = (np.arange(JOINTS) + 0.5) / JOINTS
        angles = self.arms[:, :1] + bends
        steps = np.stack([np.cos(angles), np.sin(angles)], axis=2)
        lengths = (self.arms[:, 1:2] * stretch / JOINTS)[..., None]
        roots = 0.6 * HEAD * np.stack([np.cos(self.arms[:, 0]), np.sin(self.arms[:, 0])], axis=1)
        joints = roots[:, None] + np.cumsum(steps * lengths, axis=1)
        radii = np.broadcast_to(THICK + (THIN - THICK) * along**0.8, angles.shape)
        near, far = joints[:-1, :WEBBED, None], joints[1:, :WEBBED, None]
        web = near + (far - near) * WEB[:, None]
        web_bends = bends[:-1, :WEBBED, None] * (1 - WEB) + bends[1:, :WEBBED, None] * WEB
        web_radii = np.broadcast_to(
            4.5 - 2.2 * along[:WEBBED, None] / along[WEBBED], web.shape[:-1]
        )
        mantle = np.stack([MANTLE[:, 0], 0 * MANTLE[:, 0]], axis=1)
        parts = [
            _balls(web, web_radii, 0.0, 0.5),
            _balls(joints, radii, 1.0, 0.9),
            _balls(mantle, MANTLE[:, 1] * breath, 2.0, 0.9),
            _balls(np.zeros((1, 2)), np.full(1, HEAD), 5.0, 0.8),
            _balls(EYES, np.full(2, EYE), 11.5, 0.9),
        ]
        balls = np.concatenate(parts)
        balls[:, :4] *= self.scale
        rigid = np.zeros(len(MANTLE) + 1 + len(EYES))
        return Posture(balls, np.concatenate([web_bends.ravel(), bends.ravel(), rigid]))


def _balls(places: Array, radii: Array, height: float, flat: float) -> Array:
    rest = np.broadcast_to([height, flat], (radii.size, 2))
    return np.concatenate([places.reshape(-1, 2), radii.reshape(-1, 1), rest], axis=1)


def _wave(waves: Array, time: float) -> Array:
    """Of each row: size times the sine of time."""
    size, period, phase = waves.T
    return np.asarray(size * np.sin(2 * np.pi * time / period + phase))


def drawn_body(random: np.random.Generator) -> Body:
    """An animal, drawn at random."""
    directions = np.linspace(-FIRST_ARM, FIRST_ARM, ARMS) + random.uniform(-0.12, 0.12, ARMS)
    # Left arms curl to the left and right ones to the right, but for some.
    curls = np.sign(directions) * random.uniform(1.0, 2.4, ARMS)
    curls *= random.choice([-1, 1], ARMS, p=[0.25, 0.75])
    turns = 2 * np.pi * random.random((3, ARMS))
    return Body(
        float(random.uniform(0.92, 1.12)),
        np.stack([directions, random.uniform(38, 50, ARMS), curls], axis=1),
        np.stack([random.uniform(0.15, 0.4, ARMS), random.uniform(26, 46, ARMS), turns[0]], axis=1),
        np.stack([random.uniform(0.04, 0.1, ARMS), random.uniform(24, 40, ARMS), turns[1]], axis=1),
        np.array([random.uniform(0.03, 0.06), random.uniform(28, 44), turns[2, 0]]),
    )
