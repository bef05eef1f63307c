"""How far the target's place stands out from clutter, by the cost of the match (NG-9)."""

from math import ceil

import numpy as np
import pandas as pd

from bench.papers.nguyen2002.checks.follower import FEATURES, Follower, true_pose
from bench.papers.nguyen2002.checks.made_up import clear_frames
from datasets import Sequence
from trackers.templates.features import Features
from trackers.templates.matching import Pose

__all__ = ["clutter_places", "measure"]

FRAMES = 2
LAG = 5  # frames from the template to what it is compared with
RANGE = 8  # pixels either way, that are searched around each place in clutter
NEAR = 4  # likewise, around the target's true place
STRAY = 4  # pixels by which a search may leave its range
STRIDE = 2  # of the pixels that a match is judged by


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `ng-9`; see `bench.papers.nguyen2002.checks`."""
    rows = []
    for frame in _frames(sequence, 1 if quick else FRAMES):
        for features in FEATURES:
            found = {"features": features, "frame": frame, **_compared(sequence, frame, features)}
            rows.append(found)
    return {"ng-9": pd.DataFrame(rows)}


def clutter_places(pose: Pose, shape: tuple[int, int], rows: int, columns: int) -> list[Pose]:
    """Where to search clutter: all over the image, as far as the template stays inside.

    No search from there comes nearer to the target than half its width or half its height.
    """
    height, width = (pose.scale * side for side in shape)
    apart = RANGE + STRAY
    xs, ys = (
        np.linspace(
            least := side / 2 + apart, most := limit - side / 2 - apart, _steps(most - least)
        )
        for side, limit in ((width, columns), (height, rows))
    )
    return [
        Pose(float(x), float(y), pose.scale)
        for y in ys
        for x in xs
        if abs(x - pose.x) > width / 2 + apart or abs(y - pose.y) > height / 2 + apart
    ]


def _steps(length: float) -> int:
    """Number of places along a line, so that searches from there leave nothing out."""
    return max(0, ceil(length / (2 * RANGE)) + 1)


def _frames(sequence: Sequence, most: int) -> list[int]:
    """At most so many, evenly spaced, up to which the target was clear for long enough."""
    there = np.flatnonzero(clear_frames(sequence, LAG))
    places = np.linspace(0, len(there) - 1, min(most, len(there))).round().astype(int)
    return [int(there[place]) for place in np.unique(places)]


def _compared(sequence: Sequence, frame: int, features: Features) -> dict[str, float]:
    """What a template says of the target, and of the best place in clutter, if there is any.

    It is some frames old; its noise is that of the residuals at the target's true place.
    """
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
