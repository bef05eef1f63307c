"""`moreno2005/leaf`: a leaf in the wind in front of similar leaves; a cloud covers the sun.

The paper describes a moving leaf in heavy clutter: "the illumination changes abruptly and the
target moves unpredictably". The change occurs between the first and the second of the frames that
the paper shows. All other properties are our choice. A cloud leaves dim and bluish light, and a
gust moves the leaf in the same frame. If the leaf did not move, a tracker that refits colours in
every frame would survive the change, because it would adapt to the new light one frame later.

The base of a leaf is the origin, and its tip points upwards. The middle vein can bend, and the two
halves can fold up along the vein.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.render.camera import Camera, develop_light
from trackmark.datasets.synthetic.render.colours import sample_colour, vary_colour
from trackmark.datasets.synthetic.render.lamp import remaining_light
from trackmark.datasets.synthetic.render.path import quantised, smooth_step
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.render.triangles import (
    Mesh,
    RenderedMesh,
    bounding_box,
    composite,
    grid_triangles,
    render_mesh,
    rotation_axes,
)
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene

# number of vertices across the leaf, along the blade, and along the stalk
COLUMNS, ROWS, STALK = 9, 34, 3
TALL, WIDE = 128, 96  # texels along the leaf, and across it
TEXTURE_SIDE = 128  # side of the noise textures from which the leaf's texture is cut [texels]
STALK_LENGTH, STALK_WIDTH = 0.13, 0.016  # length and half width of the stalk [lengths of the blade]


@dataclass(frozen=True)
class LeafShape:
    """Position, orientation and bending of a leaf."""

    place: Array  # (2,): column and row of the blade's centre [pixels]
    angle: float  # rotation in the image plane, from upright to the right [radians]
    yaw: float  # rotation of the right side away from the camera [radians]
    pitch: float  # rotation of the lower side away from the camera [radians]
    # angle between the directions at tip and base, positive if the tip bends away [radians]
    bend: float
    fold: float  # angle by which each half folds towards the camera [radians]


@dataclass(frozen=True)
class Blade:
    """Flat leaf without deformation."""

    length: float  # length of the blade, without the stalk [pixels]
    mesh: Mesh
    # (rows, COLUMNS): vertex positions along the leaf, from the base to the tip [pixels]
    along: Array
    # (rows, COLUMNS): vertex positions from the middle vein to the right [pixels]
    across: Array


def sample_blade(random: Generator, length: float, colour: ArrayLike) -> Blade:
    """Sample a leaf with a length of the blade [pixels] and a mean colour, BGR in [0, 255]."""
    s = np.linspace(0, 1, ROWS)
    rise, fall = random.uniform(0.55, 0.75), random.uniform(0.8, 1.05)
    half = s**rise * (1 - s) ** fall
    half *= random.uniform(0.27, 0.36) / half.max()
    half *= 1 + random.uniform(0.02, 0.06) * np.where(np.arange(ROWS) % 2, 1, -1)  # teeth
    half = np.maximum(half, STALK_WIDTH * (1 - 0.7 * s))
    stalk = np.linspace(-STALK_LENGTH, 0, STALK, endpoint=False)
    along = np.concatenate([stalk, s])
    half = np.concatenate([np.full(STALK, STALK_WIDTH), half])
    share = np.linspace(-1, 1, COLUMNS)
    across = half[:, None] * share + random.uniform(-0.12, 0.12) * (along * (1 - along))[:, None]
    texels = np.stack(
        [
            np.broadcast_to((share + 1) / 2 * WIDE, across.shape),
            np.broadcast_to(TALL * np.maximum(along, 0)[:, None], across.shape),
        ],
        axis=2,
    ).reshape(-1, 2)
    mesh = Mesh(grid_triangles(len(along), COLUMNS), texels, _texture(random, colour), closed=False)
    rows = np.repeat(along[:, None], COLUMNS, axis=1)
    return Blade(length, mesh, length * rows, length * across)


def place_blade(blade: Blade, shape: LeafShape) -> tuple[Array, Array]:
    """Return the positions [pixels] and the unit normals of a leaf's vertices.

    A position is the column, the row and the distance from the image plane towards the camera. The
    normals are those of the upper side. Both arrays have the shape (v, 3).
    """
    middle = blade.length / 2
    turn = shape.bend * (blade.along - middle) / blade.length
    # A bent vein is nearly a circular arc. Its height is the integral of its slope.
    up = (blade.along - middle) * np.sinc(turn / (2 * np.pi)) * np.cos(turn / 2)
    near = -(blade.along - middle) * np.sinc(turn / (2 * np.pi)) * np.sin(turn / 2)
    lift = np.abs(blade.across) * np.sin(shape.fold)
    points = np.stack(
        [blade.across * np.cos(shape.fold), -up - lift * np.sin(turn), near + lift * np.cos(turn)],
        axis=2,
    )
    down, right = np.gradient(points, axis=(0, 1))
    normals = np.cross(down, right)
    normals /= np.sqrt((normals * normals).sum(axis=2, keepdims=True)) + 1e-12
    axes = rotation_axes(shape.angle, shape.yaw, shape.pitch)
    render_mesh = points.reshape(-1, 3) @ axes.T
    render_mesh[:, :2] += shape.place
    return render_mesh, normals.reshape(-1, 3) @ axes.T


def _texture(random: Generator, colour: ArrayLike) -> NDArray[np.float32]:
    down, right = (np.arange(TALL) + 0.5) / TALL, (np.arange(WIDE) + 0.5) / WIDE * 2 - 1
    s, w = down[:, None], np.abs(right)[None]
    pairs, slope = random.uniform(6, 9), random.uniform(0.22, 0.34)
    phase = (s - slope * w * (1.1 - 0.5 * w)) * pairs + 0.12 * np.sign(right)
    phase = phase - np.floor(phase)
    vein = np.exp(-(((phase - 0.5) / 0.07) ** 2)) * (1 - 0.5 * w)
    main = np.exp(-((w / (0.075 - 0.04 * s)) ** 2))
    rough = fractal(random, TEXTURE_SIDE, 4, 64, 0.7)[:TALL, :WIDE]
    wide = fractal(random, TEXTURE_SIDE, 2, 4)[:TALL, :WIDE]
    ageing = np.clip(0.6 * wide + 0.5 * (w - 0.5) + random.uniform(-0.4, 0.1), 0, 1)[..., None]
    base = np.asarray(colour, np.float64)
    old = base * random.uniform(0.75, 1.05) + [-6.0, 4.0, 34.0]
    tone = 1 + 0.07 * rough + 0.10 * (phase - 0.5) + 0.05 * np.sign(right)
    leaf = (base * (1 - ageing) + old * ageing) * tone[..., None]
    pale = base * 0.55 + [70.0, 104.0, 96.0]
    ribs = np.clip(0.5 * vein + 0.85 * main, 0, 1)[..., None]
    leaf = leaf * (1 - ribs) + pale * ribs
    holes = random.uniform(0, 1, (int(random.integers(0, 6)), 2)) * [TALL, WIDE]
    for row, column in holes.tolist():
        disc = np.zeros((TALL, WIDE))
        cv2.circle(disc, (round(column), round(row)), int(random.integers(2, 5)), 1.0, -1)
        spot = np.asarray(cv2.GaussianBlur(disc, (0, 0), 1.0))[..., None]
        leaf = leaf * (1 - 0.7 * spot) + 0.7 * spot * np.array([30.0, 52.0, 84.0])
    return np.asarray((np.clip(leaf, 0, 255) / 255) ** 2, np.float32)


FRAMES = 100
SIZE = 320, 240
JUMP = 1  # first frame in the changed light; a gust moves the leaf in the same frame
FASTEST = 15.0  # speed of the leaf in the strongest of the other gusts [pixels/frame]
FIRST_GUST = 1.1, 1.3  # strength of the gust in the frame of the light change
CALM = 6  # minimum time from the light change to the next gust [frames]
LOW, HIGH = np.array([62.0, 58.0]), np.array([258.0, 182.0])  # bounds of the leaf's centre [pixels]


def sample_shapes(random: Generator) -> tuple[LeafShape, ...]:
    """Sample the pose and bending of the leaf in every frame."""
    gusts = _gusts(random)
    places = _places(random, gusts)
    angle = random.uniform(-np.pi, np.pi) + _shaken(random, gusts, 0.03, 0.26)
    yaw, pitch = (0.75 * np.tanh(_shaken(random, gusts, 0.045, 0.35)) for _ in range(2))
    bend = random.uniform(0.1, 0.5) + 0.6 * np.tanh(_shaken(random, gusts, 0.05, 0.3))
    fold = random.uniform(0.2, 0.35) + 0.15 * np.tanh(_shaken(random, gusts, 0.05, 0.4))
    return tuple(
        LeafShape(place, *values)
        for place, *values in zip(
            places, *(part.tolist() for part in (angle, yaw, pitch, bend, fold)), strict=True
        )
    )


def sample_sway(random: Generator) -> Array:
    """Sample the displacement of the front foliage in every frame [pixels], shape (FRAMES, 2)."""
    gusts = _gusts(random)
    sway = [2.5 * np.tanh(_shaken(random, gusts, 0.10, 0.35)) for _ in range(2)]
    return quantised(np.stack(sway, axis=1))


def _gusts(random: Generator) -> Array:
    """Return the strength of the gust that starts in each frame, up to 1.3, or 0."""
    gusts = np.zeros(FRAMES)
    gusts[JUMP] = random.uniform(*FIRST_GUST)
    frame = JUMP + CALM + int(random.integers(6))
    while frame < FRAMES:
        gusts[frame] = random.uniform(0.45, 1.0)
        frame += int(random.integers(6, 15))
    return gusts


def _places(random: Generator, gusts: Array) -> Array:
    """Return the path of the leaf, shape (FRAMES, 2): gusts push it, a spring pulls it back."""
    home = np.array([160.0, 120.0]) + random.uniform(-1, 1, 2) * [35, 20]
    place, speed = home + random.uniform(-8, 8, 2), random.normal(0, 0.8, 2)
    places = []
    for gust in gusts.tolist():
        direction = random.normal(size=2) + 0.012 * (home - place)
        push = direction / np.sqrt((direction * direction).sum())
        speed = 0.74 * speed + 0.03 * (home - place) + random.normal(0, 0.7, 2)
        speed = speed + gust * FASTEST * push
        speed *= min(1.0, FASTEST * max(1.0, gust) / float(np.sqrt((speed * speed).sum())))
        ahead = place + speed
        speed = np.where((ahead < LOW) | (ahead > HIGH), -0.5 * speed, speed)
        place = place + speed
        places.append(place)
    return quantised(np.array(places))


def _shaken(random: Generator, gusts: Array, restless: float, kick: float) -> Array:
    """Return damped oscillations about 0, excited slightly by noise and strongly by gusts."""
    value, speed, values = 0.0, 0.0, []
    for gust in gusts.tolist():
        speed = 0.8 * speed - 0.06 * value + random.normal(0, restless)
        speed += gust * kick * random.choice([-1, 1]) * random.uniform(0.4, 1.0)
        value += speed
        values.append(value)
    return np.array(values)


Floats = NDArray[np.float32]


@dataclass(frozen=True)
class LeafLight:
    """Ambient light of the sky, and light of the sun on facing surfaces, BGR; shapes (3,)."""

    sky: Array
    sun: Array


SUNSHINE = LeafLight(np.array([0.56, 0.64, 0.66]), np.array([0.60, 1.40, 1.90]))
CLOUD = LeafLight(np.array([0.40, 0.31, 0.22]), np.array([0.024, 0.056, 0.076]))
THROUGH = 0.35  # fraction of the sun's light that passes through a leaf
SUNLIGHT_SIDE = 512  # side of the periodic pattern of sun and shade [pixels]
# colours of the target leaf, BGR: yellower than the foliage, or brownish
COLOURS = ((52, 156, 148), (56, 138, 164), (58, 168, 124))
LONG = 76, 90  # minimum and maximum length of the leaf [pixels]
OPEN = 0.45  # minimum fraction of the sun's light that reaches the target leaf

# colours of the foliage, BGR
GREENS = (
    (44, 104, 62), (40, 88, 48), (56, 128, 84), (46, 118, 96), (38, 78, 50), (66, 138, 108),
    (62, 110, 66), (34, 96, 74),
)  # fmt: skip

FAR, NEAR = 190, 60  # number of leaves in the static layer, and in the swaying layer in front of it
MARGIN = 8  # margin of a foliage layer beyond the image on every side [pixels]
LAYER = SIZE[0] + 2 * MARGIN, SIZE[1] + 2 * MARGIN  # size of a layer [pixels]

# number of different leaves in a layer, and their fraction with nearly the target's colour
KINDS, SIMILAR_SHARE = 50, 0.15

GROUND = np.array([0.006, 0.010, 0.008])  # colour of the ground behind all leaves
LEAF_OFF, LEAF_SOFT = 9.0, 3.5  # offset and softness of a leaf's shadow in the foliage [pixels]
# fractions of the sky's and of the sun's light that a leaf removes from leaves below
SHADED = 0.35, 0.8


def incident_light(normals: Array, sun: Array, in_sun: Array) -> tuple[Array, Array]:
    """Return the light on vertices from the sky and from the sun, relative to a `LeafLight`.

    `normals`, shape (v, 3), are vertex normals. `sun`, shape (3,), is the direction to the sun.
    `in_sun`, shape (v,), is the fraction of the sun that is visible from each vertex.
    """
    facing = normals @ sun * np.sign(normals[:, 2])  # normal of the visible side
    lit = np.where(facing > 0, facing, -THROUGH * facing)
    return 0.75 + 0.25 * np.abs(normals[:, 2]), in_sun * lit


@dataclass(frozen=True)
class FoliageLayer:
    """Layer of leaves, once in sky light of 1 and once in sunlight of 1.

    Both sheets have the size `LAYER` and four channels: reflected light (BGR), premultiplied by the
    coverage, and the coverage.
    """

    around: Floats
    straight: Floats

    def lit(self, light: LeafLight) -> Floats:
        """Return the layer in a light, premultiplied by the coverage, shape (height, width, 4)."""
        sky, sun = np.append(light.sky, 1), np.append(light.sun, 0)
        return np.asarray(self.around * sky + self.straight * sun, np.float32)


# shadow of the leaf: offset [pixels], softness, darkness under cloud and in sunshine; see
# `remaining_light`
OFF, SOFTNESS, DARKNESS = 26.0, 5.0, (0.02, 0.6)
CAMERA = Camera(SIZE, noise=2.2, fall=(0.05, 0.05))


class LeafScene(SeededScene):
    """Scene of a leaf in front of other leaves."""

    label, length, size = "moreno2005/leaf", FRAMES, SIZE

    @cached_property
    def shapes(self) -> tuple[LeafShape, ...]:
        """Pose and bending of the target leaf in every frame."""
        return sample_shapes(self._random("wind"))

    @cached_property
    def sway(self) -> Array:
        return sample_sway(self._random("sway"))

    def points(self, frame: int) -> tuple[Array, Array]:
        """Return vertices and normals of the target leaf in a frame; see `place_blade`."""
        return place_blade(self._blade, self.shapes[frame])

    def light(self, frame: int) -> LeafLight:
        """Return the light in a frame; it changes at `JUMP`."""
        return CLOUD if frame >= JUMP else SUNSHINE

    def render_leaf(self, frame: int) -> RenderedMesh:
        """Render the target leaf in a frame."""
        points, normals = self.points(frame)
        in_sun = OPEN + (1 - OPEN) * self._visible_sun(points)
        around, straight = incident_light(normals, self.sun, in_sun)
        light = self.light(frame)
        lights = around[:, None] * light.sky + straight[:, None] * light.sun
        return render_mesh(self._blade.mesh, points, lights, SIZE)

    @cached_property
    def layers(self) -> tuple[FoliageLayer, FoliageLayer]:
        """Layers of static foliage, and of swaying foliage in front of the static layer."""
        return self._layer("still foliage", FAR, 1.0), self._layer("foliage that sways", NEAR, 0.4)

    def _layer(self, part: str, count: int, depth: float) -> FoliageLayer:
        """Render `count` overlapping leaves; with a larger `depth`, the lower leaves are darker.

        A layer of depth 1 has no gaps between leaves.
        """
        random = self._random(part)
        around, straight = (np.zeros((*LAYER[::-1], 4), np.float32) for _ in range(2))
        if depth == 1:
            around[..., :3], around[..., 3], straight[..., 3] = GROUND, 1, 1
        blades = [_sample_foliage_leaf(random, self._colour) for _ in range(KINDS)]
        for number in range(count):
            higher = 1 - depth * (1 - number / count)
            blade = blades[int(random.integers(KINDS))]
            points, normals = place_blade(blade, _sample_foliage_shape(random))
            in_sun = self._visible_sun(points - [MARGIN, MARGIN, 0]) * (0.1 + 0.9 * higher)
            sky, direct = incident_light(normals, self.sun, in_sun)
            leaves = [
                render_mesh(blade.mesh, points, np.repeat(light[:, None], 3, axis=1), LAYER)
                for light in (sky * (0.25 + 0.75 * higher), direct)
            ]
            coverage = leaves[0].coverage(LAYER)
            for sheet, leaf, darkness in zip((around, straight), leaves, SHADED, strict=True):
                sheet[..., :3] *= remaining_light(
                    coverage, -LEAF_OFF * self.sun[:2], LEAF_SOFT, darkness
                )
                composite(sheet[leaf.window], leaf.sheet)
        return FoliageLayer(around, straight)

    def _visible_sun(self, points: Array) -> Array:
        """Return the fraction of sunlight, in [0, 1], that passes the leaves above the image."""
        columns, rows = np.round(points[:, :2].T).astype(np.int64) % SUNLIGHT_SIDE
        return np.asarray(self._dapples[rows, columns])

    @cached_property
    def sun(self) -> Array:
        """Direction to the sun, shape (3,): above, sideways, towards the camera."""
        random = self._random("sun")
        sun = np.array([random.choice([-1, 1]) * random.uniform(0.3, 0.6), -0.6, 0.65])
        return np.asarray(sun / np.sqrt((sun * sun).sum()))

    @cached_property
    def _colour(self) -> Array:
        return sample_colour(self._random("colour"), COLOURS)

    @cached_property
    def _blade(self) -> Blade:
        random = self._random("leaf")
        return sample_blade(random, random.uniform(*LONG), self._colour)

    @cached_property
    def _dapples(self) -> Array:
        return smooth_step(fractal(self._random("dapples"), SUNLIGHT_SIDE, 8, 32, 0.6), -0.55, 0.45)

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        Boxes contain the whole leaf with its stalk, which is never occluded. The attribute `light
        change` is True in the first frame under the cloud.
        """
        boxes = np.stack([bounding_box(self.points(frame)[0]) for frame in range(FRAMES)])
        change = np.arange(FRAMES) == JUMP
        return SceneTruth(boxes, np.ones(FRAMES), {"light change": change})

    def render(self, frame: int) -> Image:
        light = self.light(frame)
        still, swaying = self._foliage[light is SUNSHINE]
        shift = self.sway[frame] - MARGIN
        moved = cv2.warpAffine(swaying, np.column_stack([np.eye(2), shift]), SIZE)
        picture = still.copy()
        composite(picture, np.asarray(moved, np.float32))
        leaf = self.render_leaf(frame)
        off = -OFF * self.sun[:2] / self.sun[2]
        left = remaining_light(leaf.coverage(SIZE), off, SOFTNESS, DARKNESS[light is SUNSHINE])
        picture = np.asarray(cv2.multiply(picture, left), np.float32)
        composite(picture[leaf.window], leaf.sheet)
        return CAMERA.exposed(develop_light(picture), self._seed, frame)

    def mask(self, frame: int) -> Mask:
        return np.asarray(self.render_leaf(frame).coverage(SIZE) >= 0.5)

    @cached_property
    def _foliage(self) -> tuple[tuple[Floats, Floats], ...]:
        """Images of the static and of the swaying foliage, under the cloud and in sunshine."""
        still, swaying = self.layers
        inner = (slice(MARGIN, -MARGIN),) * 2
        return tuple(
            (np.ascontiguousarray(still.lit(light)[inner][..., :3]), swaying.lit(light))
            for light in (CLOUD, SUNSHINE)
        )


def _sample_foliage_leaf(random: Generator, target: Array) -> Blade:
    """Sample a leaf of the foliage; some leaves have nearly the colour of the `target`, BGR."""
    colour = sample_colour(random, GREENS)
    if random.random() < SIMILAR_SHARE:
        share = random.uniform(0.5, 0.9)
        colour = (1 - share) * colour + share * vary_colour(random, target)
    return sample_blade(random, random.uniform(40, 76), colour)


def _sample_foliage_shape(random: Generator) -> LeafShape:
    return LeafShape(
        random.uniform(-10, 10, 2) + random.uniform(0, 1, 2) * LAYER,
        random.uniform(-np.pi, np.pi),
        random.uniform(-0.8, 0.8),
        random.uniform(-0.8, 0.8),
        random.uniform(-0.3, 1.0),
        random.uniform(0.1, 0.5),
    )
