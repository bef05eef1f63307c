"""`nguyen2002/clip-01` to `clip-20`: clips of an action film.

The paper uses 20 clips of an action film, with 150 frames on average and 21 complete occlusions in
total. The light hardly changes abruptly. All other properties are our choice: rigid targets with
printed marks and windows, six settings, the motion of the camera, the occluders, film grain, slow
changes of exposure, and the low resolution of colour.
"""

from dataclasses import replace
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Image, Mask
from trackmark.datasets.synthetic.nguyen2002.film.occluders import OCCLUDERS
from trackmark.datasets.synthetic.nguyen2002.film.plan import EXPOSURE, SIZE, clip_plan
from trackmark.datasets.synthetic.nguyen2002.film.props import CARRIERS, paint_carrier, paint_shadow
from trackmark.datasets.synthetic.nguyen2002.film.setting import SETTINGS, Place
from trackmark.datasets.synthetic.nguyen2002.film.sheet import UNIT, RigidObject
from trackmark.datasets.synthetic.nguyen2002.film.targets import KINDS, paint_target, two_looks
from trackmark.datasets.synthetic.nguyen2002.knobs import FilmKnobs
from trackmark.datasets.synthetic.render.camera import Camera, random_bytes
from trackmark.datasets.synthetic.render.sprite import Sprite, instants
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.scene import SceneTruth, SyntheticScene, part_generator

Array = NDArray[np.float64]

# standard deviations of the film's grain: of brightness, and of either colour difference at the
# resolution of colour [grey levels]
GRAIN, DYES = 2.6, 2.5
CAMERA = Camera(SIZE, noise=1.6, fall=(0.10, 0.12))
COARSE = SIZE[0] // 2, SIZE[1] // 2  # resolution of colour
PRINTS = 0.65, 1.1  # range of the light of a clip, from dusk to noon
# saturation of a print relative to the scene's; film of that time is often bleached
SATURATION = 0.3, 0.5
SHADOW = 0.55  # darkness of a shadow on the ground, in its centre
WHOLE = 0.99  # minimum visibility at which the target counts as not occluded


def scene(knobs: FilmKnobs, clip: int) -> "FilmScene":
    """Return the renderer and ground truth of a clip with `number` 1 to 20, without rendering."""
    return _scene(knobs.scene, clip)


