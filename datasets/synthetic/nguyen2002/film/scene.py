"""`nguyen2002/clip-01` to `clip-20`: clips of an action film.

The paper uses 20 clips of an action film, with 150 frames on average and 21 complete occlusions in
total. The light hardly changes abruptly. All other properties are our choice: rigid targets with
printed marks and windows, six settings, the motion of the camera, the occluders, film grain, slow
changes of exposure, and chroma subsampling.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image, Mask
from trackmark.datasets.synthetic.nguyen2002.film import objects
from trackmark.datasets.synthetic.nguyen2002.film.setting import SETTINGS, Surroundings
from trackmark.datasets.synthetic.nguyen2002.film.targets import KINDS, paint_target, two_textures
from trackmark.datasets.synthetic.parameters import SceneParameters
from trackmark.datasets.synthetic.render.camera import Camera, random_bytes
from trackmark.datasets.synthetic.render.path import quantised
from trackmark.datasets.synthetic.render.sprite import Sprite, instants
from trackmark.datasets.synthetic.render.texture import fractal
from trackmark.datasets.synthetic.render.views import Viewpoint, random_wander
from trackmark.datasets.synthetic.scene import SceneTruth, SeededScene, part_generator

SIZE = 320, 240
EXPOSURE = 0.5  # fraction of the frame time for which the shutter is open
NEAR = 45.0  # scale at the depth of the target [pixels/metre]
EYE = 1.6  # height of the camera above the ground [metres]
FASTEST = 5.0  # maximum speed of the camera, measured at the depth of the target [pixels/frame]
# maximum speed of the target in the image, horizontal and vertical, as the camera follows
# [pixels/frame]
DRIFT = 3.0

CLIPS = 20
# complete occlusions per clip: 21 in 20 clips, as in the paper; their distribution is our choice
OCCLUSIONS = (0,) * 5 + (1,) * 10 + (2,) * 4 + (3,)
MEAN_FRAMES = 150  # mean number of frames per clip, as in the paper
SHORTEST, LONGEST = 110, 190
PARTIAL = 8  # number of clips with an object that occludes only a part of the target
# minimum number of frames before the first, between consecutive, and after the last occluder
LEAD, GAP, END = 16, 12, 20
WIDTHS = 2.1, 3.0  # range of the width of objects that occlude the whole target [target widths]
SPEEDS = 0.08, 0.15  # range of the speed of occluders in the image [target widths/frame]
# Maximum number of frames in which more than a quarter of the target is occluded. In the paper, an
# occlusion has at most L frames. Its list of frames to test for the end of an occlusion ends at 35.
LONGEST_OCCLUSION = 33


@dataclass(frozen=True)
class Shot:
    """Setting, target and number of occlusions of a clip."""

    frames: int
    setting: str  # name in `SETTINGS`
    target: str  # name in `KINDS`
    occlusions: int  # number of complete occlusions
    partial: bool  # True if one more object occludes a part of the target


@lru_cache(maxsize=4)
def clip_script(seed: int) -> tuple[Shot, ...]:
    """Return setting, target and number of occlusions of each clip of a set."""
    random = part_generator(seed, "nguyen2002/clip script")
    occlusions = random.permutation(OCCLUSIONS)
    frames = _lengths(random, occlusions)
    settings = random.permutation([list(SETTINGS)[k % len(SETTINGS)] for k in range(CLIPS)])
    calm = random.permutation(np.flatnonzero(occlusions < 2))[:PARTIAL]
    # About half of the targets in every setting are ellipses.
    turn = {name: int(random.integers(2)) for name in SETTINGS}
    shots = []
    for clip in range(CLIPS):
        setting = str(settings[clip])
        turn[setting] += 1
        is_round = turn[setting] % 2 == 0
        kinds = [kind for kind in SETTINGS[setting].targets if KINDS[kind].round == is_round]
        target = kinds[int(random.integers(len(kinds)))]
        shots.append(Shot(int(frames[clip]), setting, target, int(occlusions[clip]), clip in calm))
    return tuple(shots)


def _lengths(
    random: Generator, occlusions: np.ndarray[tuple[int], np.dtype[np.int64]]
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the number of frames of each clip, with the mean of the paper."""
    least = np.array([SHORTEST, SHORTEST, 140, 175])[occlusions]
    frames = random.integers(least, LONGEST + 1)
    # Lengthen or shorten random clips until the mean is the paper's.
    while (excess := int(frames.sum()) - CLIPS * MEAN_FRAMES) != 0:
        clip = int(random.integers(CLIPS))
        frames[clip] = np.clip(frames[clip] - np.sign(excess), least[clip], LONGEST)
    return frames


