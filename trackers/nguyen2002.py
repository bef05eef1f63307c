"""A template of per-pixel robust adaptive Kalman filters (Nguyen & Smeulders 2002)."""

from collections.abc import Mapping
from math import floor, inf, nan, sqrt
from typing import Literal

import numpy as np

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Box, Estimate, Image, Mask
from trackmark.trackers.base.kalman import ScalarSmoother
from trackmark.trackers.base.parameters import (
    OPTION,
    Parameters,
    TrackerError,
    bounded,
    choice,
    chosen,
    fraction,
    integer,
    positive,
    printed,
)
from trackmark.trackers.base.sharing import SharedFrame, SharingTracker
from trackmark.trackers.templates import appearance, matching
from trackmark.trackers.templates.matching import (
    FeatureWindow,
    Match,
    Pose,
    find_pose,
    move_inside,
    sample_template,
    search_bounds,
)
from trackmark.trackers.templates.occlusion import (
    FIRST_CANDIDATE,
    EndCandidate,
    Occlusion,
    OcclusionLog,
    candidate_offsets,
)

__all__ = ["Nguyen2002"]


MIN_SIDE = 4  # minimum side of a template [pixels]
MAX_SEARCH_RANGE = 64  # search range after an occlusion [pixels]
POSITION_NOISE, SCALE_NOISE = (0.5, 0.5, 2.0), (0.002, 0.01, 0.01)
"""Standard deviations of the smoother: acceleration, measurement, initial velocity."""


class Nguyen2002Parameters(Parameters):
    """Parameters of `Nguyen2002`; the defaults are the values of the preset `as-written`."""

    features: appearance.Features = choice(
        "invariants",
        "features of a pixel: colour ratios (c1, c2, c3), their arc tangents (both constant on "
        "grey pixels), (R, G, B), or R + G + B",
        origin=printed("eq. 18; section 3 also compares (R, G, B) and R + G + B"),
    )
    delta: float = bounded(
        0.99,
        "δ: share of residuals that are inliers [fraction]",
        gt=0.0,
        lt=1.0,
        origin=printed("section 2.1: δ = 0.99"),
    )
    gamma: float = bounded(
        0.25,
        "γ: a larger share of outliers is a severe occlusion [fraction]",
        gt=0.0,
        lt=1.0,
        origin=printed("section 2.4: γ = 25 %"),
    )
    minimal_speed: float = bounded(
        0.05,
        "κ of the slowest occlusion; n_omax is γ / κ [template widths/frame]",
        gt=0.0,
        le=1.0,
        origin=printed("section 2.4: κ = 5 %"),
    )
    outlier_rule: Literal["exceeds", "reaches"] = choice(
        "reaches",
        "a pixel takes its new value if its number of consecutive outliers exceeds n_omax, "
        "or reaches it",
        origin=printed("eq. 11: n_o ≥ n_omax"),
    )
    longest_occlusion: int = integer(
        35,
        "L: maximum duration of an occlusion [frames]",
        FIRST_CANDIDATE,
        1000,
        origin=chosen("L is not printed; 35 is the last frame number that section 2.4 prints"),
    )
    candidates: Literal["skipped", "all"] = choice(
        "skipped",
        "frames that may end an occlusion: 5, 7, 11, 19, 35 and so on after its beginning, or "
        "all from 5 on",
        origin=printed("section 2.4: 5, 7, 11, 19, 35 etc."),
    )
    average: int = integer(
        10,
        "K: number of frames over which the residuals' covariance is averaged [frames]",
        origin=chosen("K of eq. 12 is not printed; about half a second"),
    )
    search_range: int = bounded(
        16,
        "maximum translation in the search, per axis and direction [pixels]",
        ge=4,
        le=256,
        multiple_of=4,
        origin=chosen("the range of the search is not printed; four steps of 4 pixels"),
    )
    subpixel: bool = choice(
        False,
        "whether the search continues in fractions of a pixel",
        origin=chosen("section 2.1: quantized parameter space, without a step; a pixel"),
    )
    norm: Literal["huber", "quadratic"] = choice(
        "huber", "ρ of the cost: Huber's function or the square", origin=printed("eq. 3")
    )
    covariance: Literal["full", "diagonal"] = choice(
        "full",
        "whether the components of a pixel's features are treated as correlated",
        origin=printed("eq. 13: R is a full matrix"),
    )
    adaptive_noise: bool = choice(
        True,
        "whether C_w is estimated from the residuals; otherwise it is 0",
        origin=printed("eq. 14"),
    )
    gate: bool = choice(
        True,
        "whether outliers are excluded from template updates",
        origin=printed("eq. 11"),
    )
    rebootstrap: bool = choice(
        True,
        "whether a pixel takes its new value after too many consecutive outliers",
        origin=printed("eq. 11"),
    )
    reinitialise: Literal["bootstrap", "keep"] = choice(
        "bootstrap",
        "noise after an occlusion: estimated again, or kept from the first frames",
        origin=chosen("section 2.4 re-initialises the template, without a word on the noise"),
    )
    report: Literal["smoothed", "raw"] = choice(
        "smoothed",
        "returned boxes: smoothed or matched positions",
        origin=printed("section 2.1: the solution of eq. 4 is further smoothed"),
    )
    first_spread: float = positive(
        0.25,
        "standard deviation of the first residuals / that of the template's features [ratio]",
        origin=chosen("eq. 4 needs R in the second frame, before eq. 12 defines it"),
    )
    first_covariance: Literal["all", "inliers"] = choice(
        "all",
        "pixels that determine R(1): all, or inliers, selected in six iterations",
        origin=chosen("eq. 13 averages over inliers, which are only known if R is known"),
    )
    end: Literal["minimum", "first"] = choice(
        "minimum",
        "end of an occlusion: the candidate of minimum cost, or the first candidate with few "
        "outliers",
        origin=printed("section 2.4: the frame with the minimum cost"),
    )
    accept: float = fraction(
        0.5, "maximum share of outliers of such a first candidate [fraction]", origin=OPTION
    )