class FilmScene(SyntheticScene):
    """Clip `number`, from 1, of the set with a seed."""

    size = SIZE

    def __init__(self, seed: int, clip: int) -> None:
        self._seed = seed
        self._clip = clip
        self.plan = clip_plan(seed, clip)
        self.length = self.plan.shot.frames

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        Boxes have the position and scale of the target, but ignore its slight rotation. Attributes
        are `occluded` (less than half of the target is visible) and `partly occluded` (half of the
        target or more is visible, but not all of it).
        """
        return _truth(self._seed, self._clip)

    def render(self, frame: int) -> Image:
        plan = self.plan
        canvas = np.empty((SIZE[1], SIZE[0], 3), np.uint8)
        x, nod = float(plan.travel[frame]), float(plan.nod[frame])
        travel = EXPOSURE * float(np.gradient(plan.travel)[frame])
        self._place.draw(canvas, replace(plan.still, x=x, shift_y=nod), travel)
        places = _places(plan.centre, frame)
        pose = float(plan.scale[frame]), float(plan.angle[frame])
        if self._shadow is not None:
            ground = np.column_stack([places[:, 0], np.full(len(places), plan.ground[frame])])
            self._shadow.draw(canvas, ground, pose[0], 0.0)
        self._carrier.draw(canvas, places, *pose)
        self._target.draw(canvas, places, *pose, float(plan.look[frame]))
        for passage, (sprite, offset) in zip(plan.passages, self._occluders, strict=True):
            sprite.draw(canvas, _places(passage.path, frame) + offset, 1.0)
        return self._develop(canvas, frame)

    def mask(self, frame: int) -> Mask:
        return np.asarray(self.seen(frame)[1] >= 128)

    def seen(self, frame: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return the target's coverage of each pixel, whole and visible part, in [0, 255]."""
        plan = self.plan
        whole = self._target.coverage(
            SIZE, plan.centre[frame], float(plan.scale[frame]), float(plan.angle[frame])
        )
        visible = np.repeat(whole[..., None], 3, axis=2)
        for passage, (sprite, offset) in zip(plan.passages, self._silhouettes, strict=True):
            sprite.draw(visible, passage.path[frame][None] + offset, 1.0)
        return whole, visible[..., 0]

    def _develop(self, canvas: Image, frame: int) -> Image:
        """Apply grading, exposure, grain and a low resolution of colour to an image."""
        canvas = np.asarray(cv2.LUT(canvas, self._grading), np.uint8)
        canvas = np.asarray(cv2.transform(canvas, self._bleaching), np.uint8)
        number = 1000 * self._clip + frame
        CAMERA.exposed(canvas, self._seed, number, self.plan.gain[frame])
        places = random_bytes(self._seed, number, 6, canvas.size).astype(int).reshape(3, 2)
        luma, *chroma = cv2.split(cv2.cvtColor(canvas, cv2.COLOR_BGR2YCrCb))
        planes = [cv2.add(luma, _cut(self._grain, places[0], SIZE), dtype=cv2.CV_8U)]
        for plane, place in zip(chroma, places[1:], strict=True):
            coarse = cv2.resize(plane, COARSE, interpolation=cv2.INTER_AREA)
            grained = cv2.add(coarse, _cut(self._dyes, place, COARSE), dtype=cv2.CV_8U)
            planes.append(cv2.resize(grained, SIZE))
        picture = cv2.cvtColor(cv2.merge(planes), cv2.COLOR_YCrCb2BGR)
        return np.asarray(picture, np.uint8)

    @cached_property
    def _place(self) -> Place:
        plan = self.plan
        return Place(
            self._random("place"),
            SETTINGS[plan.shot.setting],
            plan.still,
            SIZE,
            float(plan.travel.max()),
            float(np.abs(plan.nod).max()),
        )

    @cached_property
    def _target(self) -> RigidObject:
        random, size = self._random("target"), self._largest
        colour, coverage = paint_target(random, KINDS[self.plan.shot.target], *size).reduced()
        return RigidObject(two_looks(random, colour), coverage, size[0] / self.plan.size[0])

    @cached_property
    def _carrier(self) -> RigidObject:
        kind, size = KINDS[self.plan.shot.target].carrier, self._largest
        colour, coverage = paint_carrier(self._random("carrier"), kind, *size).reduced()
        return RigidObject([colour], coverage, size[0] / self.plan.size[0])

    @cached_property
    def _shadow(self) -> RigidObject | None:
        """Shadow on the ground or reflection in the water; None if the ground is not visible."""
        width = CARRIERS[KINDS[self.plan.shot.target].carrier].shadow * self._largest[0]
        if not width:
            return None
        colour, coverage = paint_shadow(width, SHADOW)
        return RigidObject([colour], coverage, self._largest[0] / self.plan.size[0])

    @cached_property
    def _occluders(self) -> list[tuple[Sprite, Array]]:
        """Sprites of the occluders, with the offset of each centre from its anchor [pixels]."""
        hiders = []
        for number, passage in enumerate(self.plan.passages):
            random, size = self._random(f"hider {number}"), np.array(passage.size) / UNIT
            sheet = OCCLUDERS[passage.kind].paint(random, *size.tolist())
            sprite = Sprite(*sheet.reduced())
            middle = np.array([sprite.width, sprite.height]) / 2
            hiders.append((sprite, middle - np.array(sheet.anchor) * UNIT))
        return hiders

    @cached_property
    def _silhouettes(self) -> list[tuple[Sprite, Array]]:
        return [(sprite.silhouette(0), offset) for sprite, offset in self._occluders]

    @cached_property
    def _grain(self) -> NDArray[np.int16]:
        """Grain of brightness, larger than the image by the maximum random shift."""
        return _shiftable(fractal(self._random("grain"), 512, 128, 256, 1.0), GRAIN)

    @cached_property
    def _dyes(self) -> NDArray[np.int16]:
        """Grain of the two colour differences, at the resolution of colour."""
        return _shiftable(fractal(self._random("dyes"), 512, 128, 256, 1.0), DYES)

    @cached_property
    def _grading(self) -> NDArray[np.uint8]:
        """Lookup table of grey levels per channel: light, contrast and tint of the clip."""
        random = self._random("grading")
        level = np.linspace(0, 1, 256)[:, None]
        contrast = random.uniform(0.0, 0.9)
        curve = level + contrast * level * (1 - level) * (2 * level - 1)
        tint = 1 + random.uniform(-0.07, 0.07, 3)
        graded = 255 * random.uniform(*PRINTS) * tint * curve
        return np.asarray(np.clip(np.round(graded), 0, 255), np.uint8)[None]

    @cached_property
    def _bleaching(self) -> Array:
        """Matrix, shape (3, 3), that mixes the channels to reduce the saturation."""
        saturation = self._random("saturation").uniform(*SATURATION)
        return np.asarray(
            saturation * np.eye(3) + (1 - saturation) * np.array([0.114, 0.587, 0.299])
        )

    @property
    def _largest(self) -> tuple[float, float]:
        """Maximum width and height of the target over all frames [whole pixels]."""
        width, height = (np.ceil(side * self.plan.scale.max()) for side in self.plan.size)
        return float(width), float(height)

    def _random(self, part: str) -> np.random.Generator:
        return part_generator(self._seed, f"nguyen2002/clip-{self._clip:02} {part}")


