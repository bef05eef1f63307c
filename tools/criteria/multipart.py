"""Criteria of the multipart scenes: margins of the single and of the two-part histogram.

A margin is positive if the target matches the histogram of the first frame better than clutter
does. The rectangle encloses the whole person (region `full`), as the init box of the trackers does.
Colours, bins and distances are those of the tracker in the setting `as-written`.
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tools.criteria.shared import SceneImages, box_mask, longest_stretch
from trackmark.bench.papers.multipart.scenes import half_counts, right_choice_rate
from trackmark.datasets.interface import Sequence
from trackmark.trackers.base.interface import Image
from trackmark.trackers.histograms.bins import LuvBins
from trackmark.trackers.histograms.rectangles import bhattacharyya_distances

SAMPLES = 60
"""Default number of evenly spaced frames whose margins are measured."""

CLEAR = 0.9
"""Minimum visible share of the person in frames whose margins are measured."""

WIDTHS, STEP = 3.0, 0.5
RISES = (-0.5, -0.25, 0.0, 0.25, 0.5)
MAX_OVERLAP = 0.1


def right_choice(scene: SceneImages, *, two_coloured: bool) -> float:
    """Return the share of jittered init boxes for which Eq. 7 selects the right representation."""
    frame = scene.sequence.first_frame
    box = scene.sequence.regions["full"][frame]
    return right_choice_rate(scene.image(frame), box, two_coloured, LuvBins())


def low_margin_share(
    scene: SceneImages, *, parts: int, below: float, until: float = 1.0, samples: int = SAMPLES
) -> float:
    """Return the share of frames with a margin below a limit, before `until` times the length."""
    frames, values = margins(scene.sequence, tuple(sampled_frames(len(scene), samples).tolist()))
    return float((values[parts - 1][frames < until * len(scene)] < below).mean())


def low_margin_stretch(scene: SceneImages, *, parts: int, below: float) -> float:
    """Return the longest run of measured frames with a margin below a limit [frames]."""
    sampled = sampled_frames(len(scene), SAMPLES)
    frames, values = margins(scene.sequence, tuple(sampled.tolist()))
    step = int(sampled[1])
    low = np.zeros(len(scene) // step + 1, bool)
    low[frames // step] = values[parts - 1] < below
    return float(max(longest_stretch(low) - 1, 0) * step + 1)


def crossing_time(scene: SceneImages, *, after: float) -> float:
    """Return the time of strongest occlusion after `after`, both as parts of the length."""
    first = round(after * len(scene))
    return float((first + scene.visibility[first:].argmin()) / len(scene))


def crossing_margin(scene: SceneImages, *, after: float) -> float:
    """Return the smallest margin of the single histogram after `after`, a part of the length."""
    frames = tuple(range(round(after * len(scene)), len(scene), 2))
    return float(margins(scene.sequence, frames)[1][0].min())


def halves_difference(scene: SceneImages) -> float:
    """Return how much shirt and trousers differ in the first frame [CIE L*u*v*].

    The target's box reaches from shoulders to ankles, and its centre is the waist. The colours of
    the halves are medians over the target's pixels.
    """
    frame = scene.sequence.first_frame
    colours = cv2.cvtColor(scene.image(frame).astype(np.float32) / 255, cv2.COLOR_BGR2Luv)
    target, box = scene.mask(frame), scene.boxes[frame]
    halves = []
    for part in (0.0, 0.5):
        half = np.array([box[0], box[1] + part * box[3], box[2], box[3] / 2])
        pixels = colours[target & box_mask(target.shape, half)].astype(np.float64)
        halves.append(np.median(pixels, axis=0))
    return float(np.linalg.norm(halves[0] - halves[1]))


def occlusions(scene: SceneImages, *, visible: float) -> float:
    """Return the number of stretches in which less than `visible` of the target is visible."""
    hidden = scene.visibility < visible
    return float(np.count_nonzero(np.diff(np.r_[False, hidden].astype(int)) == 1))


def background_in_person(scene: SceneImages) -> float:
    """Return the share of the person's first rectangle that does not show the target."""
    frame = scene.sequence.first_frame
    inside = box_mask(scene.mask(frame).shape, scene.sequence.regions["full"][frame])
    return float(1.0 - (scene.mask(frame) & inside).sum() / inside.sum())


class Appearance:
    """Histograms of a rectangle `[x, y, width, height]` [px] in a BGR image, and of its halves."""

    def __init__(self, image: Image, box: NDArray[np.float64]) -> None:
        counts, totals = half_counts(image, box[np.newaxis], LuvBins())
        self._counts, self._totals = counts[:, 0], totals[:, 0]

    def distances(self, image: Image, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances (Eq. 1, 2) of rectangles with equal aspect ratios, shape (2, n).

        First row: single histogram; second row: two-part histogram. The distance is 1 if less than
        half of a rectangle is inside the image.
        """
        counts, totals = half_counts(image, boxes, LuvBins())
        single = bhattacharyya_distances(
            counts.sum(axis=0, dtype=np.int32),
            totals.sum(axis=0),
            self._counts.sum(axis=0, dtype=np.int32),
            int(self._totals.sum()),
        )
        upper, lower = (
            bhattacharyya_distances(counts[k], totals[k], self._counts[k], int(self._totals[k]))
            for k in range(2)
        )
        return np.stack([single, (upper + lower) / 2])


def sampled_frames(n_frames: int, samples: int) -> NDArray[np.int64]:
    """Return at most `samples` evenly spaced frames."""
    return np.arange(0, n_frames, -(-n_frames // samples))


def clutter_boxes(box: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rectangles up to three widths and half a height from a box that hardly overlap it."""
    across = np.arange(-WIDTHS, WIDTHS + STEP, STEP)
    offsets = np.array([(dx, dy) for dx in across for dy in RISES])
    shared = np.clip(1 - np.abs(offsets), 0, None).prod(axis=1)
    offsets = offsets[shared < MAX_OVERLAP]
    corners = box[:2] + offsets * box[2:]
    return np.hstack([corners, np.broadcast_to(box[2:], corners.shape)])


@lru_cache(maxsize=8)
def margins(
    sequence: Sequence, frames: tuple[int, ...]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Measure how much better the target matches the first frame's histogram than clutter does.

    A margin is the smallest distance of a clutter rectangle minus the target's distance. Returns
    those of `frames` with at least 90 % of the target visible, shape (n,), and their margins, shape
    (2, n): single histogram first, two-part histogram second.
    """
    boxes = sequence.regions["full"]
    first = sequence.first_frame
    model = Appearance(sequence[first], boxes[first])
    selected = np.array(frames)
    clear = selected[sequence.visibility[selected] >= CLEAR]
    values = []
    for frame in clear.tolist():
        box = boxes[frame]
        rectangles = np.vstack([box[np.newaxis], clutter_boxes(box)])
        distances = model.distances(sequence[frame], rectangles)
        values.append(distances[:, 1:].min(axis=1) - distances[:, 0])
    return clear, np.array(values).reshape(-1, 2).T
