"""What claims ask of the scenes and no run of a tracker shows, and on which scenes.

A function takes a sequence, and whether a quick look is enough, and gives tables, which are named
by their claims. Every one has `name` (the sequence, canonical), `sequence` (without variant),
`scene`, then columns of its own; `features` are those of the tracker, all four, in a quick look
some. Frames count from 0. A share or a yes or no is a float in [0, 1].
"""

from collections.abc import Callable
from math import ceil
from typing import get_args

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Trace
from bench.metrics.overlap import overlap
from bench.papers.nguyen2002 import occlusions, templates
from bench.papers.nguyen2002.events import declared_in
from bench.papers.nguyen2002.follower import (
    COLOURS,
    FEATURES,
    Follower,
    clear_frames,
    mask_in,
    true_pose,
    wholly_seen,
)
from bench.papers.scenes import SceneCheck, Tables, short_runs, spaced, with_noise
from datasets.interface import Frames
from trackers.base.interface import Box, Image
from trackers.templates.appearance import Features, features_of
from trackers.templates.matching import Pose

__all__ = ["CHECKS", "Noisy", "clutter", "clutter_places", "lines", "sensor", "shading"]

Array = NDArray[np.float64]

CLUTTER_FRAMES = 2
LAG = 5  # frames from the template to what it is compared with
RANGE = 8  # pixels either way, that are searched around each place in clutter
NEAR = 4  # likewise, around the target's true place
STRAY = 4  # pixels by which a search may leave its range
STRIDE = 2  # of the pixels that a match is judged by

SHADE = 0.5  # light in the shade
EDGE = 0.1  # of the width, over which light turns into shade
DARKEST = 0.4  # light where a surface turns away most

DEVIATIONS = (1.0, 2.0, 4.0, 8.0)  # of noise that is added [grey levels]
NOISY_FRAMES, QUICK_NOISY_FRAMES = 100, 30
"""Nearly three times L, as an occlusion that is declared in vain may hide the next L frames."""


def clutter(sequence: datasets.Sequence, quick: bool) -> Tables:
    """How far the target's place stands out from clutter, by the cost of the match (NG-9).

    `ng-9`, a frame and kind of features a row: `features`, `frame`, `at_target`, `in_clutter`
    (least matching errors a pixel, of a template five frames old, at the target's true place and at
    places that are half its width or its height beside it; R is learnt from the residuals at the
    true place, by the tracker's rule), `margin` (their difference), `ratio`, `false_alarms` (share
    of the template's pixels that are no outliers at that place in clutter).
    """
    clear = np.flatnonzero(clear_frames(sequence, LAG))
    return {
        "ng-9": pd.DataFrame(
            {"features": features, "frame": frame, **_margin(sequence, frame, features)}
            for frame in spaced(clear, 1 if quick else CLUTTER_FRAMES)
            for features in FEATURES
        )
    }


