"""`wang2010/table-tennis`: a player bounces a ball on a bat in front of a wall.

The paper uses the CIF sequence "Table Tennis", 50 frames of 115 x 142 pixels. The target is "a fast
moving table tennis ball"; traditional trackers deviate "as the speed of the upward motion grows in
frame 12". This sequence shows similar play (see `Play` for the motion). The hall is dim and the
ball is bright, because the ball is visible in the paper's motion map of differences of R + G + B
(Fig. 1d).

The wall is grey speckled plaster with a table in front of it. In the paper, trackers that use only
hue follow the ball until frame 11, so the ball and the wall must differ in colour.

The player moves the forearm about the elbow and keeps the bat level, except when the wrist tips it.
Lengths of bat and arm are in millimetres, relative to the centre of the bat's upper face.
"""

from functools import cached_property

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.render.sprite import Sprite, superellipse
from trackmark.datasets.synthetic.render.texture import fractal, noise
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene, part_generator

Integers = NDArray[np.int64]
Picture = NDArray[np.uint8]


@njit(cache=True)
def blend_swung(
    canvas: NDArray[np.uint8],
    picture: NDArray[np.uint8],
    left: Integers,
    top: Integers,
    swings: Integers,
    shares: Integers,
    tips: Integers,
    tip_shares: Integers,
) -> None:
    """Blend a limb over a canvas in place, averaged over its positions during the exposure.

    `picture`, shape (h + 2, w + 2, 4), is the limb at the resolution of the canvas, in the format
    of `Sprite.levels`. `left` and `top`, shape (2**k,), are the positions of its corner inside the
    border, without swing. `swings`, shape (2**k,), are the downward displacements of its end. These
    three are in 1/64 pixel. `shares`, shape (w + 2,), are the fractions of the displacement in each
    column, times 256; they fall towards the joint. `tips` and `tip_shares` describe the
    displacement by a second joint that is closer to the end. All arithmetic uses integers.
    """
    height, width = canvas.shape[:2]
    h, w = picture.shape[0] - 2, picture.shape[1] - 2
    shift = 4
    while 1 << (shift - 4) < len(left):
        shift += 1
    sums = np.empty((height, 4), np.int64)
    for x in range(width):
        sums[:] = 0
        for k in range(len(left)):
            u = 64 * (x + 1) - left[k]
            i, right = u >> 6, u & 63
            if i < 0 or i > w:
                continue
            share = (64 - right) * shares[i] + right * shares[i + 1]
            tip_share = (64 - right) * tip_shares[i] + right * tip_shares[i + 1]
            down = top[k] + ((swings[k] * share + tips[k] * tip_share + 8192) >> 14)
            for y in range(height):
                v = 64 * (y + 1) - down
                j, lower = v >> 6, v & 63
                if j < 0 or j > h:
                    continue
                for c in range(4):
                    above = (64 - right) * picture[j, i, c] + right * picture[j, i + 1, c]
                    below = (64 - right) * picture[j + 1, i, c] + right * picture[j + 1, i + 1, c]
                    sums[y, c] += (64 - lower) * above + lower * below
        for y in range(height):
            cover = sums[y, 3] >> shift
            if cover == 0:
                continue
            for c in range(3):
                value = canvas[y, x, c] * (65280 - cover) + 255 * (sums[y, c] >> shift)
                canvas[y, x, c] = (value + 32640) // 65280


LIGHT = 0.45  # light on wall, table and player; the ball is brighter
PLAYER_FINE = 4  # supersampling per axis


