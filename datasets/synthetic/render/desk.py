"""Static room: a wall with a shelf and a picture, and a desk with objects.

The origin is the image centre in x, the top of the desk in y, and the plane in which the target
moves in z. The wall is at the depth `WALL`.
"""

import itertools

import numpy as np
from numpy.random import Generator

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.render.colours import (
    ACCENTS,
    CLOTHES,
    COUNTERS,
    NEUTRALS,
    sample_similar,
    vary_slightly,
)
from trackmark.datasets.synthetic.render.finish import (
    PITCH,
    Finish,
    Pattern,
    SceneObject,
    SurfaceBuffer,
    grain,
    picture_on,
    render_surfaces,
    staggered,
    tiles,
)
from trackmark.datasets.synthetic.render.prints import print_picture
from trackmark.datasets.synthetic.render.solids import bowl, box, half_space, limb

# depth of the wall relative to the plane of the target; positive towards the camera [pixels]
WALL = -140.0

WALLS = (
    (176, 186, 190), (150, 176, 190), (186, 180, 160), (150, 172, 156), (168, 164, 182),
    (140, 168, 196), (190, 172, 150),
)  # fmt: skip
BACKS = (*ACCENTS, *CLOTHES)


def render_room(
    random: Generator, size: tuple[int, int], horizon: float, fine: int
) -> SurfaceBuffer:
    """Render a random room, which is mirrored at random.

    `size` is the image size [pixels], `horizon` the row at which the wall meets the desk, and
    `fine` the number of samples per pixel and axis.
    """
    side = float(random.choice([-1, 1]))
    things = [
        *_bare(random),
        *_shelf(random, -side * random.uniform(72, 86)),
        *_poster(random, side * random.uniform(84, 98)),
        *_pile(random, side * random.uniform(98, 116)),
        *_pot(random, side * random.uniform(20, 40)),
        *(_plant if random.random() < 0.5 else _tins)(random, -side * random.uniform(98, 120)),
        *_mug(random, -side * random.uniform(30, 55)),
    ]
    corner = -size[0] / 2, WALL * float(np.sin(PITCH)) - horizon
    return render_surfaces(things, corner, size, fine)


def _sample_colour(random: Generator, colours: tuple[tuple[int, int, int], ...]) -> Array:
    return sample_similar(random, colours, 0.08)


def _bare(random: Generator) -> list[SceneObject]:
    paper = [_striped, _sprigged, _plastered][int(random.integers(3))](random)
    wood = _sample_colour(random, COUNTERS)
    return [
        SceneObject(
            Finish(_sample_colour(random, WALLS), 0.0, paper), [half_space((0, 0, 1), WALL)]
        ),
        SceneObject(
            Finish(wood, 0.04, grain(random, 0.10, (0.10, 1.0, 1.1), 16)),
            [half_space((0, 1, 0), 0)],
        ),
        SceneObject(
            Finish(_sample_colour(random, NEUTRALS), 0.03),
            [box((0, 4, WALL + 2), (400, 7, 2), 0.8)],
        ),
    ]


def _striped(random: Generator) -> Pattern:
    pitch, share = random.uniform(14, 30), random.uniform(0.3, 0.6)
    tone = 1 - random.uniform(0.08, 0.16) * random.uniform(0.4, 1, 3)
    uneven = grain(random, 0.02)

    def gain(places: Array) -> Array:
        u = places[:, 0] / pitch - np.floor(places[:, 0] / pitch)
        thin = (np.abs(u - share - 0.08) < 0.03)[:, None]
        return np.asarray(np.where((u < share)[:, None] | thin, tone, 1.0) * uneven(places))

    return gain


def _sprigged(random: Generator) -> Pattern:
    pitch = random.uniform(20, 30)
    tone, heart = random.uniform(0.62, 0.9, 3), random.uniform(0.5, 1.15, 3)
    uneven = grain(random, 0.02)

    def gain(places: Array) -> Array:
        x, y = staggered(places, pitch)
        leaf = (np.abs(np.abs(x) - 0.9 * (y + 0.12)) < 0.045) & (np.abs(y) < 0.24)
        leaf |= (np.abs(x) < 0.02) & (np.abs(y + 0.1) < 0.24)
        colour = np.where(leaf[:, None], tone, 1.0)
        bud = x * x + (y - 0.22) ** 2 < 0.006
        return np.asarray(np.where(bud[:, None], heart, colour) * uneven(places))

    return gain


