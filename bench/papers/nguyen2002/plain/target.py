"""One target: its template, its place, and the steps that tracking it is made of."""

from math import floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.papers.nguyen2002.plain.appearance import Appearance
from bench.papers.nguyen2002.plain.features import features_of
from bench.papers.nguyen2002.plain.matching import Pose, match, sample
from bench.papers.nguyen2002.plain.settings import Settings
from bench.papers.nguyen2002.plain.smoother import Smoother

__all__ = ["Candidate", "Target"]

Array = NDArray[np.float64]


class Candidate(NamedTuple):
    """Where the template fits best in a frame that may end an occlusion."""

    pose: Pose
    cost: float
    share: float


class Target:
    """The target of a first box.

    Parameters
    ----------
    settings : Settings
    image : ndarray of uint8, shape (rows, columns, 3)
        The first frame, BGR.
    box : ndarray of float64, shape (4,)
        The target's box in it, where pixel centres are halves.

    Attributes
    ----------
    appearance : Appearance
    last : Pose
        Reported for the last frame in which the target was followed.
    """

    def __init__(self, settings: Settings, image: NDArray[np.uint8], box: Array) -> None:
        self._settings = settings
        self._size = box[2:].copy()
        self._width, self._height = (floor(side + 0.5) for side in box[2:].tolist())
        x, y = (box[:2] + box[2:] / 2 - 0.5).tolist()
        self.last = Pose(x, y, 1.0)
        self._smoother = Smoother(self.last, Pose(0.0, 0.0, 0.0))
        self.appearance = Appearance(settings, self._view(self._features(image), self.last, True))

    def follow(self, image: NDArray[np.uint8]) -> Pose | None:
        """Pose to report for the next frame; None where a severe occlusion begins in it."""
        features = self._features(image)
        around = self._smoother.predicted()
        pose, _ = self._match(features, around, self._settings.search_range)
        seen = self._view(features, pose, self._settings.subpixel)
        first = not self.appearance.r
        if first:
            self.appearance.begin(seen)
        if self.appearance.share(seen) > self._settings.gamma:
            return None
        if first:
            self.appearance.update_first(seen)
        else:
            self.appearance.update(seen)
        self._smoother.measure(pose)
        self.last = self._smoother.pose if self._settings.report == "smoothed" else pose
        return self.last

    def extrapolated(self, frames: int) -> Pose:
        """Pose so many frames after the last, had the target gone on as it went."""
        velocity = self._smoother.velocity
        return Pose(
            self.last.x + frames * velocity.x, self.last.y + frames * velocity.y, self.last.scale
        )

    def look(self, image: NDArray[np.uint8], n: int) -> Candidate:
        """Match the frozen template with the frame n after an occlusion's beginning."""
        features = self._features(image)
        search_range = min(self._settings.search_range + 2 * n, 64)
        pose, cost = self._match(features, self.extrapolated(n + 1), search_range)
        seen = self._view(features, pose, self._settings.subpixel)
        return Candidate(pose, cost, self.appearance.share(seen))

    def interpolated(self, pose: Pose, n: int) -> list[Pose]:
        """Poses of the n frames of an occlusion that is over with this pose."""
        start, end = np.array(self.last), np.array(pose)
        return [Pose(*(start + (end - start) * i / (n + 1)).tolist()) for i in range(1, n + 1)]

    def take_again(self, image: NDArray[np.uint8], pose: Pose, n: int) -> None:
        """Start anew where an occlusion is over, n frames after its beginning."""
        appearance = Appearance(
            self._settings, self._view(self._features(image), pose, bilinear=True)
        )
        if self._settings.reinitialise == "keep":
            appearance.begin_as_known(self.appearance)
        self.appearance = appearance
        velocity = (np.array(pose) - np.array(self.last)) / (n + 1)
        self._smoother = Smoother(pose, Pose(*velocity.tolist()))
        self.last = pose

    def box(self, pose: Pose) -> Array:
        """Box in coordinates where pixel centres are halves."""
        size = self._size * pose.scale
        return np.concatenate([(pose.x + 0.5, pose.y + 0.5) - size / 2, size])

    def _features(self, image: NDArray[np.uint8]) -> Array:
        return features_of(image, self._settings.features)

    def _view(self, features: Array, pose: Pose, bilinear: bool) -> Array:
        return sample(features, pose, self._height, self._width, bilinear=bilinear)

    def _match(self, features: Array, around: Pose, search_range: int) -> tuple[Pose, float]:
        return match(
            features,
            self.appearance.g,
            self.appearance.r_bar,
            around,
            search_range,
            self._settings.cutoff,
            subpixel=self._settings.subpixel,
            ties=self._settings.ties,
        )