class PaintSheet:
    """Transparent sheet on which objects are painted over each other, lit by one lamp.

    Positions and lengths are in millimetres. `origin` is the position (0, 0), measured from the
    upper left corner of the sheet [pixels]. `scale` is in pixels/millimetre, `size` is width and
    height in pixels. `lamp` is the unit direction to the light: right, down, towards the camera.
    """

    def __init__(
        self, size: tuple[int, int], origin: tuple[float, float], scale: float, lamp: Array
    ) -> None:
        self._lamp, self._scale = lamp, scale
        rows, columns = np.indices((size[1] * PLAYER_FINE, size[0] * PLAYER_FINE))
        self.x = ((columns + 0.5) / PLAYER_FINE - origin[0]) / scale
        self.y = ((rows + 0.5) / PLAYER_FINE - origin[1]) / scale
        self._colour = np.zeros((*self.x.shape, 3))
        self._coverage = np.zeros(self.x.shape)

    def sprite(self, side: int) -> Sprite:
        """Return the painted sheet in the light of the hall; it is mirrored if `side` is -1."""
        return Sprite(LIGHT * self._colour[:, ::side], self._coverage[:, ::side])

    def grain(self, random: Generator, coarsest: int, finest: int, stretch: float = 1.0) -> Array:
        """Return noise over the sheet, about in [-1, 1], stretched horizontally by `stretch`.

        `coarsest` and `finest` are numbers of cells per 512 pixels of the sheet.
        """
        noise = fractal(random, 512, coarsest, finest, 0.8)
        rows, columns = np.indices(self.x.shape)
        return np.asarray(noise[rows % 512, (columns / stretch).astype(np.int64) % 512])

    def inside(self, distance: Array) -> Array:
        """Return the coverage for a distance to the outline, positive inside [millimetres]."""
        return np.asarray(np.clip(distance * self._scale * PLAYER_FINE + 0.5, 0, 1))

    def tube(
        self,
        points: ArrayLike,
        radii: ArrayLike,
        colour: ArrayLike,
        *,
        bumps: Array | float = 1.0,
        edge: float = 0.0,
    ) -> None:
        """Paint a round limb: the hull of balls along a line, with linearly interpolated radii.

        `bumps` are light gains over the sheet, such as folds and grain. `edge`, in [0, 1], is the
        darkening of the outline, which separates limbs of equal colour.
        """
        points, radii = np.asarray(points, np.float64), np.asarray(radii, np.float64)
        depth, radius = np.full(self.x.shape, np.inf), np.ones_like(self.x)
        right, down = np.zeros_like(self.x), np.zeros_like(self.x)
        for k in range(len(points) - 1):
            step = points[k + 1] - points[k]
            u, v = self.x - points[k, 0], self.y - points[k, 1]
            along = np.clip((u * step[0] + v * step[1]) / (step * step).sum(), 0, 1)
            r = radii[k] + along * (radii[k + 1] - radii[k])
            u, v = (u - along * step[0]) / r, (v - along * step[1]) / r
            segment_depth = np.sqrt(u * u + v * v)
            nearer = segment_depth < depth
            for whole, part in ((depth, segment_depth), (right, u), (down, v), (radius, r)):
                whole[nearer] = part[nearer]
        forward = np.sqrt(np.clip(1 - depth * depth, 0, 1))
        lit = right * self._lamp[0] + down * self._lamp[1] + forward * self._lamp[2]
        rim = np.square(np.clip(depth, 0, 1))
        light = (0.48 + 0.66 * np.clip(lit, 0, 1)) * (1 - edge * rim * rim) * bumps
        cover = self.inside((1 - depth) * radius)
        self.lay(np.asarray(colour, np.float64) * light[..., None], cover)

    def lay(self, colour: Array, coverage: Array) -> None:
        """Paint a colour over the sheet; `coverage`: its opacity in [0, 1]."""
        below = self._coverage * (1 - coverage)
        total = coverage + below
        mixed = colour * coverage[..., None] + self._colour * below[..., None]
        self._colour = mixed / np.maximum(total, 1e-9)[..., None]
        self._coverage = total

    def shade(self, gain: Array) -> None:
        """Multiply the painted colours by a gain."""
        self._colour = self._colour * gain[..., None]


BLADE = 75.0  # half width of the blade
RUBBERS = ((38, 34, 168), (46, 44, 48), (34, 30, 142))
SKINS = ((128, 152, 220), (104, 132, 206), (146, 170, 232), (78, 100, 168))
SLEEVES = (
    (150, 84, 46), (62, 58, 60), (92, 108, 60), (120, 60, 74),
)  # fmt: skip
WOOD = np.array((112, 164, 204), np.float64)

SHEET_SIZE = 170, 84  # size of the sheet with bat and arm [pixels]
BAT = 28.0, 24.0  # centre of the bat's upper face on the sheet [pixels]
WRIST, ELBOW = 186.0, 430.0  # horizontal distance of wrist and elbow from the centre of the bat
SOFT = 3  # half width of the edge of the player's shadow [pixels]
HALVINGS = PLAYER_FINE.bit_length() - 1  # halvings from the painted to the image resolution