@dataclass(frozen=True)
class Passage:
    """Object that passes in front of the target, and its path."""

    kind: str  # name in `objects.OCCLUDERS`
    size: tuple[float, float]  # width and height of the object [pixels]
    path: Array  # (frames, 2): positions of its anchor [pixels]


@dataclass(frozen=True)
class ClipPlan:
    """Plan of a clip; nothing is painted yet."""

    shot: Shot
    size: tuple[float, float]  # width and height of the target at scale 1 [pixels]
    centre: Array  # (frames, 2): position of the target [pixels]
    scale: Array  # (frames,): scale of the target
    angle: Array  # (frames,): clockwise rotation of the target [radians]
    mixture: Array  # (frames,): share of the second of the target's two textures, in [0, 1]
    still: Viewpoint  # the camera at the left end of its path
    travel: Array  # (frames,): travel of the camera along its path [metres]
    nod: Array  # (frames,): vertical shift of the image by the camera, downwards [pixels]
    ground: Array  # (frames,): row of the ground below the target [pixels]
    gain: Array  # (frames,): gain of the exposure
    passages: tuple[Passage, ...]  # occluders in order of time

    @property
    def boxes(self) -> Array:
        """Boxes around the untilted target, shape (frames, 4) [pixels]."""
        sides = self.scale[:, None] * self.size
        return np.concatenate([self.centre - sides / 2, sides], axis=1)


@lru_cache(maxsize=32)
def clip_plan(seed: int, clip: int) -> ClipPlan:
    """Return the plan of a clip of a set; `clip` counts from 1."""
    shot = clip_script(seed)[clip - 1]
    n = shot.frames
    random = part_generator(seed, f"nguyen2002/clip-{clip:02} plan")
    width = float(random.uniform(50, 70))
    size = width, float(np.clip(width * random.uniform(1.05, 1.35), 60, 85))
    scale = np.exp(_swinging(random, n, (3.0, 9.0), np.log(1 + random.uniform(0.05, 0.16))))
    angle = _swinging(random, n, (1.5, 6.0), np.radians(random.uniform(1.0, 3.5)))
    mixture = 0.5 + _swinging(random, n, (4.0, 12.0), 0.5)
    across = SIZE[0] / 2 + _drifting(random, n, (3.0, 9.0), random.uniform(25, 75))
    still = Viewpoint(700.0, EYE, float(random.uniform(86, 104)), SIZE[0] / 2)
    tilt = _drifting(random, n, (2.0, 7.0), random.uniform(4, 12))
    nod = quantised(tilt + random_wander(random, n, (0.5, 3.0), random.uniform(0.2, 1.4)))
    ground = still.horizon + nod + EYE * NEAR * scale
    drop = objects.CARRIERS[KINDS[shot.target].carrier].drop
    level = ground - drop * size[1] * scale if drop else still.horizon + nod + 26
    centre = np.stack([across, level], axis=1)
    centre += random_wander(random, n, (0.3, 0.9), random.uniform(0.1, 0.5))[:, None] * [0.3, 0.6]
    gain = 1 + _swinging(random, n, (2.0, 8.0), random.uniform(0.03, 0.10))

    passage_samples = _sample_passages(random, shot, width)
    static_speeds = [
        sample.speed * width * float(scale.min())
        for sample in passage_samples
        if objects.OCCLUDERS[sample.kind].fixed
    ]
    rate = _sample_camera_speed(random, static_speeds)
    hand = random_wander(random, n, (1.0, 4.0), random.uniform(0.3, 1.5))
    travelled = rate * np.arange(n) + hand
    passages = []
    for sample in passage_samples:
        occluder, middle = objects.OCCLUDERS[sample.kind], round(sample.middle)
        side = width * scale[middle]
        direction = -np.sign(rate) if occluder.fixed else random.choice([-1.0, 1.0])
        speed = direction * sample.speed * side
        depth = speed / -rate if occluder.fixed else 1.0
        x = speed * (np.arange(n) - sample.middle) - depth * (hand - hand[middle])
        down = np.full(n, SIZE[1] / 2) if occluder.tall else np.full(n, centre[middle, 1])
        tall = SIZE[1] + 40.0 if occluder.tall else size[1] * float(scale[middle]) + 32
        if occluder.stands:
            below = ground[middle] if drop else SIZE[1]
            tall = max(tall, 2 * float(below - centre[middle, 1]) - 36)
        if sample.low:
            edge = centre[middle, 1] + (0.5 - sample.low) * size[1] * scale[middle]
            tall = SIZE[1] + 20 - float(edge)
            down = np.full(n, edge + tall / 2)
        path = quantised(np.stack([centre[middle, 0] + x, down + nod - nod[middle]], axis=1))
        passages.append(Passage(sample.kind, (sample.width * side, tall), path))
    return ClipPlan(
        shot, size, quantised(centre), scale, angle, mixture, still,
        quantised(travelled - travelled.min()) / NEAR, nod, ground, gain, tuple(passages),
    )  # fmt: skip


