"""`wang2010/table-tennis`: a ball that a player keeps in motion with a bat.

The paper uses the CIF sequence "Table Tennis", 50 frames of 115 x 142 pixels. The target is "a
fast moving table tennis ball"; traditional trackers deviate "as the speed of the upward motion
grows in frame 12". That sequence begins near a hand that bounces a ball on a bat before a textured
wall. This is another such play; see `play` for the motion. The hall is dim, and the ball brighter
than it: the paper's motion map takes differences of R + G + B, and shows the ball (Fig. 1d).

What stays still: a wall of speckled plaster, and the table before it.

The wall's grey is a cool one: trackers by hue alone follow the paper's ball until frame 11, so
that it cannot be the colour of its wall.

Motion of ball and bat: flights under gravity, soft catches, and one stroke.

The ball is in free flight or on the bat. The bat catches it by going down with it, and brings it up
again with the same deceleration: the ball's speed changes evenly there. The stroke is the one event
that the paper names ("the speed of the upward motion grows in frame 12"). Until then the bat lifts
the ball evenly; in the paper's frame 11 a flick of the wrist sends it up. Gravity is that of a ball
of 40 mm, filmed at 30 frames per second.
"""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.knobs import SceneKnobs
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.render.texture import fractal, noise
from trackmark.datasets.synthetic.scene import Scene, Truth, part_generator
from trackmark.datasets.synthetic.wang2010.table_tennis.player import BALL_FINE, LIGHT, Player, ball

Array = NDArray[np.float64]

FINE = 3  # painted pixels per pixel of the picture
SIDE = 512  # of the textures [painted pixels]
TABLES = ((92, 74, 34), (66, 84, 30), (110, 66, 40))


def wall(random: np.random.Generator, width: int, height: int) -> NDArray[np.uint8]:
    """Paint it, shape (height, width, 3): tone, speckles, joints and table are drawn at random."""
    shape = height * FINE, width * FINE
    cut = slice(shape[0]), slice(shape[1])
    y, x = ((axis[cut] + 0.5) / FINE for axis in np.indices((SIDE, SIDE)))
    tint = np.array([random.uniform(1.02, 1.09), 1.0, random.uniform(0.93, 0.99)])
    tone = random.uniform(112, 140) * (1 + 0.05 * fractal(random, SIDE, 2, 16)[cut])
    tone = tone * (1 + 0.10 * fractal(random, SIDE, 64, 256, 0.95)[cut])
    picture = tone[..., None] * tint
    for share, gains in ((0.62, (0.62, 0.62, 0.64)), (0.66, (1.34, 1.33, 1.32)),
                         (0.8, (0.72, 0.82, 0.96)), (0.8, (1.10, 0.94, 0.80))):  # fmt: skip
        cells = int(random.choice([128, 256]))
        speckle = np.clip((noise(random, SIDE, cells)[cut] - share) * 5, 0, 1)[..., None]
        picture *= 1 + speckle * (np.array(gains) - 1)
    picture *= _joints(random, x, y)[..., None]
    _put_table(random, picture, y, height)
    blocks = picture.reshape(height, FINE, width, FINE, 3).mean(axis=(1, 3))
    return np.asarray(np.clip(np.round(LIGHT * blocks), 0, 255), np.uint8)


def _joints(random: np.random.Generator, x: Array, y: Array) -> Array:
    """Gain of light in the joints of the wall's panels, and along their lit edges."""
    gain = np.ones(x.shape)
    first, spacing = random.uniform(5, 50), random.uniform(46, 90)
    upright = [(first + spacing * k, x) for k in range(int(random.integers(4)))]
    for place, across in [(random.uniform(14, 50), y), *upright]:
        gain *= 1 - 0.42 * np.clip(1.1 - np.abs(across - place), 0, 1)
        gain *= 1 + 0.16 * np.clip(1 - np.abs(across - place - 1.6), 0, 1)
    return gain


def _put_table(random: np.random.Generator, picture: Array, y: Array, height: int) -> None:
    """The table's end, out of focus at the lower border: its top, its white line, its edge."""
    top = height - random.uniform(5, 9)
    paint = np.array(TABLES[int(random.integers(len(TABLES)))], np.float64)
    picture *= (1 - 0.3 * np.clip(1 - (top - y) / 6, 0, 1) * (y < top))[..., None]
    for begins, colour in ((top, paint * 1.3), (top + 1.8, (196, 198, 196)), (top + 3.4, paint)):
        share = np.clip((y - begins) / 1.2 + 0.5, 0, 1)[..., None]
        picture += share * (np.asarray(colour) - picture)


