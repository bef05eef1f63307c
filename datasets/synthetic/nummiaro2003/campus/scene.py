"""Scenes in which a person enters and leaves the image: surroundings, people, ground truth."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from trackmark.datasets.interface import Array
from trackmark.datasets.synthetic.multipart import casting
from trackmark.datasets.synthetic.multipart.plan import Person, WalkPlan, body_boxes
from trackmark.datasets.synthetic.multipart.scene import WalkingScene
from trackmark.datasets.synthetic.multipart.walker import WalkerLook
from trackmark.datasets.synthetic.render.attributes import rescaled
from trackmark.datasets.synthetic.render.colours import BGR
from trackmark.datasets.synthetic.render.path import random_positions, smooth_step
from trackmark.datasets.synthetic.render.prop import Coverage, Prop
from trackmark.datasets.synthetic.render.street.furniture import car
from trackmark.datasets.synthetic.render.street.ground import SIDE, Band, Light, asphalt, kerbstones
from trackmark.datasets.synthetic.render.street.street import HOUSES, Reach, Street
from trackmark.datasets.synthetic.render.texture import fractal, grass, paving, ramp
from trackmark.datasets.synthetic.render.views import SIZE, Viewpoint, Views, WalkingPath
from trackmark.datasets.synthetic.scene import SceneTruth

BAYS = 13.1, 15.4  # depth of the parking bays [metres from the camera]
DOORSTEP = HOUSES - 1.2  # front of the porch [metres from the camera]
# distance before and behind the porch's front over which the light falls [metres]
THRESHOLD = 0.4
LAWN = 7.9  # near edge of the asphalt [metres from the camera]
KEPT_FREE = 1.3  # free width on both sides of the entrance's centre [metres]
REACH = 16.0  # maximum visible distance from the entrance [metres]
INSIDE = 0.55  # fraction of light that the porch removes


class CarPark(Street):
    """Street of asphalt with parking bays in front of houses.

    The scene adds its objects, `parked_cars` and `entrance`, as obstacles.
    """

    @cached_property
    def props(self) -> list[Prop]:
        """Objects that cannot occlude the target: none."""
        return []

    def gains(self, x: ArrayLike, z: ArrayLike, heights: ArrayLike) -> Array:
        """See `Street.gains`; inside the porch, the light is reduced by INSIDE."""
        inside = smooth_step(np.array(z), DOORSTEP - THRESHOLD, DOORSTEP + THRESHOLD)
        return super().gains(x, z, heights) * (1 - INSIDE * inside)

    def _bands(self, random: Generator) -> list[Band]:
        road = asphalt(random, (96.0, 96.0, 98.0), 0.07)
        paint, kerb = road * 0.3 + 150, kerbstones(random)
        stones = paving(random, SIDE)
        mean_stone = stones.mean(axis=(0, 1))
        near, far = BAYS
        return [
            Band(0.0, grass(random, SIDE), 3.0),
            Band(LAWN - 0.15, kerb, 4.0),
            Band(LAWN, road, 3.0),
            Band(near - 0.12, paint, 3.0),
            Band(near, road, 3.0),
            Band(far, kerb, 4.0),
            Band(far + 0.15, (mean_stone + 0.6 * (stones - mean_stone)) * 1.1, 2.6),
        ]


def parked_cars(random: Generator, camera: Viewpoint, door: float) -> list[Prop]:
    """Sample a row of cars that leaves a gap in front of a door; `door` is as in `entrance`."""
    z = sum(BAYS) / 2
    cars = []
    for side in (-1, 1):
        for x in random_positions(random, KEPT_FREE + random.uniform(2.5, 2.9), REACH, (5.1, 5.8)):
            parked_car = car(random, door + side * x, z, float(camera.scale(z)))
            if random.random() < 0.85:
                cars.append(parked_car)
    return cars


def entrance(random: Generator, camera: Viewpoint, door: float) -> list[Prop]:
    """Return the porch of a house; `door` is the lateral position of its centre [metres]."""
    front, back = DOORSTEP, HOUSES - 0.01
    return porch(
        random, door, (front, float(camera.scale(front))), (back, float(camera.scale(back)))
    )


OPENING = 1.7, 2.35  # width and height of the porch's opening [metres]
BESIDE = 1.0  # width of the walls on both sides of the opening [metres]
PORCH = 3.0  # height of the porch with its roof [metres]
PLASTER = ((150, 158, 160), (92, 104, 148), (196, 204, 208), (120, 128, 132))


def porch(
    random: Generator, x: float, front: tuple[float, float], back: tuple[float, float]
) -> list[Prop]:
    """Return the two parts of a porch: its front with the opening, and its interior.

    `x` is the opening's centre [metres]. `front` and `back` each contain a depth [metres] and the
    scale at that depth [pixels/metre].
    """
    paint = np.array(PLASTER[random.integers(len(PLASTER))]) * random.uniform(0.85, 1.05)
    grain = fractal(random, 256, 16, 128, 0.8)
    return [_front(x, *front, paint, grain), _inside(x, *back, paint)]


def _front(x: float, z: float, scale: float, paint: Array, grain: Array) -> Prop:
    across, up = _raster(OPENING[0] + 2 * BESIDE, PORCH, scale)
    outside = np.maximum(np.abs(across) - OPENING[0] / 2, up - OPENING[1])
    cover = np.clip(outside * scale + 0.5, 0, 1)
    tone = 1 + 0.07 * grain[: len(up), : across.shape[1]]
    tone = tone * np.where(up > PORCH - 0.3, 0.62, 1) * np.where(outside < 0.09, 0.6, 1)
    tone = tone * np.where((up > PORCH - 0.42) & (up <= PORCH - 0.3), 0.75, 1)
    return Prop(x, z, paint * tone[..., None], cover, len(up))


def _inside(x: float, z: float, scale: float, paint: Array) -> Prop:
    across, up = _raster(OPENING[0] + 2 * BESIDE, PORCH, scale)
    glass = np.array([66.0, 62.0, 56.0]) * (0.55 + 0.16 * np.clip(up, 0, 2.4))[..., None]
    frame = (np.abs(np.abs(across) - 0.42) > 0.37) | (np.abs(up - 1.05) < 0.04) | (up > 2.3)
    colour = np.where(frame[..., None], paint * 0.34, glass)
    return Prop(x, z, colour, np.ones(up.shape), len(up))


def _raster(width: float, height: float, scale: float) -> tuple[Array, Array]:
    """Return the position of every pixel: right of the centre and above the ground [metres]."""
    rows, columns = round(height * scale), round(width * scale)
    y, x = np.indices((rows, columns)) + 0.5
    return (x - columns / 2) / scale, (rows - y) / scale


TALL = 5.2  # painted height of a tree, which exceeds the upper image border [metres]
LEAVES = 3.1  # approximate lower end of hanging twigs [metres]
SPREAD = 2.1  # reach of the twigs on either side of the trunk [metres]
LEAF = 110  # scale of the texture [pixels/metre]
BARK_TONES: tuple[BGR, ...] = (
    (92, 108, 114),  # grey
    (36, 44, 50),  # dark
    (150, 162, 166),  # pale
    (66, 104, 92),  # mossy
    (58, 86, 124),  # reddish
    (200, 206, 208),  # birch
)
# light factors of bark, from the grooves to the ridges
BARK_RELIEF = np.array([0.60, 0.84, 1.10, 1.34])[:, None]
GREENS = np.array([[22, 46, 34], [36, 82, 60], [56, 118, 92], [92, 156, 138]], np.float64)


def old_tree(
    random: Generator, place: tuple[float, float], scale: float, width: float, unlike: Sequence[BGR]
) -> list[Prop]:
    """Return the two parts of a tree: a trunk that occludes people, and twigs in front of it.

    `place` is the position (x, z) [metres], `scale` the scale there [pixels/metre], and `width` the
    width of the trunk at the height of people [pixels]. The bark has the tone that differs most
    from the colours `unlike`.
    """
    tone = max(BARK_TONES, key=lambda tone: _least_difference(tone, unlike))
    x, z = place
    return [_trunk(random, x, z, scale, width, tone), _twigs(random, x, z - 0.01, scale, width)]


def _least_difference(colour: BGR, others: Sequence[BGR]) -> float:
    return min(float(np.abs(np.subtract(colour, other)).max()) for other in others)


def _trunk(random: Generator, x: float, z: float, scale: float, width: float, tone: BGR) -> Prop:
    rows, columns = round(TALL * scale), round(1.5 * width)
    y, right = np.indices((rows, columns)) + 0.5
    up = (rows - y) / scale
    # The trunk widens towards the roots, and slightly towards the crown.
    half = width / 2 * (1 + 0.35 * np.exp(-up / 0.11) + 0.05 * np.clip(up - 2, 0, 3))
    across = (right - columns / 2) / half
    cover = np.clip((1 - np.abs(across)) * half + 0.5, 0, 1)
    light = (0.62 + 0.42 * np.sqrt(np.clip(1 - across * across, 0, 1))) * (1 - 0.16 * across)
    bark = fractal(random, SIDE, 8, 256, 0.8)
    tall, wide = (np.floor(v).astype(np.int64) % SIDE for v in (y * 0.9, right * 2.2))
    colour = (
        ramp(bark[tall, wide], np.array(tone) * BARK_RELIEF) * np.clip(light, 0.2, 1.1)[..., None]
    )
    return Prop(x, z, colour, cover, rows)


def _twigs(random: Generator, x: float, z: float, scale: float, width: float) -> Prop:
    low = LEAVES - 0.5
    rows, columns = round((TALL - low) * scale), round(width + 2 * SPREAD * scale)
    y, right = np.indices((rows, columns)) + 0.5
    up = TALL - y / scale
    crown, grain = fractal(random, SIDE, 4, 64, 0.7), fractal(random, SIDE, 64, 256, 0.95)
    place = tuple(np.floor(v * (LEAF / scale)).astype(np.int64) % SIDE for v in (y, right))
    thin = np.abs(2 * right / columns - 1) ** 3
    dense = (up - LEAVES) * 2.2 - 0.6 - 4 * thin + 0.55 * crown[place] + 0.45 * grain[place]
    tone = ramp(0.7 * grain[place] + 0.35 * crown[place], GREENS)
    return Prop(x, z, tone, np.clip(dense * 6, 0, 1), TALL * scale)


UNLIKE = 40  # minimum difference in one channel of clearly different colours [grey levels]


def sample_target(random: Generator, path: WalkingPath) -> Person:
    """Sample a person without a bag whose shirt and trousers differ clearly in colour."""
    return casting.sample_person(random, path, casting.sample_street_clothes(random))


def sample_bystander(random: Generator, path: WalkingPath, other: WalkerLook) -> Person:
    """Sample a person whose colours differ clearly from those of `other`; half carry a bag."""
    other_clothes = other.shirt, other.trousers
    clothes = casting.sample_other_clothes(random, other_clothes)
    bag = casting.sample_bag(random) if random.random() < 0.5 else None
    while bag is not None and any(
        np.abs(np.subtract(bag, c)).max() < UNLIKE for c in other_clothes
    ):
        bag = casting.sample_bag(random)
    return casting.sample_person(random, path, clothes, bag=bag)


class VisitPlan(WalkPlan):
    """Plan of a scene in which the target is present only during the frames `visit`.

    The first of the `people` is the target. `present`, shape (n,), is True in the frames of `visit`
    in which the target's box overlaps the image. `obstacles` are the objects that can occlude the
    target; `surroundings` is the class that renders the street.
    """

    def __init__(
        self,
        seed: int,
        views: Views,
        people: Sequence[Person],
        visit: slice,
        obstacles: Sequence[Prop] = (),
        surroundings: type[Street] = Street,
    ) -> None:
        super().__init__(seed, views, people)
        self._obstacles = obstacles
        self._surroundings = surroundings
        low, size = np.split(body_boxes(*self.places[0].T), 2, axis=1)
        self.present: NDArray[np.bool_] = np.zeros(len(self), np.bool_)
        self.present[visit] = np.all((low < SIZE) & (low + size > 0), axis=1)[visit]

    def street(self, light: Light) -> Street:
        return self._surroundings(self.seed, SIZE, self.views.still, Reach(), light)

    @cached_property
    def posts(self) -> list[Prop]:
        """Objects that can occlude the target."""
        return list(self._obstacles)

    def in_picture(self, frame: int) -> list[int]:
        """See `WalkPlan.in_picture`; an absent target is excluded."""
        return [person for person in super().in_picture(frame) if person or self.present[frame]]

    def seen(self, frame: int) -> Coverage:
        """See `WalkPlan.seen`; the silhouette of an absent target is empty."""
        left, top, alpha = super().seen(frame)
        return left, top, alpha if self.present[frame] else np.zeros_like(alpha)


class VisitScene(WalkingScene):
    """Scene that the target enters and leaves."""

    plan: VisitPlan

    def truth(self) -> SceneTruth:
        """Return the ground truth.

        While the target is absent, boxes are NaN and attributes are False. The attribute
        `scale_change` compares with the first frame in which the target is present. For the other
        attributes see `WalkingScene`.
        """
        truth, present = super().truth(), self.plan.present
        changed = rescaled(self.plan.places[0, :, 2], int(present.argmax()))
        attributes = {**truth.attributes, "scale_change": changed}
        gone = np.where(present, 1.0, np.nan)[:, None]
        return replace(
            truth,
            boxes=truth.boxes * gone,
            attributes={key: flags & present for key, flags in attributes.items()},
            regions={key: boxes * gone for key, boxes in truth.regions.items()},
        )
