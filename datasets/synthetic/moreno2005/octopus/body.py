"""An octopus: mantle, head, eyes and eight arms with skin between them, as overlapping balls."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.moreno2005.octopus.looks import SIDE
from trackmark.datasets.synthetic.moreno2005.octopus.relief import colour_skin, lit, moulded
from trackmark.datasets.synthetic.render.texture import fractal

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

ARMS = 8
JOINTS = 20  # balls along an arm
WEBBED = 14  # of these, from the head on: with skin between them and those of the next arm
WEB = np.array([0.25, 0.5, 0.75])  # where balls of that skin lie, from one arm to the next
# Along the body and radius of the balls of the mantle, the head being at 0 [pixels].
MANTLE = np.array([[-7, 9], [-13, 12.5], [-19, 15.5], [-25, 17], [-31, 17], [-36, 15], [-41, 11]])
HEAD, EYE = 10.0, 3.6  # radii [pixels]
EYES = np.array([[2.0, -7.5], [2.0, 7.5]])  # where they are, forwards and to the right [pixels]
FIRST_ARM = 1.9  # directions of the outermost arms, from straight ahead [radians]
THICK, THIN = 6.8, 2.2  # radius of an arm at the head and at its tip [pixels]
FINE = 2  # samples per pixel and axis
ROUNDED = 2.2  # standard deviation of the blur that joins its parts [samples]
SOFT = 0.35  # how long a place takes to change, as a part of the whole change
IRIS, PUPIL = (0.20, 0.52, 0.62), (0.03, 0.03, 0.03)  # colours of the eyes, BGR in [0, 1]


@dataclass(frozen=True)
class Posture:
    """Balls as a camera above them sees them."""

    # (k, 5): middle (x, y) and radius [pixels], how high its middle is, and its half height as a
    # part of its radius
    balls: Array
    turns: Array  # (k,): how much each is turned [radians]

    @property
    def box(self) -> Array:
        """Extents of the silhouette: x, y, width, height [pixels]."""
        places, radii = self.balls[:, :2], self.balls[:, 2:3]
        low, high = (places - radii).min(axis=0), (places + radii).max(axis=0)
        return np.concatenate([low, high - low])


@dataclass(frozen=True)
class Body:
    """Proportions and habits of an animal."""

    scale: float  # size, about 1
    # (ARMS, 3): direction from straight ahead [radians], length [pixels], curl [radians]
    arms: Array
    waves: Array  # (ARMS, 3): that run along the arms: size [radians], period [frames], phase
    # (ARMS, 3): how the arms stretch and curl more and less: size, period [frames], phase
    reaching: Array
    breath: Array  # (3,): of the mantle: the same

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
    """Offset of each row: size times the sine of time."""
    size, period, phase = waves.T
    return np.asarray(size * np.sin(2 * np.pi * time / period + phase))


def drawn_body(random: np.random.Generator) -> Body:
    """An animal, drawn at random."""
    directions = np.linspace(-FIRST_ARM, FIRST_ARM, ARMS) + random.uniform(-0.12, 0.12, ARMS)
    # Left arms curl to the left and right ones to the right, but for some.
    curls = np.sign(directions) * random.uniform(0.5, 1.2, ARMS)
    curls *= random.choice([-1, 1], ARMS, p=[0.1, 0.9])
    turns = 2 * np.pi * random.random((3, ARMS))
    return Body(
        float(random.uniform(1.05, 1.25)),
        np.stack([directions, random.uniform(28, 36, ARMS), curls], axis=1),
        np.stack(
            [random.uniform(0.06, 0.16, ARMS), random.uniform(26, 46, ARMS), turns[0]], axis=1
        ),
        np.stack(
            [random.uniform(0.02, 0.05, ARMS), random.uniform(24, 40, ARMS), turns[1]], axis=1
        ),
        np.array([random.uniform(0.03, 0.06), random.uniform(28, 44), turns[2, 0]]),
    )


class Skin:
    """Looks of a body, each of shape (SIDE, SIDE, 3), BGR in [0, 1].

    In which order places change from one to another is drawn at random.
    """

    def __init__(self, random: np.random.Generator, body: Body, looks: Sequence[Array]) -> None:
        rest = body.at_rest().balls
        self._rest = rest[:, :2]
        worn = moulded(rest, (-SIDE / 2, -SIDE / 2), 1.0, (SIDE, SIDE))[1] >= 0
        # Of the colour that it stands for, whatever part of a texture lies on the body.
        fitted = (look * (look.mean(axis=(0, 1)) / look[worn].mean(axis=0)) for look in looks)
        eyes = body.scale * EYES, body.scale * EYE
        self._looks = np.stack([_with_eyes(look, *eyes) for look in fitted]).astype(np.float32)
        order = fractal(random, SIDE, 16, 64, 0.6)
        ranks = order.ravel().argsort().argsort() / order.size
        self._order: Floats = ranks.reshape(order.shape).astype(np.float32)

    def seen(
        self,
        posture: Posture,
        corner: tuple[int, int],
        size: tuple[int, int],
        before: int,
        after: int,
        share: float,
    ) -> Floats:
        """BGR in [0, 1] and coverage in a window of the picture, with `FINE` samples a pixel.

        The window has a left top corner and a width and height [pixels]. A `share` in [0, 1] of
        the change from one look to another, given by their indices, has come.
        """
        shape = size[1] * FINE, size[0] * FINE
        left, top, step = float(corner[0]), float(corner[1]), 1 / FINE
        height, owner = moulded(posture.balls, (left, top), step, shape)
        looks = self._looks[before], self._looks[after]
        light = lit(height * FINE, ROUNDED)
        colour = np.zeros((*shape, 4), np.float32)
        colour_skin(
            owner, left, top, step, self._to_rest(posture), *looks, self._order, share, SOFT,
            light, colour,
        )  # fmt: skip
        return colour

    def _to_rest(self, posture: Posture) -> Array:
        """From the picture to places in the looks, by ball; shape (k, 2, 3)."""
        cosine, sine = np.cos(posture.turns), np.sin(posture.turns)
        rows = np.stack([cosine, sine], axis=1), np.stack([-sine, cosine], axis=1)
        turn = np.stack(rows, axis=1)
        turned = np.einsum("kij,kj->ki", turn, posture.balls[:, :2])
        shift = self._rest - turned + (SIDE / 2 - 0.5)
        return np.concatenate([turn, shift[..., None]], axis=2)


def _with_eyes(look: Array, places: Array, radius: float) -> Array:
    """A look with irises and slit pupils painted on it."""
    result = look.copy()
    rows, columns = np.indices(look.shape[:2]) + 0.5 - SIDE / 2
    for x, y in places:
        right, down = columns - x, rows - y
        result[right * right + down * down <= radius * radius] = IRIS
        result[(np.abs(right) < 0.7 * radius) & (np.abs(down) < 0.25 * radius)] = PUPIL
    return result
