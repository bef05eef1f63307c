"""Renderer of `plain/target`."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.plain.parameters import TargetParameters
from trackmark.datasets.synthetic.render.camera import Camera
from trackmark.datasets.synthetic.render.path import Loop, quantised, random_loop, smooth_step
from trackmark.datasets.synthetic.render.sprite import Sprite, cut_window, superellipse
from trackmark.datasets.synthetic.render.texture import fractal, grass, lerp, paving, pebbles
from trackmark.datasets.synthetic.scene import SceneTruth, SyntheticScene, part_generator

COLUMNS = 256  # number of columns that sample the area of the silhouette


class TargetMotion:
    """Motion and size of the target, motion of all other objects, and light.

    The silhouette of the target is a superellipse with the exponent `power`. `half_size`, shape
    (2,), is half the width and height of the target in the first frame [pixels]. The board occludes
    most in `occlusion_frame`; its width is `board_width` [pixels], or 0 without occlusion. `pan`,
    shape (2,), is the velocity of the image over the ground [pixels/frame]. `distractors` are the
    paths of the distractors' centres.
    """

    def __init__(self, parameters: TargetParameters) -> None:
        self.parameters = parameters
        self.size = np.array([parameters.width, parameters.height], np.float64)
        random = part_generator(parameters.scene, "target shape")
        self.power = int(random.choice([2, 4]))
        aspect = random.uniform(1.0, 1.45)
        half_height = min(parameters.height, parameters.width / 1.45) * random.uniform(0.085, 0.105)
        self.half_size = quantised(np.array([aspect, 1.0]) * half_height)

        random = part_generator(parameters.scene, "target path")
        margin = self.half_size * max(1.0, parameters.scale) + 3
        self._loop = random_loop(random, margin, self.size - margin, parameters.speed)

        random = part_generator(parameters.scene, "camera")
        across = random.uniform(0.8, 1.0)
        direction = np.array([across, np.sqrt(1 - across * across)]) * random.choice([-1, 1], 2)
        self.pan = parameters.pan * direction
        self._cloud_side = float(random.choice([-1, 1]))
        self.distractors = [
            self._distractor_path(part_generator(parameters.scene, f"distractor path {i}"))
            for i in range(parameters.clutter)
        ]
        self._set_exit()
        self._set_board()

    def _distractor_path(self, random: Generator) -> Loop:
        middle = self.size * random.uniform(0.25, 0.75, 2)
        half = self.size * random.uniform(0.15, 0.45, 2)
        return random_loop(random, middle - half, middle + half, self.parameters.speed)

    def _set_exit(self) -> None:
        """Select the image border where the target leaves: the nearest border."""
        n, absence = self.parameters.length, self.parameters.absence
        self._leaves = round(2 * n / 3 - absence / 2)
        self._returns = self._leaves + absence - 1
        self._exit_time = max(2, min(30, n // 8))
        place = self._loop.positions((self._leaves + self._returns) / 2)
        distances = np.concatenate([place, self.size - place])
        edge = int(np.argmin(distances))
        self._exit_axis, self._exit_high = edge % 2, edge >= 2

    def _set_board(self) -> None:
        """Set width and speed of the occluding board.

        The board occludes most of the target in the frame in which their centres coincide.
        """
        self.occlusion_frame = round(self.parameters.length / 3)
        self.board_width = self._board_middle = self._board_velocity = 0.0
        if self.parameters.occlusion == 0:
            return
        half_width = self.half_size[0] * self.scale(self.occlusion_frame)
        _, chord = silhouette_columns(self.power)
        inner = np.concatenate([[0.0], np.cumsum(chord[COLUMNS // 2 :])]) / chord.sum() * 2
        edges = np.linspace(0, 1, len(inner))
        reach = float(np.interp(self.parameters.occlusion, inner, edges))
        self.board_width = 2 * half_width * reach + (4 if self.parameters.occlusion == 1 else 0)
        room = self.half_size[0] * max(1.0, self.parameters.scale) + self.board_width / 2 + 2
        pace = max(0.01 * self.parameters.height, room / self.occlusion_frame)
        side = part_generator(self.parameters.scene, "board path").choice([-1, 1])
        self._board_velocity = float(side) * (pace + 1.5 * self.parameters.speed)
        self._board_middle = float(self.centre(self.occlusion_frame)[0])

    def scale(self, times: ArrayLike) -> Array:
        """Return the size relative to the first frame."""
        progress = np.asarray(times, np.float64) / (self.parameters.length - 1)
        return np.round(np.power(self.parameters.scale, progress) * 1024) / 1024

    def centre(self, times: ArrayLike) -> Array:
        """Return the target's centre (x, y) [pixels], shape `times.shape + (2,)`."""
        times = np.asarray(times, np.float64)
        place = self._loop.positions(times)
        if self.parameters.absence > 0:
            early = np.maximum(self._leaves - times, times - self._returns)
            out = np.clip(1 - np.maximum(early, 0) / self._exit_time, 0, 1)
            beyond = self.half_size[self._exit_axis] * self.scale(times) + 1
            goal = self.size[self._exit_axis] + beyond if self._exit_high else -beyond
            place[..., self._exit_axis] += out * out * (goal - place[..., self._exit_axis])
        return quantised(place)

    def board(self, times: ArrayLike) -> Array:
        """Return the centre column of the board [pixels]."""
        elapsed = np.asarray(times, np.float64) - self.occlusion_frame
        return quantised(self._board_middle + self._board_velocity * elapsed)

    def window_corner(self, frame: int) -> Array:
        """Return the corner (x, y) of the image on the ground [pixels]."""
        return quantised(self.pan * frame)

    def light(self, times: ArrayLike, across: ArrayLike) -> Array:
        """Return the light gain at times and horizontal image positions in [-1, 1]."""
        progress = np.asarray(times, np.float64) / (self.parameters.length - 1)
        cloud = _passing_cloud(progress, self._cloud_side * np.asarray(across, np.float64))
        return 1 - self.parameters.light * cloud