def _plastered(random: Generator) -> Pattern:
    if random.random() < 0.5:
        return tiles(random, random.uniform(26, 32), random.uniform(10, 12), np.full(3, 0.82))
    return grain(random, 0.05, coarsest=4)


def _shelf(random: Generator, x: float) -> list[SceneObject]:
    wide, y = random.uniform(66, 76), random.uniform(92, 104)
    wood = Finish(_sample_colour(random, COUNTERS[:3]), 0.03, grain(random, 0.09, (0.12, 1, 1), 16))
    z = WALL + 22
    board = [box((x, y, z), (wide, 2.6, 22), 0.8)]
    board += [box((x + s * (wide - 14), y - 10, WALL + 9), (1.6, 9, 9), 0.6) for s in (-1, 1)]
    things = [SceneObject(wood, board)]
    place, end = x - wide + 3, x + wide - 4
    while place < end - 15:
        if random.random() < 0.10:
            place += random.uniform(6, 14)
            continue
        thick, high = random.uniform(3.5, 8.0), random.uniform(24, 36)
        lean = (place + thick, y + 2.6 + high, z + random.uniform(-5, 2))
        half = thick - 0.3, high, random.uniform(13, 17)
        things.append(SceneObject(_spine(random, y, high), [box(lean, half, 0.9)]))
        place += 2 * thick
    return things


def _spine(random: Generator, foot: float, high: float) -> Finish:
    colour = _sample_colour(random, BACKS)
    bands = [
        (random.uniform(0.2, 0.4), 0.06),
        (random.uniform(1.3, 1.6), random.uniform(0.08, 0.3)),
    ]
    ink = _sample_colour(random, (*ACCENTS, (200, 216, 222))) / np.maximum(colour, 1)
    uneven = grain(random, 0.04)

    def gain(places: Array) -> Array:
        v = (places[:, 1] - foot) / high
        in_band = np.any([np.abs(v - centre) < half for centre, half in bands], axis=0)
        return np.asarray(np.where(in_band[:, None], ink, 1.0) * uneven(places))

    return Finish(colour, 0.03, gain)


def _poster(random: Generator, x: float) -> list[SceneObject]:
    wide, high, y = random.uniform(30, 38), random.uniform(34, 42), random.uniform(104, 122)
    frame, rim = _sample_colour(random, (*COUNTERS[:3], (60, 56, 54), (190, 200, 204))), 4.0
    picture = print_picture(random, "book", round(6 * wide), round(6 * high * 1.25))[
        -round(6 * high) :
    ]
    muted = 0.55 * picture + 0.45 * picture.mean(axis=2, keepdims=True)

    gain = picture_on(muted, (x, y), (wide, high))
    z = WALL + 2.0
    bars = [box((x + s * (wide + 2), y, z + 1.5), (rim / 2, high + rim, 2.5), 0.6) for s in (-1, 1)]
    bars += [
        box((x, y + s * (high + 2), z + 1.5), (wide + rim, rim / 2, 2.5), 0.6) for s in (-1, 1)
    ]
    return [
        SceneObject(
            Finish(np.full(3, 255.0), 0.06, gain), [box((x, y, z), (wide, high, 1.2), 0.3)]
        ),
        SceneObject(Finish(frame, 0.10, grain(random, 0.05)), bars),
    ]


def _pile(random: Generator, x: float) -> list[SceneObject]:
    things, y = [], 0.0
    z = WALL + random.uniform(42, 56)
    for _ in range(int(random.integers(2, 5))):
        thick = random.uniform(3.2, 6.0)
        half = random.uniform(28, 36), thick, random.uniform(20, 26)
        middle = x + random.uniform(-4, 4), y + thick, z
        finish = Finish(_sample_colour(random, BACKS), 0.04, grain(random, 0.04))
        things.append(
            SceneObject(finish, [box(middle, half, 0.9, turn=random.uniform(-0.25, 0.25))])
        )
        y += 2 * thick
    return things


