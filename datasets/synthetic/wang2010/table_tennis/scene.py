"""`wang2010/table-tennis`: a ball that a player keeps in motion with a bat.

The paper uses the CIF sequence "Table Tennis", 50 frames of 115 x 142 pixels. The target is "a
fast moving table tennis ball"; traditional trackers deviate "as the speed of the upward motion
grows in frame 12". That sequence begins near a hand that bounces a ball on a bat before a textured
wall. This is another such play; see `play` for the motion. The hall is dim, and the ball brighter
than it: the paper's motion map takes differences of R + G + B, and shows the ball (Fig. 1d).
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.sprite import Sprite
from trackmark.datasets.synthetic.scene import Scene, Truth, part_generator
from trackmark.datasets.synthetic.wang2010.knobs import TableTennisKnobs
from trackmark.datasets.synthetic.wang2010.table_tennis.play import (
    FRAMES,
    FRAMES_PER_SECOND,
    STROKE,
    Play,
)
from trackmark.datasets.synthetic.wang2010.table_tennis.player import BALL_FINE, Player, ball
from trackmark.datasets.synthetic.wang2010.table_tennis.wall import wall

Array = NDArray[np.float64]

SIZE = 142, 115

EXPOSURE = 0.45
"""Part of the time between two frames for which the shutter is open."""

INSTANTS = 8
"""Of an exposure: things move by at most a pixel and a half between two of them."""

WALL = 16.0
"""How far shadows fall from what they belong to [pixels]."""

CAMERA = Camera(SIZE, noise=3.0, fall=(0.1, 0.1))


def scene(knobs: TableTennisKnobs) -> "TableTennisScene":
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
        """See `Scene.render`."""
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
        """See `Scene.mask`."""
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
