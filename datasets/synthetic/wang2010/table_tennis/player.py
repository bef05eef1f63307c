"""The player, as far as he is seen: a bat, a hand around its handle, a forearm in a sleeve.

He swings his forearm about the elbow and keeps the bat level.

Lengths are in millimetres, of a usual bat and a grown-up's arm, counted from the middle of the
bat's upper face. It is painted with the arm on the right.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.wang2010.table_tennis.paint import FINE, Paint
from datasets.synthetic.wang2010.table_tennis.swing import blend_swung

__all__ = ["Player"]

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

BLADE = 75.0
"""Half the width of the blade."""

RUBBERS = ((38, 34, 168), (46, 44, 48), (34, 30, 142))
SKINS = ((128, 152, 220), (104, 132, 206), (146, 170, 232), (78, 100, 168))
SLEEVES = (
    (198, 202, 204), (150, 84, 46), (62, 58, 60), (92, 108, 60), (172, 150, 120), (120, 60, 74),
)  # fmt: skip
WOOD = np.array((112, 164, 204), np.float64)

SIZE = 170, 84
"""Of the sheet [pixels]."""

BAT = 28.0, 24.0
"""Where the middle of the bat's upper face is on the sheet [pixels]."""


WRIST, ELBOW = 186.0, 430.0
"""How far they are from the middle of the bat, sideways."""


SOFT = 3
"""Half the width of the edge of his shadow [pixels]."""

HALVINGS = FINE.bit_length() - 1
"""From the painted resolution to the picture's."""


class Player:
    """Bat, hand and arm, painted once.

    Parameters
    ----------
    random : numpy.random.Generator
        Draws rubber, skin, cloth and how the arm is held.
    lamp : ndarray of float64, shape (3,)
        Direction to the light: right, down, to the camera.
    scale : float
        [pixels/millimetre].
    side : {-1, 1}
        From where the arm comes: left or right.
    """

    def __init__(self, random: np.random.Generator, lamp: Array, scale: float, side: int) -> None:
        rubber, skin, cloth = (
            np.array(colours[int(random.integers(len(colours)))]) * random.uniform(0.92, 1.06)
            for colours in (RUBBERS, SKINS, SLEEVES)
        )
        paint = Paint(SIZE, BAT, scale, lamp * (side, 1, 1))
        grain = 1 + 0.05 * paint.grain(random, 32, 256)
        elbow = np.array([ELBOW, random.uniform(95, 150)])
        _arm(paint, random, skin, cloth, elbow, grain)
        _bat(paint, rubber, random.uniform(0.15, 0.20), grain)
        _hand(paint, skin, grain)
        sprite = paint.sprite(side)
        self._limb = sprite.levels[HALVINGS]
        self._shadow = sprite.shadow(0.34, SOFT * FINE).levels[HALVINGS]
        self._bat = np.array([BAT[0] if side > 0 else SIZE[0] - BAT[0], BAT[1]])
        self._reach = side * scale

    def draw(self, canvas: Picture, bat: Array, rest: float) -> None:
        """Draw him.

        Parameters
        ----------
        canvas : ndarray of uint8, shape (height, width, 3)
            Changed in place.
        bat : ndarray of float64, shape (2**k, 2)
            Where the middle of the bat's upper face is at instants of the exposure [pixels].
        rest : float
            Row of the bat when the arm is as it was painted [pixels].
        """
        self._blend(canvas, self._limb, self._bat, bat, rest)

    def draw_shadow(self, canvas: Picture, bat: Array, rest: float, away: Array) -> None:
        """Draw his shadow, so far from him [pixels]; else as `draw`."""
        self._blend(canvas, self._shadow, self._bat + SOFT, bat + away, rest + away[1])

    def _blend(
        self, canvas: Picture, picture: Picture, origin: Array, bat: Array, rest: float
    ) -> None:
        columns = np.arange(picture.shape[1]) - 0.5
        away = (columns - origin[0]) / self._reach
        shares = 1 - np.clip((away - WRIST) / (ELBOW - WRIST), 0, 1)
        left, swings = ((64 * (bat - (origin[0], rest))).round().astype(np.int64)).T
        top = np.full(len(bat), round(64 * (rest - origin[1])))
        blend_swung(
            canvas, picture, left.copy(), top, swings.copy(),
            np.round(256 * shares).astype(np.int64),
        )  # fmt: skip