def _pot(random: Generator, x: float) -> list[SceneObject]:
    z, wide, high = WALL + random.uniform(34, 60), random.uniform(10, 13), random.uniform(27, 34)
    things = [
        SceneObject(
            Finish(_sample_colour(random, ACCENTS), 0.25, grain(random, 0.03)),
            [bowl((x, 0.6, z), high, (0.92 * wide, wide), 1.2)],
        )
    ]
    for k in range(6):
        foot = np.array([x + (k - 2.5) * 0.22 * wide, 3.0, z])
        direction = np.array([random.uniform(-0.22, 0.22), 1.0, random.uniform(-0.15, 0.1)])
        tip = foot + random.uniform(42, 56) * direction
        things.append(
            SceneObject(
                Finish(_sample_colour(random, ACCENTS), 0.05), [limb(foot, tip, (1.5, 1.4))]
            )
        )
    return things


def _mug(random: Generator, x: float) -> list[SceneObject]:
    z, wide, high = WALL + random.uniform(60, 90), random.uniform(12, 14), random.uniform(24, 29)
    angles = np.linspace(-1.4, 1.4, 9)
    side = float(random.choice([-1, 1]))
    arc = np.stack(
        [x + side * (wide + 8 * np.cos(angles)), 0.5 * high + 0.32 * high * np.sin(angles),
         np.full(9, z)], axis=1
    )  # fmt: skip
    handle = [limb(a, b, (1.7, 1.7)) for a, b in itertools.pairwise(arc)]
    stripe, tone = random.uniform(0.3, 0.6) * high, random.uniform(0.4, 1.1, 3)

    def gain(places: Array) -> Array:
        return np.where((np.abs(places[:, 1] - stripe) < 3.2)[:, None], tone, 1.0)

    return [
        SceneObject(
            Finish(_sample_colour(random, (*ACCENTS, *NEUTRALS)), 0.35, gain),
            [bowl((x, 1, z), high, (0.94 * wide, wide), 2.0), *handle],
        )
    ]


def _plant(random: Generator, x: float) -> list[SceneObject]:
    z, wide, high = WALL + random.uniform(36, 48), random.uniform(17, 21), random.uniform(26, 32)
    clay = Finish(vary_slightly(random, (70, 106, 170), 0.08), 0.03, grain(random, 0.05))
    things = [SceneObject(clay, [bowl((x, 1, z), high, (0.72 * wide, wide), 2.0, closed=True)])]
    for _ in range(16):
        green = Finish(_sample_colour(random, ((52, 104, 60), (60, 128, 84), (44, 82, 56))), 0.08)
        way = np.array([random.uniform(-1, 1), random.uniform(0.7, 1.6), random.uniform(-0.4, 0.8)])
        root = np.array([x, high, z]) + 0.3 * wide * way * [1, 0, 1]
        bend = root + random.uniform(14, 24) * way
        tip = bend + random.uniform(9, 15) * way * [1.3, 0.1, 1.3]
        parts = [limb(root, bend, (1.0, 1.8), 1.5)]
        parts += [
            limb(bend, (bend + tip) / 2, (1.8, 5.5), 2),
            limb((bend + tip) / 2, tip, (5.5, 0.8), 2),
        ]
        things.append(SceneObject(green, parts))
    return things


def _tins(random: Generator, x: float) -> list[SceneObject]:
    things = []
    for k, tin_x in enumerate((x - 17, x + 19)):
        z, wide, high = WALL + 30 + 22 * k, random.uniform(13, 17), random.uniform(30, 44)
        label, tone = random.uniform(0.25, 0.4) * high, random.uniform(0.5, 1.25, 3)

        def gain(
            places: Array, low: float = label, top: float = 0.8 * high, tone: Array = tone
        ) -> Array:
            on_label = (places[:, 1] > low) & (places[:, 1] < top)
            line = np.abs(places[:, 1] - (low + top) / 2) < 1.5
            return np.where((on_label & ~line)[:, None], tone, 1.0)

        things.append(
            SceneObject(
                Finish(_sample_colour(random, ACCENTS), 0.2, gain),
                [bowl((tin_x, 0.8, z), high, (wide, wide), 1.4, closed=True)],
            )
        )
    return things
