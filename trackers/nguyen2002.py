"""A template of per-pixel robust adaptive Kalman filters (Nguyen & Smeulders 2002)."""

from collections.abc import Mapping
from math import ceil, floor, inf, nan, sqrt
from typing import Literal

import numpy as np
from pydantic import Field

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.kalman import Smoother
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    choice,
    fraction,
    positive,
    whole,
)
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.templates.appearance import (
    FLOORS,
    Appearance,
    Features,
    Noise,
    Seen,
    dimension,
    features_of,
)
from trackmark.trackers.templates.matching import Match, Pose, Ties, Window, reach, sampled, search
from trackmark.trackers.templates.occlusion import (
    FIRST_CANDIDATE,
    Candidate,
    Diary,
    Occlusion,
    visited,
)

__all__ = ["Nguyen2002"]


SMALLEST_SIDE = 4  # pixels of a template: the coarsest search looks at every fourth
WIDEST_SEARCH = 64  # pixels either way, where a target is looked for after an occlusion
PLACE_NOISE, SCALE_NOISE = (0.5, 0.5, 2.0), (0.002, 0.01, 0.01)
"""Of the smoother: deviations of acceleration, of a measurement, of the velocity at the start."""


class Nguyen2002Parameters(Parameters):
    """Parameters of `Nguyen2002`."""

    features: Features = choice(
        "invariants",
        "what a template holds of a pixel: ratios of colours (c1, c2, c3), their arc "
        "tangents (both blind to what is grey), R, G and B, or R + G + B",
    )
    delta: float = Field(
        0.99, gt=0.0, lt=1.0, description="δ: share of residuals that are inliers [fraction]"
    )
    gamma: float = Field(
        0.25, gt=0.0, lt=1.0, description="γ: more outliers than this are an occlusion [fraction]"
    )
    minimal_speed: float = Field(
        0.05,
        gt=0.0,
        le=1.0,
        description="κ of the slowest occlusion; n_omax is γ / κ [template widths/frame]",
    )
    outlier_rule: Literal["exceeds", "reaches"] = choice(
        "exceeds", "when a pixel's outliers in succession are too many: beyond n_omax"
    )
    longest_occlusion: int = whole(
        35, "L: longest occlusion looked through [frames]", FIRST_CANDIDATE, 1000
    )
    candidates: Literal["skipped", "all"] = choice(
        "skipped",
        "frames that may end an occlusion: 5, 7, 11, 19, 35 and so on after its "
        "beginning, or all from 5",
    )
    average: int = whole(10, "K: residuals' covariances that are averaged [frames]")
    search_range: int = Field(
        16, ge=4, le=256, multiple_of=4, description="the search goes so far either way [pixels]"
    )
    subpixel: bool = choice(True, "whether it goes on in fractions of a pixel")
    ties: Ties = choice(
        "unchanged", "of scales that fit equally well the smallest is taken, or the unchanged one"
    )
    misregistration: bool = choice(
        True, "whether the first covariance makes up for the search's finest step"
    )
    consistency: bool = choice(
        True, "whether covariances of inliers make up for what the gate cut off"
    )
    norm: Literal["huber", "quadratic"] = choice("huber", "ρ of the matching error")
    covariance: Literal["full", "diagonal"] = choice(
        "full", "whether a pixel's components are taken to be correlated"
    )
    adaptive_noise: bool = choice(True, "whether C_w follows the residuals, or stays 0")
    gate: bool = choice(True, "whether outliers are kept out of the template")
    rebootstrap: bool = choice(
        True, "whether a pixel that was an outlier for too long is taken as it is"
    )
    reinitialise: Literal["bootstrap", "keep"] = choice(
        "bootstrap", "after an occlusion the noise is learnt anew, or kept from the beginning"
    )
    report: Literal["smoothed", "raw"] = choice(
        "smoothed", "whether boxes are the smoothed or the matched places"
    )
    first_spread: float = positive(
        0.25, "deviation of the first residuals, in the template's own deviations [ratio]"
    )
    first_covariance: Literal["all", "inliers"] = Field(
        "inliers",
        exclude_if=lambda value: value == "inliers",  # as runs were that don't name it
        description="pixels that R(1) is of: all, or inliers, told six times over",
    )
    end: Literal["minimum", "first"] = choice(
        "minimum",
        "where an occlusion ends: at the candidate of least cost, or at the first one "
        "with few outliers",
    )
    accept: float = fraction(0.5, "most outliers of such a first one [fraction]")