def silhouette_columns(power: int) -> tuple[Array, Array]:
    """Return centres x and half heights of the columns of a unit superellipse, (COLUMNS,) each."""
    x = (np.arange(COLUMNS) + 0.5) / COLUMNS * 2 - 1
    chord = np.sqrt(1 - x * x) if power == 2 else np.sqrt(np.sqrt(1 - x * x * x * x))
    return x, chord


def _passing_cloud(progress: Array, across: Array) -> Array:
    """Return the fraction of the cloud's effect, in [0, 1], at a progress of the sequence.

    The shade crosses the image from one side; `across` is the horizontal position in [-1, 1]. At
    the start and the end there is no shade; in the middle of the sequence it covers the whole
    image.
    """
    phase = progress - 0.08 * across
    return smooth_step(phase, 0.15, 0.4) - smooth_step(phase, 0.6, 0.85)


CHUNK = 1024  # number of frames that are measured together, which limits the memory use


def target_truth(motion: TargetMotion) -> SceneTruth:
    """Return the ground truth of all frames.

    The attributes are:

    - `occlusion`: the board hides a part of the target.
    - `out_of_view`: a part of the target or all of it is outside the image.
    - `scale_change`: the size is outside 0.8 to 1.25 times the first size.
    - `light_change`: at least a tenth of the light is missing in the image centre.
    - `clutter`: the centre of a distractor is within twice the target's larger side.
    """
    times = np.arange(motion.parameters.length)
    scale = motion.scale(times)
    half = motion.half_size * scale[:, None]
    centre = motion.centre(times)
    boxes = np.concatenate([centre - half, 2 * half], axis=1)
    inside = (boxes[:, :2] >= 0).all(axis=1) & (centre + half <= motion.size).all(axis=1)
    in_view, visibility = np.ones(len(times)), np.ones(len(times))
    covered = np.zeros(len(times), np.bool_)
    if motion.board_width > 0:
        gap = np.abs(motion.board(times) - centre[:, 0])
        covered = gap < half[:, 0] + motion.board_width / 2
    partial = np.flatnonzero(covered | ~inside)
    for start in range(0, len(partial), CHUNK):
        chosen = partial[start : start + CHUNK]
        in_view[chosen], visibility[chosen] = _visible_fractions(
            motion, chosen, centre[chosen], half[chosen]
        )
    boxes[in_view == 0] = np.nan

    near = np.zeros(len(times), np.bool_)
    for path in motion.distractors:
        offset = np.abs(path.positions(times) - centre)
        near |= (offset < 4 * half.max(axis=1)[:, None]).all(axis=1)
    present = in_view > 0
    return SceneTruth(
        boxes,
        visibility,
        {
            "occlusion": present & (visibility < in_view),
            "out_of_view": np.logical_not(inside),
            "scale_change": (scale < 0.8) | (scale > 1.25),
            "light_change": motion.light(times, 0.0) <= 0.9,
            "clutter": near & present,
        },
    )


