"""What everything looks like: made once a scene, when the first frame is asked for."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.synthetic.plain.motion import TargetMotion
from trackmark.datasets.synthetic.render.sprite import Sprite, superellipse, window
from trackmark.datasets.synthetic.render.texture import fractal, grass, lerp, paving, pebbles
from trackmark.datasets.synthetic.scene import part_generator

Array = NDArray[np.float64]

GROUNDS = (grass, paving, pebbles)
COLOURS = np.array(
    [  # BGR pairs: a body and its markings
        [[38, 44, 186], [196, 222, 232]],
        [[170, 92, 34], [206, 224, 230]],
        [[28, 150, 226], [120, 52, 26]],
        [[30, 178, 218], [44, 40, 46]],
        [[128, 46, 122], [70, 190, 232]],
        [[196, 206, 214], [40, 60, 190]],
    ],
    np.float64,
)
SKIN = 256  # side of the textures that are wrapped around things, whatever these' size [pixels]
SUN = np.array([-0.45, -0.55, 0.7])  # direction to the sun (x, y, up), nearly of unit length


@dataclass(frozen=True)
class Thing:
    """A sprite, its shadow, and the size at which it was painted over that in frame 0."""

    sprite: Sprite
    shadow: Sprite
    oversize: float


def ground(motion: TargetMotion) -> NDArray[np.uint8]:
    """Texture that any window of the picture's size can be cut from, blurred by the pan.

    Shape (side + height + 1, side + width + 1, 3) for a pattern that repeats after `side`.
    """
    knobs = motion.knobs
    random = part_generator(knobs.scene, "ground")
    side = max(256, 1 << (3 * max(knobs.width, knobs.height) // 2 - 1).bit_length())
    pattern = GROUNDS[random.integers(len(GROUNDS))](random, side)
    pattern *= (1 + 0.13 * fractal(random, side, 4, 16))[..., None]
    tile = np.clip(np.round(pattern), 0, 255).astype(np.uint8)
    blur = motion.pan * knobs.blur
    if np.abs(blur).max() >= 0.5:
        count = int(np.ceil(np.abs(blur).max())) + 1
        instants = np.round((np.arange(count) / (count - 1) - 0.5)[:, None] * blur * 64)
        corners = (instants.astype(np.int64)) % (side * 64)
        around = np.pad(tile, [(0, side + 1), (0, side + 1), (0, 0)], mode="wrap")
        sums = np.zeros(tile.shape, np.int64)
        for x, y in corners:
            sums += window(around, x, y, side, side)
        tile = ((sums + count // 2) // count).astype(np.uint8)
    return np.pad(tile, [(0, knobs.height + 1), (0, knobs.width + 1), (0, 0)], mode="wrap")


def target(motion: TargetMotion) -> Thing:
    """The target, painted at the largest size that it takes."""
    random = part_generator(motion.knobs.scene, "target look")
    oversize = max(1.0, motion.knobs.scale)
    return _pebble(random, _colours(motion), motion.half_size, motion.power, oversize)


def distractors(motion: TargetMotion) -> list[Thing]:
    """Things in the target's colours, with shapes and markings of their own."""
    things = []
    for i in range(motion.knobs.clutter):
        random = part_generator(motion.knobs.scene, f"distractor look {i}")
        half = motion.half_size * random.uniform(0.7, 1.05, 2)
        things.append(_pebble(random, _colours(motion), half, int(random.choice([2, 4])), 1.0))
    return things


def board(motion: TargetMotion) -> Thing:
    """Upright board of the picture's height: planed wood."""
    random = part_generator(motion.knobs.scene, "board look")
    height = motion.knobs.height + 64
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
    return Thing(sprite, sprite.shadow(0.5, 7), 1.0)


def _colours(motion: TargetMotion) -> Array:
    random = part_generator(motion.knobs.scene, "colours")
    return np.asarray(COLOURS[random.integers(len(COLOURS))])


def _pebble(
    random: np.random.Generator, colours: Array, half: Array, power: int, oversize: float
) -> Thing:
    """A smooth, painted, slightly shining pebble of two colours."""
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
    return Thing(sprite, sprite.shadow(0.62, max(3, round(0.16 * half_height))), oversize)