@dataclass(frozen=True)
class _PassageSample:
    """Time, kind and speed of an occluder's passage."""

    kind: str  # name in `objects.OCCLUDERS`
    middle: float  # time at which the centres of occluder and target are in one column [frames]
    width: float  # [target widths]
    speed: float  # [target widths/frame]
    low: float = (
        0.0  # if > 0, the occluder hides only this lower part of the target [target heights]
    )


def _sample_passages(random: Generator, shot: Shot, width: float) -> list[_PassageSample]:
    """Sample the passages of a clip in order of time; their gaps are at least `GAP` frames."""
    samples = []
    for _ in range(shot.occlusions):
        kind = str(random.choice(SETTINGS[shot.setting].occluders))
        wide = random.uniform(*WIDTHS)
        slowest = max(SPEEDS[0], (wide + 0.5) / LONGEST_OCCLUSION)
        samples.append((kind, wide, random.uniform(slowest, SPEEDS[1]), 0.0))
    if shot.partial:
        fixed = [objects.OCCLUDERS[kind].fixed for kind, *_ in samples]
        if random.random() < 0.5 and all(fixed):
            part = "post", random.uniform(0.15, 0.4), random.uniform(*SPEEDS), 0.0
        else:
            part = "heap", random.uniform(0.9, 1.4), SPEEDS[1], random.uniform(0.2, 0.4)
        samples.insert(int(random.integers(len(samples) + 1)), part)
    durations = np.array([(1 + wide) / speed for _, wide, speed, _ in samples])
    spare = shot.frames - LEAD - END - durations.sum() - GAP * max(len(samples) - 1, 0)
    shares = np.sort(random.uniform(0, max(spare, 0.0), len(samples)))
    passages, start = [], float(LEAD)
    for (kind, wide, speed, low), length, share in zip(samples, durations, shares, strict=True):
        passages.append(_PassageSample(kind, start + share + length / 2, wide, speed, low))
        start += length + GAP
    return passages


def _sample_camera_speed(random: Generator, static_speeds: list[float]) -> float:
    """Sample the camera's speed at the target's depth, below `static_speeds` [pixels/frame]."""
    side = float(random.choice([-1.0, 1.0]))
    if static_speeds:
        return side * min(FASTEST, min(static_speeds) / float(random.uniform(1.15, 1.7)))
    return side * float(
        random.choice([0.0, random.uniform(0.5, 2.0), random.uniform(2.0, FASTEST)])
    )


def _swinging(
    random: Generator, frames: int, periods: tuple[float, float], maximum: float
) -> Array:
    """Return a sum of waves with random periods [seconds], scaled to the maximum `maximum`."""
    waves = random_wander(random, frames, periods, 1.0)
    waves = waves - (waves.max() + waves.min()) / 2
    return np.asarray(waves * (maximum / np.abs(waves).max()))


def _drifting(
    random: Generator, frames: int, periods: tuple[float, float], maximum: float
) -> Array:
    """Return a sum of waves [pixels] whose speed does not exceed `DRIFT`."""
    path = _swinging(random, frames, periods, maximum)
    return np.asarray(path * min(1.0, DRIFT / float(np.abs(np.diff(path)).max())))


# standard deviations of the film's grain: of brightness, and of each chroma channel at the
# resolution of chroma [grey levels]
GRAIN, DYES = 2.6, 2.5
CAMERA = Camera(SIZE, noise=1.6, fall=(0.10, 0.12))
COARSE = SIZE[0] // 2, SIZE[1] // 2  # width and height of the chroma channels [pixels]
PRINTS = 0.65, 1.1  # range of the relative brightness of a clip, from dusk to noon
# Saturation of a clip relative to the paints. In the median clip of a set, the target's mean
# saturation is about 0.3, which is also the median of ten recorded targets (range 0.13 to 0.45).
SATURATION = 0.55, 0.85
SHADOW = 0.55  # darkness of a shadow on the ground, in its centre
WHOLE = 0.99  # minimum visibility at which the target counts as not occluded