def _visible_fractions(
    motion: TargetMotion, frames: NDArray[np.int64], centre: Array, half: Array
) -> tuple[Array, Array]:
    """Return the fractions of the silhouette that are in the image, and visible there."""
    x, chord = silhouette_columns(motion.power)
    left = centre[:, :1] + half[:, :1] * (x - 1 / COLUMNS)
    right = centre[:, :1] + half[:, :1] * (x + 1 / COLUMNS)
    column = right - left
    top = np.maximum(centre[:, 1:] - half[:, 1:] * chord, 0)
    bottom = np.minimum(centre[:, 1:] + half[:, 1:] * chord, motion.size[1])
    height = np.maximum(bottom - top, 0)
    left, right = np.clip(left, 0, motion.size[0]), np.clip(right, 0, motion.size[0])
    whole = (2 * half[:, 1:] * chord * column).sum(axis=1)
    in_view = ((right - left) * height).sum(axis=1)
    middle = motion.board(frames)[:, None]
    first, last = middle - motion.board_width / 2, middle + motion.board_width / 2
    behind = np.maximum(np.minimum(right, last) - np.maximum(left, first), 0)
    hidden = (behind * height).sum(axis=1)
    return in_view / whole, np.clip((in_view - hidden) / whole, 0, 1)


GROUNDS = (grass, paving, pebbles)
# colours of bodies and of their markings, BGR
COLOURS = np.array(
    [  # colours of body and markings, BGR
        [[38, 44, 186], [196, 222, 232]],
        [[170, 92, 34], [206, 224, 230]],
        [[28, 150, 226], [120, 52, 26]],
        [[30, 178, 218], [44, 40, 46]],
        [[128, 46, 122], [70, 190, 232]],
        [[196, 206, 214], [40, 60, 190]],
    ],
    np.float64,
)
SKIN = 256  # side of the textures of objects [pixels]
SUN = np.array([-0.45, -0.55, 0.7])  # direction to the sun (x, y, up), nearly of unit length


@dataclass(frozen=True)
class ShadedSprite:
    """Sprite with its shadow, and its painted size relative to the size in frame 0."""

    sprite: Sprite
    shadow: Sprite
    oversize: float