class Player:
    """Bat, hand and arm, painted once with random colours and posture.

    `lamp` and `scale` are as in `PaintSheet`, `side` is as in `Play`.
    """

    def __init__(self, random: Generator, lamp: Array, scale: float, side: int) -> None:
        rubber, skin, cloth = (
            np.array(colours[int(random.integers(len(colours)))]) * random.uniform(0.92, 1.06)
            for colours in (RUBBERS, SKINS, SLEEVES)
        )
        paint = PaintSheet(SHEET_SIZE, BAT, scale, lamp * (side, 1, 1))
        grain = 1 + 0.05 * paint.grain(random, 32, 256)
        elbow = np.array([ELBOW, random.uniform(95, 150)])
        _arm(paint, random, skin, cloth, elbow, grain)
        _bat(paint, rubber, random.uniform(0.15, 0.20), grain)
        _hand(paint, skin, grain)
        sprite = paint.sprite(side)
        self._limb = sprite.levels[HALVINGS]
        self._shadow = sprite.shadow(0.34, SOFT * PLAYER_FINE).levels[HALVINGS]
        self._bat = np.array([BAT[0] if side > 0 else SHEET_SIZE[0] - BAT[0], BAT[1]])
        self._reach = side * scale

    def draw(self, canvas: Picture, bat: Array, rest: float, tip: Array) -> None:
        """Draw the player over a canvas in place.

        `bat`, shape (2**k, 2), is the centre of the bat's upper face at 2**k times of the exposure.
        `rest` is its row in the painted posture. `tip`, shape (2**k,), is the downward displacement
        by the wrist [pixels].
        """
        self._blend(canvas, self._limb, self._bat, bat, rest, tip)

    def draw_shadow(
        self, canvas: Picture, bat: Array, rest: float, tip: Array, away: Array
    ) -> None:
        """Draw the player's shadow, displaced by `away` [pixels]; see `draw`."""
        self._blend(canvas, self._shadow, self._bat + SOFT, bat + away, rest + away[1], tip)

    def _blend(
        self, canvas: Picture, picture: Picture, origin: Array, bat: Array, rest: float, tip: Array
    ) -> None:
        columns = np.arange(picture.shape[1]) - 0.5
        away = (columns - origin[0]) / self._reach
        shares = 1 - np.clip((away - WRIST) / (ELBOW - WRIST), 0, 1)
        tip_shares = np.clip(1 - away / WRIST, 0, None)
        places = 64 * (bat - (origin[0], rest))
        left = places[:, 0].round().astype(np.int64)
        tips = (64 * tip).round().astype(np.int64)
        swings = places[:, 1].round().astype(np.int64) - tips
        top = np.full(len(bat), round(64 * (rest - origin[1])))
        blend_swung(
            canvas, picture, left, top,
            swings, np.round(256 * shares).astype(np.int64),
            tips, np.round(256 * tip_shares).astype(np.int64),
        )  # fmt: skip


def _arm(
    paint: PaintSheet, random: Generator, skin: Array, cloth: Array, elbow: Array, grain: Array
) -> None:
    wrist = np.array([186.0, 16.0])
    forearm = elbow - wrist
    paint.tube(
        [wrist - 0.08 * forearm, wrist, wrist + 0.5 * forearm, elbow],
        (25, 26, 38, 44),
        skin * 0.97,
        bumps=grain,
    )
    # The cuff of the sleeve is about 10 cm behind the wrist and casts a shadow on the arm.
    start = random.uniform(0.22, 0.36)
    along = ((paint.x - wrist[0]) * forearm[0] + (paint.y - wrist[1]) * forearm[1]) / (
        forearm * forearm
    ).sum()
    paint.shade(1 - 0.35 * np.clip(1 - (start - along) / 0.06, 0, 1) * (along < start + 0.1))
    folds = paint.grain(random, 8, 64, 0.7)
    slope = folds - np.roll(folds, (5, 4), (0, 1))
    weave = np.clip(1 + 0.12 * folds + 0.6 * slope, 0.6, 1.35) * grain
    cuff = wrist + start * forearm
    paint.tube(
        [cuff, cuff + 0.03 * forearm, cuff + 0.3 * forearm, elbow, elbow + 0.4 * forearm],
        (42, 46, 50, 58, 64),
        cloth,
        bumps=weave * (1 - 0.25 * (np.abs(along - start - 0.035) < 0.006)),
    )


