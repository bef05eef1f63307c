"""The tracker's template kept on a target, without what it does about severe occlusions."""

from math import nan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackers.base.interface import Box, Image, Mask
from trackers.nguyen2002 import Nguyen2002
from trackers.templates.appearance import Appearance, Features, Seen
from trackers.templates.matching import Match, Pose, Window, sampled
from trackers.templates.occlusion import Occlusion

__all__ = ["FEATURES", "Follower", "View", "true_pose"]

Array = NDArray[np.float64]

FEATURES: tuple[Features, ...] = ("intensity", "rgb", "invariants", "arctan")


class View(NamedTuple):
    """A template's place in a frame, at what cost it was matched, and how its pixels compare."""

    pose: Pose
    cost: float
    seen: Seen


class Follower(Nguyen2002):
    """The tracker taken apart: whoever asks decides which views are taken into the template.

    The tracker itself takes those with no more than γ outliers.

    Parameters
    ----------
    image : ndarray of uint8, shape (rows, columns, 3)
        The first frame, BGR.
    box : ndarray of float64, shape (4,)
        The target's.
    **parameters
        Those of the tracker; `as-written` by default.
    """

    def __init__(
        self, image: Image, box: Box, features: Features = "invariants", **parameters: Any
    ) -> None:
        chosen = {**self.presets["as-written"], "features": features, **parameters}
        super().__init__(self.Parameters(**chosen), np.random.SeedSequence(0))
        self.init(image, box)
        self._first_box, self._taken = box, False

    @property
    def appearance(self) -> Appearance:
        """Template and covariances."""
        return self._appearance

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the template."""
        return self._height, self._width

    def restart(self, image: Image, box: Box) -> None:
        """Take the target anew from where it is, at rest."""
        self._begin(image, true_pose(self._first_box, box), (0.0, 0.0, 0.0))

    def restart_after(self, image: Image, pose: Pose, frames: int) -> None:
        """Take it anew so many frames after the last that was taken, moving as it did since."""
        x, y, scale = ((b - a) / frames for a, b in zip(self._pose, pose, strict=True))
        self._begin(image, pose, (x, y, scale))

    def look(self, image: Image, hidden: int = 0) -> View:
        """Match the template with a frame, so many after the first that was not taken."""
        if hidden:
            x, y, _ = self._smoothers
            away = Occlusion(0, self._pose, (x.velocity, y.velocity))
            found = self._examined(away, image, hidden).match
        else:
            around = Pose(*(smoother.predicted() for smoother in self._smoothers))
            found = self.match(image, around, self.parameters.search_range)
        return self.compare(image, found.pose, found.cost)

    def match(self, image: Image, around: Pose, search_range: int) -> Match:
        """Where the template fits best in a part of an image (equation 4)."""
        return self._match(image, around, search_range)[0]

    def compare(self, image: Image, pose: Pose, cost: float = nan) -> View:
        """Compare the template with a frame at a place, and at what cost it is there if known."""
        window = self._window(image, pose, 0)
        features = sampled(window, pose, *self.shape, self.parameters.subpixel)
        if not self._appearance.started:
            self._appearance.start(features)
        return View(pose, cost, self._appearance.seen(features))

    def take(self, view: View) -> None:
        """Update the template by a view of the next frame."""
        self._take(view.pose, view.seen, first=not self._taken)
        self._taken = True

    def box(self, pose: Pose) -> Box:
        """Of a pose, in pixels."""
        return self._box(pose)

    def truth(self, image: Image, box: Box) -> Array:
        """Features of the target where it truly is, shape (height, width, d)."""
        return self._view(image, true_pose(self._first_box, box))

    def errors(self, image: Image, box: Box) -> Array:
        """|g - truth| of the template's pixels, shape (height, width): means over the components.

        Each in standard deviations of the true component over the template. Asked of the next
        frame, the truth's noise is not what was taken into the template.
        """
        truth = self.truth(image, box)
        spread = np.maximum(truth.std(axis=(0, 1)), 1e-9)
        return np.asarray((np.abs(self.appearance.template - truth) / spread).mean(axis=2))

    def on_template(self, mask: Mask, box: Box) -> Mask:
        """What a mask of the image says of the template's pixels, the target being in a box."""
        rows, columns = mask.shape
        window = Window(mask[:, :, np.newaxis].astype(np.float64), 0, 0, rows, columns)
        return sampled(window, true_pose(self._first_box, box), *self.shape, False)[:, :, 0] > 0

    def _begin(self, image: Image, pose: Pose, velocity: tuple[float, float, float]) -> None:
        self._pose, self._taken = pose, False
        self._appearance = Appearance(self._noise, self._view(image, pose))
        self._restart(pose, velocity)


def true_pose(first: Box, box: Box) -> Pose:
    """Pose of a template of the first box that covers another, whose shape is the same."""
    x, y = (box[:2] + box[2:] / 2 - 0.5).tolist()
    return Pose(x, y, float(box[2] / first[2]))