def paint_ground(motion: TargetMotion) -> NDArray[np.uint8]:
    """Return the ground, blurred by the pan; any window of the image size can be cut from it.

    The shape is (side + height + 1, side + width + 1, 3); the pattern has the period `side`.
    """
    parameters = motion.parameters
    random = part_generator(parameters.scene, "ground")
    side = max(256, 1 << (3 * max(parameters.width, parameters.height) // 2 - 1).bit_length())
    pattern = GROUNDS[random.integers(len(GROUNDS))](random, side)
    pattern *= (1 + 0.13 * fractal(random, side, 4, 16))[..., None]
    tile = np.clip(np.round(pattern), 0, 255).astype(np.uint8)
    blur = motion.pan * parameters.blur
    if np.abs(blur).max() >= 0.5:
        count = int(np.ceil(np.abs(blur).max())) + 1
        instants = np.round((np.arange(count) / (count - 1) - 0.5)[:, None] * blur * 64)
        corners = (instants.astype(np.int64)) % (side * 64)
        around = np.pad(tile, [(0, side + 1), (0, side + 1), (0, 0)], mode="wrap")
        sums = np.zeros(tile.shape, np.int64)
        for x, y in corners:
            sums += cut_window(around, x, y, side, side)
        tile = ((sums + count // 2) // count).astype(np.uint8)
    return np.pad(
        tile, [(0, parameters.height + 1), (0, parameters.width + 1), (0, 0)], mode="wrap"
    )


def paint_target(motion: TargetMotion) -> ShadedSprite:
    """Return the target, painted at its maximum size."""
    random = part_generator(motion.parameters.scene, "target look")
    oversize = max(1.0, motion.parameters.scale)
    return _pebble(random, _colours(motion), motion.half_size, motion.power, oversize)


def paint_distractors(motion: TargetMotion) -> list[ShadedSprite]:
    """Return objects that have the target's colours, but other shapes and markings."""
    things = []
    for i in range(motion.parameters.clutter):
        random = part_generator(motion.parameters.scene, f"distractor look {i}")
        half = motion.half_size * random.uniform(0.7, 1.05, 2)
        things.append(_pebble(random, _colours(motion), half, int(random.choice([2, 4])), 1.0))
    return things


def paint_board(motion: TargetMotion) -> ShadedSprite:
    """Return an upright planed wooden board of the image's height."""
    random = part_generator(motion.parameters.scene, "board look")
    height = motion.parameters.height + 64
    width = int(np.ceil(motion.board_width)) + 2
    columns = np.abs(np.arange(width) + 0.5 - width / 2)
    profile = np.clip(motion.board_width / 2 - columns + 0.5, 0, 1)
    side = 1 << (max(height, width) - 1).bit_length()
    grain = fractal(random, side, 16, side // 2, 0.8)
    wave = fractal(random, side, 2, 8)
    rows, place = np.indices((height, width))
    fibres = grain[(rows // 24) % side, (place * 3 + 6 * wave[rows, place]).astype(int) % side]
    tone = 0.9 * fibres + 0.5 * wave[rows, place]
    light, dark = random.permutation(np.array([[70, 118, 164], [92, 128, 152], [104, 112, 118]]))[
        :2
    ]
    colour = lerp(light * 1.15, dark * 0.62, 0.5 + 0.5 * tone)
    rounding = 1 - 0.45 * np.square(np.clip((columns / (motion.board_width / 2) - 0.6) / 0.4, 0, 1))
    coverage = np.broadcast_to(profile, (height, width)).astype(np.float64)
    sprite = Sprite(colour * rounding[None, :, None], coverage)
    return ShadedSprite(sprite, sprite.shadow(0.5, 7), 1.0)


def _colours(motion: TargetMotion) -> Array:
    random = part_generator(motion.parameters.scene, "colours")
    return np.asarray(COLOURS[random.integers(len(COLOURS))])


def _pebble(
    random: Generator, colours: Array, half: Array, power: int, oversize: float
) -> ShadedSprite:
    half_width, half_height = half * oversize
    height, width = (2 * int(np.ceil(size)) + 2 for size in (half_height, half_width))
    x, y, coverage = superellipse(height, width, half_height, half_width, power)

    marking, lean = random.choice(["half", "band", "patches"]), random.uniform(-0.6, 0.6)
    on_skin = tuple(np.clip((place + 1) * (SKIN / 4), 0, SKIN - 1).astype(int) for place in (y, x))
    wave = fractal(random, SKIN, 2, 8)[on_skin]
    grain = fractal(random, SKIN, 16, SKIN // 2, 0.9)[on_skin]
    place = y + lean * x + 0.3 * wave
    if marking == "band":
        place = 0.36 - np.abs(place)
    elif marking == "patches":
        place = wave - np.median(wave[coverage > 0])
    paint = lerp(colours[0], colours[1], 0.5 + place * half_height * 0.35)

    outer = x * x + y * y if power == 2 else x * x * x * x + y * y * y * y
    up = np.sqrt(np.clip(1 - outer, 0, 1)) + 0.25
    bend = 1.0 if power == 2 else np.maximum(np.abs(x), np.abs(y))
    length = np.sqrt(x * x * bend * bend + y * y * bend * bend + up * up)
    facing = (x * bend * SUN[0] + y * bend * SUN[1] + up * SUN[2]) / length
    shade = 0.5 + 0.62 * np.clip(facing, 0, 1) + 0.06 * grain
    shine = np.square(np.square(np.square(np.square(np.clip(facing, 0, 1)))))
    sprite = Sprite(paint * shade[..., None] + 46 * shine[..., None], coverage)
    return ShadedSprite(sprite, sprite.shadow(0.62, max(3, round(0.16 * half_height))), oversize)


MAX_INSTANTS = 32  # maximum number of times within an exposure


class TargetScene(SyntheticScene):
    """Scene of a target with background, distractors and an occluding board."""

    def __init__(self, parameters: TargetParameters) -> None:
        self.parameters = parameters
        self.motion = TargetMotion(parameters)
        self.length, self.size = parameters.length, (parameters.width, parameters.height)

    def truth(self) -> SceneTruth:
        return target_truth(self.motion)

    def render(self, frame: int) -> Image:
        parameters, motion = self.parameters, self.motion
        side = len(self._ground) - parameters.height - 1
        x, y = (np.round(motion.window_corner(frame) * 64).astype(np.int64) % (side * 64)).tolist()
        canvas: Image = cut_window(self._ground, x, y, parameters.height, parameters.width)
        for thing, path in zip(self._distractors, motion.distractors, strict=True):
            self._draw_object(
                canvas, thing, path.positions(self._instants(frame, parameters.speed)), 1.0
            )
        scale = float(motion.scale(frame))
        self._draw_object(canvas, self._target, motion.centre(self._target_instants(frame)), scale)
        if motion.board_width > 0:
            self._draw_object(canvas, self._board, self._board_centres(frame), 1.0)
        across = (np.arange(parameters.width) + 0.5) / parameters.width * 2 - 1
        sun = motion.light(frame, across)
        return self._camera.exposed(canvas, parameters.scene, frame, sun)

    def mask(self, frame: int) -> Mask:
        motion = self.motion
        canvas = np.zeros((self.parameters.height, self.parameters.width, 3), np.uint8)
        scale = float(motion.scale(frame)) / self._target.oversize
        self._target_silhouette.draw(canvas, motion.centre(frame)[None], scale)
        if motion.board_width > 0:
            place = np.array([[float(motion.board(frame)), self.parameters.height / 2]])
            self._board_silhouette.draw(canvas, place, 1.0)
        return np.asarray(canvas[:, :, 0] >= 128)

    def _draw_object(
        self, canvas: Image, thing: ShadedSprite, centres: Array, scale: float
    ) -> None:
        drop = self.motion.half_size[1] * np.array([0.16, 0.24]) * scale
        thing.shadow.draw(canvas, centres + drop, scale / thing.oversize)
        thing.sprite.draw(canvas, centres, scale / thing.oversize)

    def _instants(self, frame: int, travelled: float) -> Array:
        """Return times within the exposure [frames], one per pixel that an object moves.

        Their number is a power of two, at most MAX_INSTANTS.
        """
        length = max(1.0, travelled * self.parameters.blur)
        count = min(MAX_INSTANTS, 1 << int(np.ceil(length) - 1).bit_length())
        return frame + self.parameters.blur * ((np.arange(count) + 0.5) / count - 0.5)

    def _target_instants(self, frame: int) -> Array:
        displacement = np.abs(
            np.diff(self.motion.centre(np.array([frame - 0.5, frame + 0.5])), axis=0)
        )
        return self._instants(frame, float(displacement.max()))

    def _board_centres(self, frame: int) -> Array:
        displacement = abs(float(np.diff(self.motion.board(np.array([frame, frame + 1])))[0]))
        middles = self.motion.board(self._instants(frame, displacement))
        return np.stack([middles, np.full(len(middles), self.parameters.height / 2)], axis=1)

    @cached_property
    def _ground(self) -> NDArray[np.uint8]:
        return paint_ground(self.motion)

    @cached_property
    def _target(self) -> ShadedSprite:
        return paint_target(self.motion)

    @cached_property
    def _target_silhouette(self) -> Sprite:
        return self._target.sprite.silhouette(255)

    @cached_property
    def _distractors(self) -> list[ShadedSprite]:
        return paint_distractors(self.motion)

    @cached_property
    def _board(self) -> ShadedSprite:
        return paint_board(self.motion)

    @cached_property
    def _board_silhouette(self) -> Sprite:
        return self._board.sprite.silhouette(0)

    @cached_property
    def _camera(self) -> Camera:
        return Camera(self.size, self.parameters.noise, fall=(0.1, 0.14))