class Nguyen2002(SharingTracker):
    """A template of per-pixel robust adaptive Kalman filters.

    Each pixel of the first box holds d features, which a Kalman filter of its own smooths; all
    share their covariances. In each frame the template goes, by translation and scale, to where the
    sum of Huber's function of the residuals' Mahalanobis distances is least (equations 1 to 4), by
    a search from coarse to fine around where a filter of constant velocity expects it. A pixel
    whose residual is beyond the δ quantile of χ² is an outlier: its filter stands still, and after
    n_omax such frames it is taken as it is (equation 11). The covariance of the others' residuals,
    averaged over K frames, says how far residuals may go and how much the template's noise
    must be for them (equations 12 to 15).

    More than γ outliers are a severe occlusion. Then nothing is updated. The frozen template is
    matched with frames 5, 7, 11, 19, 35 and so on after the beginning, up to L; that of least
    cost is the end, however large its cost is, where the template is taken anew. So the end is
    known only L frames after the beginning. Until then boxes are extrapolated and the target is
    not visible; then `Estimate.revised` gives the frames since the beginning: interpolated up
    to the end, matched after it. A sequence that ends before is revised when it is over
    (`finish`). `end=first` takes the first candidate with few outliers, without looking ahead.

    `as-written` is the text, where it has gaps with decisions: K = 10, L = 35 (the last number
    printed), the range and the steps of the search, the smoother's noise, and the covariance of
    the very first match (`first_spread`). "Exceeds" n_omax is taken literally. R(1), from which
    all noise follows (equation 15), is the covariance of all pixels: before there is an R there
    are no outliers (`first_covariance`).
    `recommended` trims it to inliers, goes on in fractions of a pixel, keeps the scale where others
    fit as well (`ties`; on clips made for tests the smallest of them shrank the template in time),
    and corrects covariances for the search's step (`misregistration`) and the gate (`consistency`).
    `robust` (RGB, γ = 0.4, `end=first`) is post hoc. Ratios are guarded against
    division by zero: a largest value of 0 counts as one grey level. Covariances are kept off
    singularity by raising their least eigenvalues; nothing is added to the others. Scales stay
    between 0.5 and 2.

    In whole pixels (`as-written`) an even side has its centre between two, and the search puts it
    on one of them: pixels are taken half a pixel to the right of or below the box that is said.
    Views that a template begins with are interpolated at its pose, also after an occlusion.

    Places are not bounded: outside the image its rim continues, so that a template may run off it,
    fit a constant rim of its own and be called visible without outliers. Ratios are blind to grey
    targets and grey video, where all are equal: `features=intensity` is to be used. With skipped
    candidates `longest_occlusion` counts only up to the last of 5, 7, 11, 19, 35, 67 and so on that
    it reaches. An occlusion that begins fewer than 5 frames before the sequence's end stays open.

    Details: `outliers` (share, of the last frame that was compared), `occluded` (0 or 1),
    `state_noise`, `measurement_noise` and `residual` (traces of C_w, C_f and R̄, in squared
    units of the features; of a view that is the first, nothing is known but R̄, and the others are
    0), `cost` (of the last match), `revision` (frames revised now); frames in which occlusions
    began and ended, in order and one of each a frame (`beginning`, `end`; NaN for none: several
    may be found at once), how many have ended so far (`ended`), and where an open one would end
    by now (`candidate`; NaN for none).
    """

    paper = (
        "H. T. Nguyen, A. W. M. Smeulders, Template tracking using color invariant pixel "
        "features, ICIP 2002"
    )
    presets = {
        "as-written": {
            "first_covariance": "all",
            "subpixel": False,
            "ties": "ascending",
            "misregistration": False,
            "consistency": False,
        },
        "recommended": {},
        "robust": {"features": "rgb", "gamma": 0.4, "end": "first"},
    }
    Parameters = Nguyen2002Parameters
    _watched = 0

    def watch(self, image: Image) -> None:
        """Count a frame before the target is there: `Estimate.revised` counts it, too."""
        self._watched += 1

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`.

        Raises TrackerError where the box is smaller than 4 pixels either way, or its centre outside
        the image.
        """
        settings = self.parameters
        self._width, self._height = (max(1, floor(side + 0.5)) for side in box[2:])
        rows, columns = frame.image.shape[:2]
        x, y = float(box[0] + box[2] / 2 - 0.5), float(box[1] + box[3] / 2 - 0.5)
        inside = -0.5 < x < columns - 0.5 and -0.5 < y < rows - 0.5
        if min(self._width, self._height) < SMALLEST_SIDE or not inside:
            raise TrackerError(
                f"nguyen2002: a template has {SMALLEST_SIDE} pixels or more either way and its "
                f"centre in the image; the box {np.round(box, 1).tolist()} is none."
            )
        self._size = np.array([box[2], box[3]])
        self._shape = rows, columns
        self._noise = self._noise_of(dimension(settings.features))
        self._pose = Pose(x, y, 1.0)
        self._appearance = Appearance(self._noise, self._view(frame.image, self._pose))
        self._restart(self._pose, (0.0, 0.0, 0.0))
        self._frame, self._watched = self._watched, 0
        self._occlusion: Occlusion | None = None
        self._diary = Diary()
        self._share, self._cost = 0.0, 0.0

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`; raises TrackerError for a frame of another size than the first."""
        if frame.image.shape[:2] != self._shape:
            rows, columns = self._shape
            raise TrackerError(
                f"nguyen2002: a frame of {frame.image.shape[1]}x{frame.image.shape[0]} pixels "
                f"after one of {columns}x{rows}; frames of a sequence are of one size."
            )
        self._frame += 1
        revised: dict[int, Box] = {}
        pose = self._advance(frame.image, self._frame, revised)
        revised.pop(self._frame, None)
        if self._occlusion is not None:  # the caller may write the next frame over this one
            self._occlusion.images[-1] = frame.image.copy()
        appearance = self._appearance
        return Estimate(
            self._box(pose),
            visible=self._occlusion is None,
            details={
                "outliers": self._share,
                "occluded": float(self._occlusion is not None),
                "state_noise": float(np.trace(appearance.state)),
                "measurement_noise": float(np.trace(appearance.measurement)),
                "residual": float(np.trace(appearance.residual)),
                "cost": self._cost,
                "revision": float(len(revised)),
                **self._diary.told(),
                "candidate": float(self._occlusion.ends_by_now) if self._occlusion else nan,
            },
            revised=revised or None,
        )

    def finish(self) -> Mapping[int, Box]:
        """Boxes of an occlusion that the sequence's end cut short; see `trackers.Finisher`."""
        revised: dict[int, Box] = {}
        while self._occlusion is not None and self._occlusion.candidates:
            self._resolve(self._occlusion, revised)
        return revised

    def _noise_of(self, d: int) -> Noise:
        from scipy.special import chdtr, chdtri

        settings = self.parameters
        limit = float(chdtri(d, 1 - settings.delta))
        factor = 1.0
        if settings.consistency and settings.gate:
            factor = settings.delta / float(chdtr(d + 2, limit))
        most = round(settings.gamma / settings.minimal_speed, 9)  # 0.3 / 0.05 is less than 6
        patience = floor(most) + 1 if settings.outlier_rule == "exceeds" else ceil(most)
        finest_step = 0.25 if settings.subpixel else 1.0
        return Noise(
            limit=limit,
            floor=FLOORS[settings.features],
            factor=factor,
            first_spread=settings.first_spread,
            trimmed=settings.first_covariance == "inliers",
            grid_step=finest_step if settings.misregistration else 0.0,
            average=settings.average,
            full=settings.covariance == "full",
            adaptive=settings.adaptive_noise,
            gate=settings.gate,
            patience=patience if settings.rebootstrap else np.iinfo(np.int64).max,
        )

    def _advance(self, image: Image, frame: int, revised: dict[int, Box]) -> Pose:
        """See the next frame, or see it again after an occlusion has ended before it."""
        if self._occlusion is not None:
            return self._look_through(self._occlusion, image, frame, revised)
        around = Pose(*(smoother.predicted() for smoother in self._smoothers))
        match, features = self._match(image, around, self.parameters.search_range)
        first = not self._appearance.started
        if first:
            self._appearance.start(features)
        seen = self._appearance.seen(features)
        self._share, self._cost = seen.share, match.cost
        if seen.share > self.parameters.gamma:
            x, y, _ = self._smoothers
            self._occlusion = Occlusion(frame, self._pose, (x.velocity, y.velocity))
            self._diary.begins(frame)
            return self._look_through(self._occlusion, image, frame, revised)
        self._take(match.pose, seen, first=first)
        return self._pose

    def _take(self, pose: Pose, seen: Seen, *, first: bool) -> None:
        """Update template and place by what was seen of the target."""
        self._appearance.update(seen, first=first)
        for smoother, value in zip(self._smoothers, pose, strict=True):
            smoother.measure(value)
        self._pose = pose
        if self.parameters.report == "smoothed":
            self._pose = Pose(*(smoother.value for smoother in self._smoothers))

    def _look_through(
        self, occlusion: Occlusion, image: Image, frame: int, revised: dict[int, Box]
    ) -> Pose:
        """Remember a frame of an occlusion; at the last that counts, find where it ended."""
        settings = self.parameters
        occlusion.images.append(image)
        offset = frame - occlusion.beginning
        if offset in self._offsets:
            candidate = self._examined(occlusion, image, offset)
            occlusion.candidates.append(candidate)
            at_once = settings.end == "first" and candidate.share <= settings.accept
            if at_once:
                occlusion.candidates = [candidate]
            if at_once or offset == self._offsets[-1]:
                return self._resolve(occlusion, revised)
        return occlusion.extrapolated(frame)

    @property
    def _offsets(self) -> list[int]:
        return visited(self.parameters.longest_occlusion, self.parameters.candidates)

    def _examined(self, occlusion: Occlusion, image: Image, offset: int) -> Candidate:
        """Match the frozen template with a frame."""
        around = occlusion.extrapolated(occlusion.beginning + offset)
        search_range = min(self.parameters.search_range + 2 * offset, WIDEST_SEARCH)
        match, features = self._match(image, around, search_range)
        return Candidate(offset, match, self._appearance.seen(features).share)

    def _resolve(self, occlusion: Occlusion, revised: dict[int, Box]) -> Pose:
        """End an occlusion at its best candidate, and track on from there."""
        end = occlusion.best
        pose = end.match.pose
        steps = end.offset + 1
        for step in range(1, steps):
            way = [a + step / steps * (b - a) for a, b in zip(occlusion.last, pose, strict=True)]
            revised[occlusion.beginning + step - 1] = self._box(Pose(*way))
        ended = occlusion.beginning + end.offset
        self._diary.ends(ended)
        revised[ended] = self._box(pose)
        features = self._view(occlusion.images[end.offset], pose)
        if self.parameters.reinitialise == "bootstrap":
            self._appearance = Appearance(self._noise, features)
        else:
            self._appearance.take_keeping_noise(features)
        velocity = [(b - a) / steps for a, b in zip(occlusion.last, pose, strict=True)]
        self._restart(pose, (velocity[0], velocity[1], velocity[2]))
        self._occlusion, self._pose = None, pose
        self._share, self._cost = end.share, end.match.cost
        for frame, image in enumerate(occlusion.images[end.offset + 1 :], ended + 1):
            pose = self._advance(image, frame, revised)
            revised[frame] = self._box(pose)
        return pose

    def _restart(self, pose: Pose, velocity: tuple[float, float, float]) -> None:
        noises = (PLACE_NOISE, PLACE_NOISE, SCALE_NOISE)
        self._smoothers = [
            Smoother(value, speed, *noise)
            for value, speed, noise in zip(pose, velocity, noises, strict=True)
        ]

    def _match(self, image: Image, around: Pose, search_range: int) -> tuple[Match, Array]:
        """Find the template in a frame (equation 4), and view it there."""
        settings = self.parameters
        window = self._window(image, around, search_range)
        match = search(
            window,
            self._appearance.template,
            self._appearance.residual,
            around,
            search_range,
            sqrt(self._noise.limit) if settings.norm == "huber" else inf,
            settings.subpixel,
            settings.ties,
        )
        shape = self._height, self._width
        return match, sampled(window, match.pose, *shape, settings.subpixel)

    def _view(self, image: Image, pose: Pose) -> Array:
        """The first view of a template."""
        return sampled(self._window(image, pose, 0), pose, self._height, self._width, True)

    def _window(self, image: Image, pose: Pose, search_range: int) -> Window:
        rows, columns = self._shape
        shape = self._height, self._width
        left, top, right, bottom = reach(pose, search_range, shape, rows, columns)
        features = features_of(image[top:bottom, left:right], self.parameters.features)
        return Window(features, left, top, rows, columns)

    def _box(self, pose: Pose) -> Box:
        """Box in our coordinates, where pixel centres are halves."""
        size = self._size * pose.scale
        return np.concatenate([np.array([pose.x + 0.5, pose.y + 0.5]) - size / 2, size])