def _bat(paint: PaintSheet, rubber: Array, tilt: float, grain: Array) -> None:
    paint.tube([(62, 2), (96, 3)], (9, 13), WOOD, bumps=grain)
    paint.tube([(92, 3), (176, 5)], (12.5, 14.5), WOOD * 0.9, bumps=grain, edge=0.3)
    under, above = np.array((40, 38, 42), np.float64), rubber
    for down, colour in ((11.0, under), (7.5, WOOD * 0.86), (4.0, above * 0.62), (0.0, above)):
        x, y = paint.x / BLADE, (paint.y - down) / (BLADE * tilt)
        distance = (1 - np.sqrt(x * x + y * y)) * BLADE * tilt
        gloss = 1 + 0.22 * np.clip(0.5 - 0.6 * y - 0.5 * x, 0, 1)
        paint.lay(colour * (grain * gloss)[..., None], paint.inside(distance))


def _hand(paint: PaintSheet, skin: Array, grain: Array) -> None:
    paint.tube([(116, 6), (150, 8), (190, 15)], (27, 31, 25), skin, bumps=grain)
    for x, reach, thick in ((158, 24, 9.0), (142, 28, 10.0), (125, 29, 10.5)):
        paint.tube(
            [(x + 4, -16), (x - 2, 4), (x - 1, reach)],
            (thick, thick + 0.8, thick - 1),
            skin * 1.01,
            bumps=grain,
            edge=0.42,
        )
    # The forefinger lies along the lower face of the blade, and the thumb over the handle.
    paint.tube([(118, 22), (96, 25), (66, 20)], (10.5, 9.5, 8), skin * 0.98, bumps=grain, edge=0.35)
    paint.tube(
        [(146, -20), (118, -16), (88, -5)], (12, 10.5, 9), skin * 1.02, bumps=grain, edge=0.35
    )


BALL_FINE = 8  # supersampling per axis


def ball(random: Generator, lamp: Array, diameter: float) -> Sprite:
    """Return an orange celluloid ball with a diameter in image pixels."""
    paint = np.array([random.uniform(36, 56), random.uniform(138, 154), 240.0])
    side = 2 * int(np.ceil(diameter * BALL_FINE / 2)) + 2
    radius = diameter * BALL_FINE / 2
    right, down, coverage = superellipse(side, side, radius, radius, 2)
    forward = np.sqrt(np.clip(1 - right * right - down * down, 0, 1))
    facing = right * lamp[0] + down * lamp[1] + forward * lamp[2]
    light = 0.50 + 0.62 * np.clip(0.15 + 0.85 * facing, 0, 1)
    # Specular highlight: the normal is half-way between the lamp and the camera.
    half = (lamp + (0, 0, 1)) / np.sqrt(2 + 2 * lamp[2])
    shine = np.clip(right * half[0] + down * half[1] + forward * half[2], 0, 1)
    for _ in range(5):
        shine = shine * shine
    colour = np.clip(paint * light[..., None] + 120 * shine[..., None], 0, 255)
    return Sprite(colour, coverage)


WALL_FINE = 3  # supersampling per axis
WALL_SIDE = 512  # side of the textures [painted pixels]
TABLES = ((92, 74, 34), (66, 84, 30), (110, 66, 40))