class Nguyen2002(SharingTracker):
    """A template of per-pixel robust adaptive Kalman filters.

    Each pixel of the init box has d features, which a Kalman filter smooths; all pixels share the
    covariances. In each frame, the template moves to the translation and scale of minimum cost: the
    sum of Huber's function of the residuals' Mahalanobis distances (equations 1 to 4). The search
    goes from coarse to fine, around the prediction of a constant-velocity filter. A pixel whose
    residual exceeds the δ quantile of χ² is an outlier. The filter of an outlier is not updated;
    after n_omax such frames the pixel takes its new value (equation 11). The covariance of the
    inliers' residuals, averaged over K frames, sets the outlier limit and the noise of the template
    (equations 12 to 15).

    More than γ outliers are a severe occlusion, during which nothing is updated. The frozen
    template is matched with frames 5, 7, 11, 19, 35 and so on after the beginning, up to L. The
    frame of minimum cost, however large, is the end of the occlusion; there the template is
    replaced. So the end is only known L frames after the beginning. Until it is known, boxes are
    extrapolated and the target is not visible. `Estimate.revised` then holds the boxes since the
    beginning: interpolated up to the end, matched after it. If the sequence ends earlier, `finish`
    returns them. `end=first` uses the first candidate with few outliers, without waiting for later
    frames.

    `as-written` has the printed equations and numbers; the text does not print K, L, the range and
    the steps of the search, the smoother's noise and the covariance of the first match
    (`first_spread`). R(1), which determines all noise (equation 15), is the covariance of all
    pixels, because outliers can only be found once R is known (`first_covariance`).

    `recommended` differs in two parameters. The number of outliers must exceed n_omax, as the text
    below equation 10 says: with n_omax frames, the slowest occluder would become the template
    before it is detected. And the search continues in fractions of a pixel. In ratios, a maximum of
    0 counts as one grey level. Minimum eigenvalues keep covariances from being singular. Scales
    stay between 0.5 and 2.

    With whole pixels (`as-written`), the centre of a template of even width or height lies between
    two pixels, and the search puts it on one of them. Pixels are then read half a pixel to the
    right of or below the reported box. The first view of a template is interpolated at its pose,
    also after an occlusion.

    Limits: border pixels are repeated outside the image. Ratios are constant on grey targets and
    grey video: use `features=intensity`. With skipped candidates, `longest_occlusion` takes effect
    at 5, 7, 11, 19, 35, 67 and so on only. An occlusion that begins fewer than 5 frames before the
    end of the sequence stays open.

    Details: `outliers` is the share of outliers in the last compared frame, `occluded` is 0 or 1,
    `cost` is the cost of the last match, and `revision` is the number of frames revised in this
    frame. `state_noise`, `measurement_noise` and `residual` are traces of C_w, C_f and R̄, in
    squared units of the features; after a template's first view, only R̄ is known and the others
    are 0. `beginning` and `end` are frames in which occlusions began and ended (NaN for none).
    Several can become known at once; each frame then reports one of them. `ended` is the number of
    ends so far; `candidate` is the frame in which an open occlusion would end (NaN for none).
    """

    paper = (
        "H. T. Nguyen, A. W. M. Smeulders, Template tracking using color invariant pixel "
        "features, ICIP 2002"
    )
    presets = {
        "as-written": {},
        "recommended": {"outlier_rule": "exceeds", "subpixel": True},
    }
    choices = {
        "interpolation of a template's first view": (
            "bilinear",
            "the centre of a template of even size lies between two pixels",
        ),
        "steps of the search in whole pixels [pixels]": (
            matching.TRANSLATION_STEPS,
            "section 2.1: coarse to fine, without steps",
        ),
        "relative steps of the scale": (
            matching.SCALE_STEPS[:2],
            "section 2.1: coarse to fine, without steps; the second halves the first",
        ),
        "steps in fractions of a pixel, with `subpixel`, and their relative steps of the scale": (
            (matching.SUBPIXEL_STEPS, matching.SCALE_STEPS[2:]),
            "each step halves the one before",
        ),
        "number of poses that the second level refines": (
            matching.N_REFINED,
            "the best pose of a coarse grid can be a wrong one",
        ),
        "minimum side of a template [pixels]": (
            MIN_SIDE,
            "eq. 13 needs pixels for a covariance of three components",
        ),
        "pose of equal costs": (
            "smallest scale, then smallest y and x",
            "eq. 4 has no rule; with whole pixels, neighbouring scales can read equal pixels",
        ),
        "limits of the scale": (
            (matching.MIN_SCALE, matching.MAX_SCALE),
            "not printed; they keep a template from vanishing",
        ),
        "positions of a template": (
            "centre in the image",
            "not printed; outside, all pixels of a template can be repeated border pixels",
        ),
        "maximum search range after an occlusion [pixels]": (
            MAX_SEARCH_RANGE,
            "not printed; the range grows by 2 pixels per hidden frame up to this value",
        ),
        "minimum eigenvalues of covariances of residuals": (
            appearance.FLOORS,
            "a singular R has no inverse; values for rounding to whole grey levels",
        ),
        "deviations of the smoother of positions: acceleration, measurement, first velocity": (
            POSITION_NOISE,
            "section 2.1 smooths the solution by a Kalman filter, without numbers [pixels]",
        ),
        "deviations of the smoother of the scale": (
            SCALE_NOISE,
            "section 2.1 smooths the solution by a Kalman filter, without numbers",
        ),
        "negative eigenvalues of C_w and C_g": (
            0.0,
            "eq. 14 is a difference and can be negative definite, which no covariance is",
        ),
        "residuals before a new template's first view": (
            "not in the mean R of eq. 12",
            "section 2.4 re-initialises the template; older residuals belong to the old one",
        ),
        "first frame that may end an occlusion": (
            FIRST_CANDIDATE,
            "section 2.4 begins its frame numbers with 5, but names L frames from t_o on",
        ),
        "count of outliers n_o in eq. 11": (
            "with the current frame",
            "the frames where the pixel is declared an outlier include the current one",
        ),
        "gain K": (
            "C_g (C_g + C_f)⁻¹",
            "the line below eq. 8 prints C_w for both; the gain of eq. 9 and 10 has C_g(t⁻), C_f",
        ),
        "denominator of a ratio of which both channels are 0 [grey levels]": (
            1.0,
            "eq. 18 is not defined for it",
        ),
    }
    Parameters = Nguyen2002Parameters
    _watched = 0

    def watch(self, image: Image) -> None:
        """Count a frame without the target, which frame numbers in `Estimate.revised` include."""
        self._watched += 1

    def init_shared(self, frame: SharedFrame, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`; raise TrackerError if the box is too small or outside the image."""
        parameters = self.parameters
        self._width, self._height = (max(1, floor(side + 0.5)) for side in box[2:])
        rows, columns = frame.image.shape[:2]
        x, y = float(box[0] + box[2] / 2 - 0.5), float(box[1] + box[3] / 2 - 0.5)
        inside = -0.5 < x < columns - 0.5 and -0.5 < y < rows - 0.5
        if min(self._width, self._height) < MIN_SIDE or not inside:
            raise TrackerError(
                f"nguyen2002: the box {np.round(box, 1).tolist()} is too small or outside the "
                f"image. Expected: sides of at least {MIN_SIDE} pixels, and the centre in the "
                "image."
            )
        self._size = np.array([box[2], box[3]])
        self._shape = rows, columns
        self._pose = Pose(x, y, 1.0)
        self._filter = appearance.TemplateFilter(parameters, self._view(frame.image, self._pose))
        self._restart(self._pose, (0.0, 0.0, 0.0))
        self._frame, self._watched = self._watched, 0
        self._occlusion: Occlusion | None = None
        self._occlusion_log = OcclusionLog()
        self._outlier_share, self._cost = 0.0, 0.0

    def update_shared(self, frame: SharedFrame) -> Estimate:
        """See `Tracker.update`; raise TrackerError if the frame size changes."""
        if frame.image.shape[:2] != self._shape:
            rows, columns = self._shape
            raise TrackerError(
                f"nguyen2002: a frame has {frame.image.shape[1]}x{frame.image.shape[0]} pixels, "
                f"the first one {columns}x{rows}. All frames of a sequence must have the same "
                "size."
            )
        self._frame += 1
        revised: dict[int, Box] = {}
        pose = self._advance(frame.image, self._frame, revised)
        revised.pop(self._frame, None)
        if self._occlusion is not None:  # the caller may reuse the image's memory
            self._occlusion.images[-1] = frame.image.copy()
        template_filter = self._filter
        return Estimate(
            self._box(pose),
            visible=self._occlusion is None,
            details={
                "outliers": self._outlier_share,
                "occluded": float(self._occlusion is not None),
                "state_noise": float(np.trace(template_filter.state)),
                "measurement_noise": float(np.trace(template_filter.measurement)),
                "residual": float(np.trace(template_filter.residual)),
                "cost": self._cost,
                "revision": float(len(revised)),
                **self._occlusion_log.next_events(),
                "candidate": float(self._occlusion.current_end) if self._occlusion else nan,
            },
            revised=revised or None,
        )

    def finish(self) -> Mapping[int, Box]:
        """Return the boxes of an occlusion without an end; see `RevisingTracker.finish`."""
        revised: dict[int, Box] = {}
        while self._occlusion is not None and self._occlusion.candidates:
            self._resolve(self._occlusion, revised)
        return revised

    def _advance(self, image: Image, frame: int, revised: dict[int, Box]) -> Pose:
        """Process a new frame, or reprocess a frame after an occlusion whose end is now known."""
        if self._occlusion is not None:
            return self._look_through(self._occlusion, image, frame, revised)
        around = self._inside(Pose(*(smoother.predicted() for smoother in self._smoothers)))
        match, features = self._match(image, around, self.parameters.search_range)
        first = not self._filter.noise_known
        if first:
            self._filter.start(features)
        comparison = self._filter.compare(features)
        self._outlier_share, self._cost = comparison.share, match.cost
        if comparison.share > self.parameters.gamma:
            x, y, _ = self._smoothers
            self._occlusion = Occlusion(frame, self._pose, (x.velocity, y.velocity))
            self._occlusion_log.record_beginning(frame)
            return self._look_through(self._occlusion, image, frame, revised)
        self._take(match.pose, comparison, is_first=first)
        return self._pose

    def _take(
        self, pose: Pose, comparison: appearance.TemplateComparison, *, is_first: bool
    ) -> None:
        """Update the template and the pose."""
        self._filter.update(comparison, is_first=is_first)
        for smoother, value in zip(self._smoothers, pose, strict=True):
            smoother.measure(value)
        self._pose = pose
        if self.parameters.report == "smoothed":
            self._pose = self._inside(Pose(*(smoother.value for smoother in self._smoothers)))

    def _look_through(
        self, occlusion: Occlusion, image: Image, frame: int, revised: dict[int, Box]
    ) -> Pose:
        """Store a frame of an occlusion; at the last candidate, determine the occlusion's end."""
        parameters = self.parameters
        occlusion.images.append(image)
        offset = frame - occlusion.beginning
        if offset in self._offsets:
            candidate = self._examine(occlusion, image, offset)
            occlusion.candidates.append(candidate)
            at_once = parameters.end == "first" and candidate.share <= parameters.accept
            if at_once:
                occlusion.candidates = [candidate]
            if at_once or offset == self._offsets[-1]:
                return self._resolve(occlusion, revised)
        return self._inside(occlusion.extrapolate(frame))

    @property
    def _offsets(self) -> list[int]:
        return candidate_offsets(self.parameters.longest_occlusion, self.parameters.candidates)

    def _examine(self, occlusion: Occlusion, image: Image, offset: int) -> EndCandidate:
        """Match the frozen template with a frame; return the frame as a candidate."""
        around = self._inside(occlusion.extrapolate(occlusion.beginning + offset))
        search_range = min(self.parameters.search_range + 2 * offset, MAX_SEARCH_RANGE)
        match, features = self._match(image, around, search_range)
        return EndCandidate(offset, match, self._filter.compare(features).share)

    def _resolve(self, occlusion: Occlusion, revised: dict[int, Box]) -> Pose:
        """End an occlusion at its best candidate, and process the frames since then again."""
        end = occlusion.best
        pose = end.match.pose
        steps = end.offset + 1
        for step in range(1, steps):
            way = [a + step / steps * (b - a) for a, b in zip(occlusion.last, pose, strict=True)]
            revised[occlusion.beginning + step - 1] = self._box(Pose(*way))
        ended = occlusion.beginning + end.offset
        self._occlusion_log.record_end(ended)
        revised[ended] = self._box(pose)
        features = self._view(occlusion.images[end.offset], pose)
        if self.parameters.reinitialise == "bootstrap":
            self._filter = appearance.TemplateFilter(self.parameters, features)
        else:
            self._filter.reset_keeping_noise(features)
        velocity = [(b - a) / steps for a, b in zip(occlusion.last, pose, strict=True)]
        self._restart(pose, (velocity[0], velocity[1], velocity[2]))
        self._occlusion, self._pose = None, pose
        self._outlier_share, self._cost = end.share, end.match.cost
        for frame, image in enumerate(occlusion.images[end.offset + 1 :], ended + 1):
            pose = self._advance(image, frame, revised)
            revised[frame] = self._box(pose)
        return pose

    def _restart(self, pose: Pose, velocity: tuple[float, float, float]) -> None:
        noises = (POSITION_NOISE, POSITION_NOISE, SCALE_NOISE)
        self._smoothers = [
            ScalarSmoother(value, speed, *noise)
            for value, speed, noise in zip(pose, velocity, noises, strict=True)
        ]

    def _match(self, image: Image, around: Pose, search_range: int) -> tuple[Match, Array]:
        """Return the template's pose in a frame (equation 4), and the frame's features there."""
        parameters = self.parameters
        window = self._window(image, around, search_range)
        match = find_pose(
            window,
            self._filter.template,
            self._filter.residual,
            around,
            search_range,
            sqrt(self._filter.limit) if parameters.norm == "huber" else inf,
            parameters.subpixel,
        )
        shape = self._height, self._width
        return match, sample_template(window, match.pose, *shape, parameters.subpixel)

    def _view(self, image: Image, pose: Pose) -> Array:
        """Return the features of a new template, interpolated at its pose."""
        return sample_template(self._window(image, pose, 0), pose, self._height, self._width, True)

    def _window(self, image: Image, pose: Pose, search_range: int) -> FeatureWindow:
        rows, columns = self._shape
        shape = self._height, self._width
        left, top, right, bottom = search_bounds(pose, search_range, shape, rows, columns)
        features = appearance.compute_features(
            image[top:bottom, left:right], self.parameters.features
        )
        return FeatureWindow(features, left, top, rows, columns)

    def _inside(self, pose: Pose) -> Pose:
        return move_inside(pose, *self._shape)

    def _box(self, pose: Pose) -> Box:
        """Return the box of a pose, in coordinates with pixel centres at 0.5, 1.5 and so on."""
        size = self._size * pose.scale
        return np.concatenate([np.array([pose.x + 0.5, pose.y + 0.5]) - size / 2, size])