class FilmScene(SeededScene):
    """Scene of a clip in the set with a seed; `clip` is in 1 to 20."""

    size = SIZE

    def __init__(self, parameters: SceneParameters, clip: int) -> None:
        super().__init__(parameters)
        self._clip, self.label = clip, f"nguyen2002/clip-{clip:02}"
        self.plan = clip_plan(self._seed, clip)
        self.length = self.plan.shot.frames

    def truth(self) -> SceneTruth:
        """Return the ground truth of all frames.

        Boxes have the position and scale of the target, but ignore its slight rotation. Attributes
        are `occluded` (less than half of the target is visible) and `partly occluded` (half of the
        target or more is visible, but not all of it).
        """
        boxes, visibility = self.plan.boxes, np.ones(len(self))
        near = np.zeros(len(self), np.bool_)
        middles = boxes[:, 0] + boxes[:, 2] / 2
        for passage in self.plan.passages:
            reach = (boxes[:, 2] + passage.size[0]) / 2 + 40
            near |= np.abs(passage.path[:, 0] - middles) < reach
        for frame in np.flatnonzero(near).tolist():
            whole, visible = self.seen(frame)
            visibility[frame] = visible.sum(dtype=np.int64) / whole.sum(dtype=np.int64)
        hidden = visibility < 0.5
        return SceneTruth(
            boxes,
            visibility,
            {"occluded": hidden, "partly occluded": ~hidden & (visibility < WHOLE)},
        )

    def render(self, frame: int) -> Image:
        plan = self.plan
        canvas = np.empty((SIZE[1], SIZE[0], 3), np.uint8)
        x, nod = float(plan.travel[frame]), float(plan.nod[frame])
        travel = EXPOSURE * float(np.gradient(plan.travel)[frame])
        self._surroundings.draw(canvas, replace(plan.still, x=x, shift_y=nod), travel)
        places = _places(plan.centre, frame)
        pose = float(plan.scale[frame]), float(plan.angle[frame])
        if self._shadow is not None:
            ground = np.column_stack([places[:, 0], np.full(len(places), plan.ground[frame])])
            self._shadow.draw(canvas, ground, pose[0], 0.0)
        self._carrier.draw(canvas, places, *pose)
        self._target.draw(canvas, places, *pose, float(plan.mixture[frame]))
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
        """Apply grading, exposure, grain and chroma subsampling to an image."""
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
    def _surroundings(self) -> Surroundings:
        plan = self.plan
        return Surroundings(
            self._random("place"),
            SETTINGS[plan.shot.setting],
            plan.still,
            SIZE,
            float(plan.travel.max()),
            float(np.abs(plan.nod).max()),
        )

    @cached_property
    def _target(self) -> objects.RigidObject:
        random, size = self._random("target"), self._largest
        colour, coverage = paint_target(random, KINDS[self.plan.shot.target], *size).reduced()
        return objects.RigidObject(
            two_textures(random, colour), coverage, size[0] / self.plan.size[0]
        )

    @cached_property
    def _carrier(self) -> objects.RigidObject:
        kind, size = KINDS[self.plan.shot.target].carrier, self._largest
        colour, coverage = objects.paint_carrier(self._random("carrier"), kind, *size).reduced()
        return objects.RigidObject([colour], coverage, size[0] / self.plan.size[0])

    @cached_property
    def _shadow(self) -> objects.RigidObject | None:
        """Shadow on the ground or reflection in the water; None if the ground is not visible."""
        width = objects.CARRIERS[KINDS[self.plan.shot.target].carrier].shadow * self._largest[0]
        if not width:
            return None
        colour, coverage = objects.paint_shadow(width, SHADOW)
        return objects.RigidObject([colour], coverage, self._largest[0] / self.plan.size[0])

    @cached_property
    def _occluders(self) -> list[tuple[Sprite, Array]]:
        """Sprites of the occluders, with the offset of each centre from its anchor [pixels]."""
        hiders = []
        for number, passage in enumerate(self.plan.passages):
            random, size = self._random(f"hider {number}"), np.array(passage.size) / objects.UNIT
            sheet = objects.OCCLUDERS[passage.kind].paint(random, *size.tolist())
            sprite = Sprite(*sheet.reduced())
            middle = np.array([sprite.width, sprite.height]) / 2
            hiders.append((sprite, middle - np.array(sheet.anchor) * objects.UNIT))
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
        """Grain of the two chroma channels, at their resolution."""
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


def _shiftable(grain: Array, deviation: float) -> NDArray[np.int16]:
    """Return grain with a standard deviation, 255 pixels larger than the image."""
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