def _margin(sequence: datasets.Sequence, frame: int, features: Features) -> dict[str, float]:
    """What a template says of the target, and of the best place in clutter, if there is any."""
    before, image, box = frame - LAG, sequence[frame], sequence.boxes[frame]
    follower = Follower(sequence[before], sequence.boxes[before], features)
    follower.appearance.start(follower.truth(image, box))
    pose = true_pose(sequence.boxes[before], box)
    rows, columns = image.shape[:2]
    places = clutter_places(pose, follower.shape, rows, columns)
    if not places:
        return {}
    target = follower.match(image, pose, NEAR)
    best = min((follower.match(image, place, RANGE) for place in places), key=lambda it: it.cost)
    pixels = float(np.prod([len(range(STRIDE // 2, side, STRIDE)) for side in follower.shape]))
    return {
        "at_target": target.cost / pixels,
        "in_clutter": best.cost / pixels,
        "margin": (best.cost - target.cost) / pixels,
        "ratio": best.cost / target.cost,
        "false_alarms": 1 - follower.compare(image, best.pose).seen.share,
    }


def clutter_places(pose: Pose, shape: tuple[int, int], rows: int, columns: int) -> list[Pose]:
    """Where to search clutter: all over the image, as far as the template stays inside.

    No search from there comes nearer to the target than half its width or half its height.
    """
    height, width = (pose.scale * side for side in shape)
    apart = RANGE + STRAY

    def along(side: float, limit: int) -> Array:
        """Places so near that searches from there leave nothing out."""
        least, most = side / 2 + apart, limit - side / 2 - apart
        return np.linspace(least, most, max(0, ceil((most - least) / (2 * RANGE)) + 1))

    return [
        Pose(float(x), float(y), pose.scale)
        for y in along(height, rows)
        for x in along(width, columns)
        if abs(x - pose.x) > width / 2 + apart or abs(y - pose.y) > height / 2 + apart
    ]


def _shade_edge(across: Array, down: Array) -> Array:
    """The left half of the box lies in the shade."""
    lit = np.clip((across - 0.5) / EDGE + 0.5, 0, 1)
    return np.asarray(SHADE + (1 - SHADE) * lit)


def _turning_away(across: Array, down: Array) -> Array:
    """The surface turns away from the light towards the left and the right."""
    away = np.cos(np.clip(2 * across - 1, -1, 1) * np.arccos(DARKEST))
    return np.asarray(away + 0 * down)


LIGHTS: dict[str, Callable[[Array, Array], Array]] = {
    "shade": _shade_edge,
    "shading": _turning_away,
}


def shading(sequence: datasets.Sequence, quick: bool) -> Tables:
    """How far features of the target's pixels change in shade, over how far they spread (NG-21).

    `ng-21`, a kind of light a row: `features`, `cause` (`shade`: an edge of half light; `shading`:
    a surface that turns away from the light), `change` (mean absolute change of a pixel, in
    standard deviations over the target).
    """
    part = wholly_seen(sequence, 1, 1)
    if part is None:
        return {}
    image, mask = part[0], mask_in(part, 0)
    rows = []
    for cause, gain_at in LIGHTS.items():
        gain = gain_at(*_places(part.boxes[0], image.shape))
        changed = np.round(image * gain[:, :, np.newaxis]).astype(np.uint8)
        for features in FEATURES:
            before, after = (features_of(one, features)[mask] for one in (image, changed))
            spread = np.maximum(before.std(axis=0), 1e-9)
            change = np.abs(after - before).mean(axis=0)
            row = {"cause": cause, "features": features, "change": float((change / spread).mean())}
            rows.append(row)
    return {"ng-21": pd.DataFrame(rows)}


def _places(box: Box, shape: tuple[int, ...]) -> tuple[Array, Array]:
    """Pixel centres in shares of a box, from its left and from its top."""
    x, y, width, height = box.tolist()
    down, across = np.indices(shape[:2]) + 0.5
    return (across - x) / width, (down - y) / height


class Noisy:
    """Frames with noise of a sensor [grey levels], the same whenever they are asked for."""

    def __init__(self, frames: Frames, deviation: float) -> None:
        self._frames, self._deviation = frames, deviation

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, frame: int) -> Image:
        generator = np.random.default_rng(frame)
        return with_noise(self._frames[frame], self._deviation, generator)


def sensor(sequence: datasets.Sequence, quick: bool) -> Tables:
    """False occlusions and overlap by the noise of the camera, with the same settings (NG-22).

    `ng-22`, of clips with 100 clear frames in a row, a noise and trace a row: `features`, `trace`
    (`revised`, `online`), `noise` (deviation of what is added [grey levels]), `false_occlusions`
    (declared in 100 frames), `mean_overlap`; `ng-22-lines`, see `lines`. The tracker is run.
    """
    frames = QUICK_NOISY_FRAMES if quick else NOISY_FRAMES
    part = wholly_seen(sequence, frames, frames)
    if part is None:
        return {}
    chosen = COLOURS if quick else FEATURES
    texts = [f"nguyen2002:preset=as-written:features={features}" for features in chosen]
    rows = []
    for deviation in DEVIATIONS:
        noisy = part[:]
        noisy.frames = Noisy(part.frames, deviation)
        for features, run in zip(chosen, short_runs(noisy, texts), strict=True):
            declared = 100 * len(declared_in(run)) / frames
            for trace in get_args(Trace):
                shared = float(overlap(part.boxes, run.boxes_in(trace)).mean())
                labels = {"features": features, "trace": trace, "noise": deviation}
                rows.append(labels | {"false_occlusions": declared, "mean_overlap": shared})
    found = pd.DataFrame(rows)
    return {"ng-22": found, "ng-22-lines": lines(found)}


def lines(rows: pd.DataFrame) -> pd.DataFrame:
    """Straight lines through what was found at each noise, by features and trace.

    Of `ng-22` of one sequence; rows are where the lines are at the least and at the greatest noise:
    what lies between is their slope, times the range.
    """
    ends = np.array([min(DEVIATIONS), max(DEVIATIONS)])
    found = []
    for (features, trace), group in rows.groupby(["features", "trace"], sort=False):
        at_ends = {
            metric: np.polyval(np.polyfit(group["noise"], group[metric], 1), ends)
            for metric in ("mean_overlap", "false_occlusions")
        }
        found.append(pd.DataFrame({"features": features, "trace": trace, "noise": ends, **at_ends}))
    return pd.concat(found, ignore_index=True)


RECORDING = "nguyen2002/lights"
CLIPS = tuple(f"nguyen2002/clip-{number:02}" for number in range(1, 21, 2))
"""Every other one is enough where a set is the unit."""

OTHERS = tuple(f"nguyen2002/clip-{number:02}" for number in range(2, 21, 2))
BOTH = (*CLIPS, RECORDING)

CHECKS = (
    SceneCheck(clutter, CLIPS),
    SceneCheck(occlusions.watched, CLIPS),
    SceneCheck(occlusions.by_speed, CLIPS[:1]),
    SceneCheck(shading, (RECORDING,)),
    SceneCheck(clutter, OTHERS, everything=True),
    SceneCheck(occlusions.watched, OTHERS, everything=True),
    SceneCheck(templates.gates, BOTH, everything=True),
    SceneCheck(templates.corners, CLIPS, everything=True),
    SceneCheck(templates.changed, BOTH, everything=True),
    SceneCheck(templates.adaptation, BOTH, everything=True),
    SceneCheck(occlusions.by_speed_on_targets, BOTH, everything=True),
    SceneCheck(templates.by_norm, BOTH, everything=True),
    SceneCheck(sensor, CLIPS, everything=True),
)