def _shiftable(grain: Array, deviation: float) -> NDArray[np.int16]:
    """Return grain that is 255 pixels larger than the image, with a standard deviation."""
    wide = np.tile(grain, (1, 2))[:, : SIZE[0] + 256]
    return np.asarray(np.round(wide * (deviation / grain.std())), np.int16)


def _cut(
    grain: NDArray[np.int16], place: NDArray[np.int_], size: tuple[int, int]
) -> NDArray[np.int16]:
    """Return the part of a grain with a width and height that starts at a row and column."""
    row, column = place.tolist()
    return grain[row : row + size[1], column : column + size[0]]


def _places(path: Array, frame: int) -> Array:
    """Return the positions at the times that represent the exposure of a frame."""
    before, after = path[max(frame - 1, 0)], path[min(frame + 1, len(path) - 1)]
    step = EXPOSURE * (after - before) / (min(frame + 1, len(path) - 1) - max(frame - 1, 0))
    return np.asarray(path[frame] + instants(float(np.abs(step).max()))[:, None] * step)


@lru_cache(maxsize=8)
def _scene(seed: int, clip: int) -> FilmScene:
    """Return a cached clip, so that rendering reuses objects painted for the ground truth."""
    return FilmScene(seed, clip)


@lru_cache(maxsize=32)
def _truth(seed: int, clip: int) -> SceneTruth:
    scene = _scene(seed, clip)
    boxes, visibility = scene.plan.boxes, np.ones(len(scene))
    near = np.zeros(len(scene), np.bool_)
    middles = boxes[:, 0] + boxes[:, 2] / 2
    for passage in scene.plan.passages:
        reach = (boxes[:, 2] + passage.size[0]) / 2 + 40
        near |= np.abs(passage.path[:, 0] - middles) < reach
    for frame in np.flatnonzero(near).tolist():
        whole, visible = scene.seen(frame)
        visibility[frame] = visible.sum(dtype=np.int64) / whole.sum(dtype=np.int64)
    hidden = visibility < 0.5
    return SceneTruth(
        boxes, visibility, {"occluded": hidden, "partly occluded": ~hidden & (visibility < WHOLE)}
    )
