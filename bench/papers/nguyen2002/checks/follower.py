"""The tracker's template kept on a target, without what it does about severe occlusions."""

from itertools import count
from math import floor, nan
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from bench.papers.nguyen2002.plain import Settings
from bench.papers.nguyen2002.plain.matching import Pose as PlainPose
from bench.papers.nguyen2002.plain.smoother import Smoother
from trackers.base.interface import Box, Image, Mask
from trackers.nguyen2002 import Nguyen2002
from trackers.template.appearance import Appearance, Noise, Seen, raised
from trackers.template.features import Features, features_of
from trackers.template.matching import Match, Pose, Ties, Window, reach, sampled, search

__all__ = ["FEATURES", "Follower", "View", "true_pose"]

Array = NDArray[np.float64]

FEATURES: tuple[Features, ...] = ("intensity", "rgb", "invariants", "arctan")
WIDEST_SEARCH = 64  # pixels either way


class View(NamedTuple):
    """A template's place in a frame, at what cost it was matched, and how its pixels compare."""

    pose: Pose
    cost: float
    seen: Seen


class Follower:
    """A template as the tracker keeps it: found, compared and filtered with its own parts.

    Whoever asks decides which views are taken into the template; the tracker takes those with no
    more than γ outliers.

    Parameters
    ----------
    image : ndarray of uint8, shape (rows, columns, 3)
        The first frame, BGR.
    box : ndarray of float64, shape (4,)
        The target's.
    **parameters
        Those of the tracker; `as-written` by default.

    Attributes
    ----------
    settings : Settings
    shape : tuple of int
        Height and width of the template.
    appearance : Appearance
    pose : Pose
        Of the last view that was taken.
    gain : ndarray of float64, shape (d, d)
        K of that view (equation 9); NaN before any.
    """

    def __init__(
        self, image: Image, box: Box, features: Features = "invariants", **parameters: Any
    ) -> None:
        chosen = {**Nguyen2002.presets["as-written"], "features": features, **parameters}
        self.settings = Settings(**chosen)
        self._features, self._cutoff = features, self.settings.cutoff
        self._box = box
        self.shape = floor(box[3] + 0.5), floor(box[2] + 0.5)
        self.pose: Pose
        self.gain: Array
        self.appearance: Appearance
        self._smoother: Smoother
        self._taken: bool
        self._begin(image, true_pose(box, box), Pose(0.0, 0.0, 0.0))

    def restart(self, image: Image, box: Box) -> None:
        """Take the target anew from where it is, at rest."""
        self._begin(image, true_pose(self._box, box), Pose(0.0, 0.0, 0.0))

    def restart_after(self, image: Image, pose: Pose, frames: int) -> None:
        """Take it anew so many frames after the last that was taken, moving as it did since."""
        velocity = Pose(*((b - a) / frames for a, b in zip(self.pose, pose, strict=True)))
        self._begin(image, pose, velocity)

    def look(self, image: Image, hidden: int = 0) -> View:
        """Match the template with a frame, so many after the first that was not taken."""
        search_range = min(self.settings.search_range + 2 * hidden, WIDEST_SEARCH)
        found = self.match(image, self.predicted(hidden), search_range)
        return self.compare(image, found.pose, found.cost)

    def predicted(self, hidden: int = 0) -> Pose:
        """Where to expect the target in such a frame."""
        if not hidden:
            return Pose(*self._smoother.predicted())
        speed = self._smoother.velocity
        x, y, scale = self.pose
        return Pose(x + (hidden + 1) * speed.x, y + (hidden + 1) * speed.y, scale)

    def compare(self, image: Image, pose: Pose, cost: float = nan) -> View:
        """Compare the template with a frame at a place, and at what cost it is there if known."""
        window = self._window(image, pose, 0)
        features = sampled(window, pose, *self.shape, self.settings.subpixel)
        if not self.appearance.started:
            self.appearance.start(features)
            self._estimate = self.appearance.measurement
        return View(pose, cost, self.appearance.seen(features))

    def match(self, image: Image, around: Pose, search_range: int) -> Match:
        """Where the template fits best in a part of an image (equation 4)."""
        return search(
            self._window(image, around, search_range),
            self.appearance.template,
            self.appearance.residual,
            around,
            search_range,
            self._cutoff,
            self.settings.subpixel,
            cast(Ties, self.settings.ties),
        )

    def take(self, view: View) -> None:
        """Update the template by a view of the next frame."""
        appearance = self.appearance
        appearance.update(view.seen, first=not self._taken)
        predicted = self._estimate + appearance.state
        self.gain = predicted @ np.linalg.inv(predicted + appearance.measurement)
        self._estimate = raised(predicted - self.gain @ predicted, 0.0)
        self._smoother.measure(PlainPose(*view.pose))
        self.pose, self._taken = view.pose, True

    def box(self, pose: Pose) -> Box:
        """Of a pose, in pixels."""
        size = self._box[2:] * pose.scale
        return np.concatenate([np.array([pose.x + 0.5, pose.y + 0.5]) - size / 2, size])

    def truth(self, image: Image, box: Box) -> Array:
        """Features of the target where it truly is, shape (height, width, d)."""
        return self._first_view(image, true_pose(self._box, box))

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
        return sampled(window, true_pose(self._box, box), *self.shape, False)[:, :, 0] > 0

    def _begin(self, image: Image, pose: Pose, velocity: Pose) -> None:
        d = self.settings.d
        self.pose = pose
        self.appearance = Appearance(_noise_of(self.settings), self._first_view(image, pose))
        self.gain = np.full((d, d), np.nan)
        self._smoother = Smoother(PlainPose(*pose), PlainPose(*velocity))
        self._taken = False

    def _first_view(self, image: Image, pose: Pose) -> Array:
        return sampled(self._window(image, pose, 0), pose, *self.shape, True)

    def _window(self, image: Image, around: Pose, search_range: int) -> Window:
        rows, columns = image.shape[:2]
        left, top, right, bottom = reach(around, search_range, self.shape, rows, columns)
        features = features_of(image[top:bottom, left:right], self._features)
        return Window(features, left, top, rows, columns)


def true_pose(first: Box, box: Box) -> Pose:
    """Pose of a template of the first box that covers another, whose shape is the same."""
    x, y = (box[:2] + box[2:] / 2 - 0.5).tolist()
    return Pose(x, y, float(box[2] / first[2]))


def _noise_of(settings: Settings) -> Noise:
    patience = np.iinfo(np.int64).max
    if settings.rebootstrap:
        patience = next(number for number in count(1) if settings.too_long(number))
    return Noise(
        limit=settings.limit,
        floor=settings.floor,
        factor=settings.consistency_factor,
        first_spread=settings.first_spread,
        grid_step=settings.step if settings.misregistration else 0.0,
        average=settings.average,
        full=settings.covariance == "full",
        adaptive=settings.adaptive_noise,
        gate=settings.gate,
        patience=patience,
    )