def _arm(
    paint: Paint,
    random: np.random.Generator,
    skin: Array,
    cloth: Array,
    elbow: Array,
    grain: Array,
) -> None:
    wrist = np.array([186.0, 16.0])
    way = elbow - wrist
    paint.tube(
        [wrist - 0.08 * way, wrist, wrist + 0.5 * way, elbow],
        (25, 26, 38, 44),
        skin * 0.97,
        bumps=grain,
    )
    # The sleeve's cuff lies a hand's breadth behind the wrist; its shade falls on the arm.
    start = random.uniform(0.22, 0.36)
    along = ((paint.x - wrist[0]) * way[0] + (paint.y - wrist[1]) * way[1]) / (way * way).sum()
    paint.shade(1 - 0.35 * np.clip(1 - (start - along) / 0.06, 0, 1) * (along < start + 0.1))
    folds = paint.grain(random, 8, 64, 0.7)
    slope = folds - np.roll(folds, (5, 4), (0, 1))
    weave = np.clip(1 + 0.12 * folds + 0.6 * slope, 0.6, 1.35) * grain
    cuff = wrist + start * way
    paint.tube(
        [cuff, cuff + 0.03 * way, cuff + 0.3 * way, elbow, elbow + 0.4 * way],
        (42, 46, 50, 58, 64),
        cloth,
        bumps=weave * (1 - 0.25 * (np.abs(along - start - 0.035) < 0.006)),
    )


def _bat(paint: Paint, rubber: Array, tilt: float, grain: Array) -> None:
    """Blade and handle, seen from somewhat above: the blade is an ellipse, `tilt` as high."""
    paint.tube([(62, 2), (96, 3)], (9, 13), WOOD, bumps=grain)
    paint.tube([(92, 3), (176, 5)], (12.5, 14.5), WOOD * 0.9, bumps=grain, edge=0.3)
    under, above = np.array((40, 38, 42), np.float64), rubber
    for down, colour in ((11.0, under), (7.5, WOOD * 0.86), (4.0, above * 0.62), (0.0, above)):
        x, y = paint.x / BLADE, (paint.y - down) / (BLADE * tilt)
        distance = (1 - np.sqrt(x * x + y * y)) * BLADE * tilt
        gloss = 1 + 0.22 * np.clip(0.5 - 0.6 * y - 0.5 * x, 0, 1)
        paint.lay(colour * (grain * gloss)[..., None], paint.inside(distance))


def _hand(paint: Paint, skin: Array, grain: Array) -> None:
    """A fist around the handle: the back of the hand, four fingers, thumb and forefinger."""
    paint.tube([(116, 6), (150, 8), (190, 15)], (27, 31, 25), skin, bumps=grain)
    for x, reach, thick in ((158, 24, 9.0), (142, 28, 10.0), (125, 29, 10.5)):
        paint.tube(
            [(x + 4, -16), (x - 2, 4), (x - 1, reach)],
            (thick, thick + 0.8, thick - 1),
            skin * 1.01,
            bumps=grain,
            edge=0.42,
        )
    # The forefinger lies along the blade's lower face, the thumb over the handle.
    paint.tube([(118, 22), (96, 25), (66, 20)], (10.5, 9.5, 8), skin * 0.98, bumps=grain, edge=0.35)
    paint.tube(
        [(146, -20), (118, -16), (88, -5)], (12, 10.5, 9), skin * 1.02, bumps=grain, edge=0.35
    )