def wall(random: Generator, width: int, height: int) -> NDArray[np.uint8]:
    """Return a wall with random tone, speckles, joints and table, shape (height, width, 3)."""
    shape = height * WALL_FINE, width * WALL_FINE
    cut = slice(shape[0]), slice(shape[1])
    y, x = ((axis[cut] + 0.5) / WALL_FINE for axis in np.indices((WALL_SIDE, WALL_SIDE)))
    tint = np.array([random.uniform(1.02, 1.09), 1.0, random.uniform(0.93, 0.99)])
    tone = random.uniform(112, 140) * (1 + 0.05 * fractal(random, WALL_SIDE, 2, 16)[cut])
    tone = tone * (1 + 0.10 * fractal(random, WALL_SIDE, 64, 256, 0.95)[cut])
    picture = tone[..., None] * tint
    for share, gains in ((0.62, (0.62, 0.62, 0.64)), (0.66, (1.34, 1.33, 1.32)),
                         (0.8, (0.72, 0.82, 0.96)), (0.8, (1.10, 0.94, 0.80))):  # fmt: skip
        cells = int(random.choice([128, 256]))
        speckle = np.clip((noise(random, WALL_SIDE, cells)[cut] - share) * 5, 0, 1)[..., None]
        picture *= 1 + speckle * (np.array(gains) - 1)
    picture *= _joints(random, x, y)[..., None]
    _put_table(random, picture, y, height)
    blocks = picture.reshape(height, WALL_FINE, width, WALL_FINE, 3).mean(axis=(1, 3))
    return np.asarray(np.clip(np.round(LIGHT * blocks), 0, 255), np.uint8)


def _joints(random: Generator, x: Array, y: Array) -> Array:
    """Return the light gain of the joints between the wall's panels, with their lit edges."""
    gain = np.ones(x.shape)
    first, spacing = random.uniform(5, 50), random.uniform(46, 90)
    upright = [(first + spacing * k, x) for k in range(int(random.integers(4)))]
    for place, across in [(random.uniform(14, 50), y), *upright]:
        gain *= 1 - 0.42 * np.clip(1.1 - np.abs(across - place), 0, 1)
        gain *= 1 + 0.16 * np.clip(1 - np.abs(across - place - 1.6), 0, 1)
    return gain


def _put_table(random: Generator, picture: Array, y: Array, height: int) -> None:
    top = height - random.uniform(5, 9)
    paint = np.array(TABLES[int(random.integers(len(TABLES)))], np.float64)
    picture *= (1 - 0.3 * np.clip(1 - (top - y) / 6, 0, 1) * (y < top))[..., None]
    for begins, colour in ((top, paint * 1.3), (top + 1.8, (196, 198, 196)), (top + 3.4, paint)):
        share = np.clip((y - begins) / 1.2 + 0.5, 0, 1)[..., None]
        picture += share * (np.asarray(colour) - picture)


FRAMES = 50
FRAMES_PER_SECOND = 30.0

STROKE = 11  # first frame after the stroke, which is the paper's frame 12
LIFTED = 7.0  # time at which the bat begins to lift the ball steadily, until the stroke [frames]
CATCH = 3.0  # deceleration of the ball on the bat [pixels/frame²]
STEPS = 64  # integration steps per frame
FLICK = 0.2  # time in which the bat loses most of its speed after the ball has left it [frames]


class Play:
    """Motion of ball and bat: flights under gravity, soft catches, and one stroke.

    The ball is in free flight or on the bat. The bat catches the ball by moving down with it, and
    then lifts it; the acceleration of both motions is equal and constant. The stroke is the event
    that the paper names ("the speed of the upward motion grows in frame 12"). Before the stroke,
    the bat lifts the ball steadily; in the paper's frame 11 the wrist accelerates the bat upwards.
    The gravity fits a ball of 40 mm that is recorded at 30 frames per second.

    `width` and `height` are the size of the image, `diameter` is the diameter of the ball [pixels].
    `gravity` is the acceleration of the ball in flight [pixels/frame²]. `flights`, shape (k, 2),
    are start and end of each flight [frames]. `side` is -1 if the arm enters from the left, and 1
    if it enters from the right.
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
        """Return the centre (x, y) of the bat's upper face [pixels], shape `times.shape + (2,)`."""
        return self._interpolate(self._bat, times)

    def tip(self, times: ArrayLike) -> Array:
        """Return the downward displacement of the bat's centre by the wrist [pixels]."""
        return quantised(np.interp(np.asarray(times, np.float64), self._times, self._tip))

    def ball(self, times: ArrayLike) -> Array:
        """Return the centre (x, y) of the ball [pixels], shape `times.shape + (2,)`."""
        return self._interpolate(self._ball, times)

    def _interpolate(self, positions: Array, times: ArrayLike) -> Array:
        axes = [np.interp(np.asarray(times, np.float64), self._times, axis) for axis in positions.T]
        return quantised(np.stack(axes, axis=-1))

    def _knots(self, random: Generator) -> tuple[Array, Array]:
        """Sample the ball's downward speed at key times [frames], and its flights."""
        lift, down, start = random.uniform(2.2, 2.6), random.uniform(5, 6), STROKE - 1.0
        landing = LIFTED - (down + lift) / CATCH
        flights = [(-1.0, landing)]
        knots = [(-1.0, down - self.gravity * (landing + 1)), (landing, down)]
        # Half of the gravity per frame corrects the first step of the numerical integration.
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
        """Return the positions of the bat, and its displacement by the wrist [pixels]."""
        times, rest = self._times, self._ball[:, 1] + self.diameter / 2
        rows, tip = rest.copy(), np.zeros_like(rest)
        for start, end in self.flights:
            during = (times > start) & (times < end)
            t = times[during]
            share = smooth_step(t, start, end)
            places, speeds = (np.interp((start, end), times, values) for values in (rest, speed))
            if start == STROKE - 1:  # The wrist strikes while the arm continues its motion.
                flick = speed[during][0] - speeds[0]
                tip[during] = (1 - share) * _eased(t - start, flick)
            leaving = places[0] + _eased(t - start, speeds[0])
            meeting = places[1] - _eased(end - t, speeds[1])
            rows[during] = (1 - share) * leaving + share * meeting + tip[during]
        return np.stack([self._ball[:, 0] + aside, np.maximum(rows, rest)], axis=1), tip