FRAMES = 50
FRAMES_PER_SECOND = 30.0

STROKE = 11  # first frame that shows the ball struck: the paper's frame 12
LIFTED = 7.0  # time at which the bat begins to lift the ball evenly, until the stroke [frames]
CATCH = 3.0  # deceleration of the ball on the bat [pixels/frame²]
STEPS = 64  # steps of the integration per frame
FLICK = 0.2  # time in which the bat loses most of its speed when the ball has left it [frames]


class Play:
    """Play with bat and ball in an image of `width` and `height` [pixels].

    `diameter`: Diameter of the ball [pixels]. `gravity`: Acceleration of the ball in flight
    [pixels/frame²]. `flights`: Start and end of each flight [frames]; shape (k, 2). `side`: -1 if
    the arm comes from the left, 1 if it comes from the right.
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


SIZE = 142, 115

EXPOSURE = 0.45  # part of the time between two frames for which the shutter is open
INSTANTS = 8  # of an exposure: things move by at most a pixel and a half between two of them
WALL = 16.0  # how far shadows fall from what they belong to [pixels]
CAMERA = Camera(SIZE, noise=3.0, fall=(0.1, 0.1))


def scene(knobs: SceneKnobs) -> "TableTennisScene":
    """Renderer and truth; nothing is painted yet."""
    return TableTennisScene(knobs.scene)


class TableTennisScene(Scene):
    """A player's bat and ball before a wall."""

    length, size = FRAMES, SIZE
    fps = FRAMES_PER_SECOND

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.play = Play(seed, *SIZE)

    def truth(self) -> Truth:
        """See `Scene.truth`.

        Boxes have the ball's diameter; nothing ever hides it. The attribute is `speed-up`: from
        the stroke until the ball has risen as far as it does.
        """
        frames = np.arange(FRAMES)
        centre = self.play.ball(frames)
        sides = np.full_like(centre, self.play.diameter)
        rising = np.diff(centre[:, 1], prepend=np.inf) < 0
        struck = (frames >= STROKE) & (np.cumsum(~rising & (frames >= STROKE)) == 0)
        return Truth(
            np.concatenate([centre - sides / 2, sides], axis=1),
            np.ones(FRAMES),
            {"speed-up": struck},
        )

    def render(self, frame: int) -> Image:
        canvas = self._wall.copy()
        moments = frame + EXPOSURE * ((np.arange(INSTANTS) + 0.5) / INSTANTS - 0.5)
        at_bat, at_ball = self.play.bat(moments), self.play.ball(moments)
        rest, tip = float(self.play.bat(0)[1]), self.play.tip(moments)
        away = -WALL * self._lamp[:2]
        self._player.draw_shadow(canvas, at_bat, rest, tip, away)
        self._ball_shadow.draw(canvas, at_ball + away, 1 / BALL_FINE)
        self._player.draw(canvas, at_bat, rest, tip)
        self._ball.draw(canvas, at_ball, 1 / BALL_FINE)
        fall = np.linspace(-1, 1, SIZE[0]) * self._lamp[0]
        return CAMERA.exposed(canvas, self._seed, frame, 1 + 0.14 * fall)

    def mask(self, frame: int) -> Mask:
        canvas = np.zeros((*SIZE[::-1], 3), np.uint8)
        self._ball.silhouette(255).draw(canvas, self.play.ball([frame]), 1 / BALL_FINE)
        return np.asarray(canvas[:, :, 0] >= 128)

    @cached_property
    def _lamp(self) -> Array:
        random = part_generator(self._seed, "table-tennis lamp")
        lamp = np.array([random.uniform(-0.6, 0.6), random.uniform(-0.9, -0.6), 0.7])
        return np.asarray(lamp / np.sqrt((lamp * lamp).sum()))

    @cached_property
    def _wall(self) -> Image:
        return wall(part_generator(self._seed, "table-tennis wall"), *SIZE)

    @cached_property
    def _player(self) -> Player:
        random = part_generator(self._seed, "table-tennis player")
        return Player(random, self._lamp, self.play.diameter / 40, self.play.side)

    @cached_property
    def _ball(self) -> Sprite:
        random = part_generator(self._seed, "table-tennis ball")
        return ball(random, self._lamp, self.play.diameter)

    @cached_property
    def _ball_shadow(self) -> Sprite:
        return self._ball.shadow(0.3, 2 * BALL_FINE)