def _eased(times: Array, speed: float) -> Array:
    """Return the distance that an exponentially decaying speed has covered [pixels]."""
    return np.asarray(speed * FLICK * (1 - np.exp(-times / FLICK)))


SIZE = 142, 115

EXPOSURE = 0.45  # fraction of the frame time for which the shutter is open
# number of times within an exposure: between two times, objects move by at most 1.5 pixels
INSTANTS = 8
WALL_DISTANCE = 16.0  # offset of shadows on the wall from their objects [pixels]
CAMERA = Camera(SIZE, noise=3.0, fall=(0.1, 0.1))


class TableTennisScene(SeededScene):
    """Scene of a player with bat and ball in front of a wall."""

    label, length, size = "table-tennis", FRAMES, SIZE
    fps = FRAMES_PER_SECOND

    def __init__(self, parameters: SceneParameters) -> None:
        super().__init__(parameters)
        self.play = Play(self._seed, *SIZE)

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        Width and height of a box are the ball's diameter; the ball is never occluded. The attribute
        `speed-up` is True from the stroke until the ball reaches its highest point.
        """
        frames = np.arange(FRAMES)
        centre = self.play.ball(frames)
        sides = np.full_like(centre, self.play.diameter)
        rising = np.diff(centre[:, 1], prepend=np.inf) < 0
        struck = (frames >= STROKE) & (np.cumsum(~rising & (frames >= STROKE)) == 0)
        return SceneTruth(
            np.concatenate([centre - sides / 2, sides], axis=1),
            np.ones(FRAMES),
            {"speed-up": struck},
        )

    def render(self, frame: int) -> Image:
        canvas = self._wall.copy()
        moments = frame + EXPOSURE * ((np.arange(INSTANTS) + 0.5) / INSTANTS - 0.5)
        at_bat, at_ball = self.play.bat(moments), self.play.ball(moments)
        rest, tip = float(self.play.bat(0)[1]), self.play.tip(moments)
        away = -WALL_DISTANCE * self._lamp[:2]
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
        random = self._random("lamp")
        lamp = np.array([random.uniform(-0.6, 0.6), random.uniform(-0.9, -0.6), 0.7])
        return np.asarray(lamp / np.sqrt((lamp * lamp).sum()))

    @cached_property
    def _wall(self) -> Image:
        return wall(self._random("wall"), *SIZE)

    @cached_property
    def _player(self) -> Player:
        return Player(self._random("player"), self._lamp, self.play.diameter / 40, self.play.side)

    @cached_property
    def _ball(self) -> Sprite:
        return ball(self._random("ball"), self._lamp, self.play.diameter)

    @cached_property
    def _ball_shadow(self) -> Sprite:
        return self._ball.shadow(0.3, 2 * BALL_FINE)
