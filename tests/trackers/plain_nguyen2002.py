"""The method of Nguyen and Smeulders in plain NumPy, equation by equation.

Features and search are in `plain_matching`. Written down from the text and not from the tracker's
code, with which it shares its parameters and the Kalman filter of a place alone: boxes must be the
same. `track_offline` looks ahead as the paper does. Images are BGR, boxes are in coordinates where
pixel centres are halves; features have the shape (rows, columns, d).
"""

from math import floor, inf, sqrt
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from tests.trackers.plain_matching import Pose, features_of, match, sample
from trackmark.trackers import resolve
from trackmark.trackers.base import kalman

Parameters = resolve("nguyen2002").plugin.Parameters

FLOORS = {"intensity": 3.0, "rgb": 1.0, "invariants": 1e-4, "arctan": 1e-4}
"""Least variances of residuals."""


class Settings:
    """The tracker's parameters, and what follows from them."""

    def __init__(self, **parameters):
        self.given = Parameters(**parameters)

    def __getattr__(self, name):
        return getattr(self.given, name)

    @property
    def d(self):
        """Number of components of a feature."""
        return 1 if self.features == "intensity" else 3

    @property
    def floor(self):
        """Least variance of a residual."""
        return FLOORS[self.features]

    @property
    def limit(self):
        """χ² from which on a pixel is an outlier."""
        return chi2.ppf(self.delta, self.d)

    @property
    def cutoff(self):
        """Limit c above which Huber's function is linear."""
        return sqrt(self.limit) if self.norm == "huber" else inf

    @property
    def consistency_factor(self):
        """Factor of a covariance of inliers."""
        if not (self.consistency and self.gate):
            return 1.0
        return self.delta / chi2.cdf(self.limit, self.d + 2)

    @property
    def step(self):
        """Finest step of the search [pixels]."""
        return 0.25 if self.subpixel else 1.0

    @property
    def offsets(self):
        """Frames after an occlusion's beginning that are matched."""
        if self.candidates == "all":
            return list(range(5, self.longest_occlusion + 1))
        doubling = [5 + 2**n - 2 for n in range(1, 12)]
        return [offset for offset in doubling if offset <= self.longest_occlusion]

    def too_long(self, count):
        """Return whether a pixel, an outlier for too many frames, replaces its template value."""
        longest = round(self.gamma / self.minimal_speed, 9)  # 0.3 / 0.05 comes to less than 6
        if not self.rebootstrap:
            return False
        return count > longest if self.outlier_rule == "exceeds" else count >= longest


def raise_eigenvalues(matrix, least):
    """The matrix made symmetric, with its eigenvalues raised to the least allowed."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    return vectors @ np.diag(np.maximum(values, least)) @ vectors.T


class Appearance:
    """Template g and all that is known of its noise (equations 5 to 15).

    A filter for each pixel, with the same covariances; `n_o` counts frames in succession for which
    a pixel has been an outlier, `r` holds R of all frames since the second one that was seen.
    """

    def __init__(self, settings, features):
        self._settings = settings
        self.g = features.copy()
        self.n_o = np.zeros(features.shape[:2], int)
        spread = settings.first_spread**2 * self.g.reshape(-1, settings.d).var(axis=0)
        self.r_bar = np.diag(np.maximum(spread, settings.floor))
        self.c_f = self.c_w = self.c_g = np.zeros((settings.d, settings.d))
        self.r = []

    def outliers(self, features, covariance):
        """Return a mask of the pixels whose residuals are too large."""
        r = features - self.g
        q = np.einsum("ijk,km,ijm->ij", r, np.linalg.inv(covariance), r)
        return ~(q < self._settings.limit)

    def residual_covariance(self, features, covariance):
        """R of equation 13, over the pixels that are inliers by another covariance."""
        updated = np.full(self.n_o.shape, True)
        if self._settings.gate:
            updated = ~self.outliers(features, covariance)
        if not updated.any():
            return covariance
        r = (features - self.g)[updated]
        return self._shaped(r.T @ r / len(r) * self._settings.consistency_factor)

    def begin(self, features):
        """Learn R(1) from what is seen second (equation 15)."""
        settings = self._settings
        r = (features - self.g).reshape(-1, settings.d)
        r1 = self._shaped(r.T @ r / len(r))
        if settings.first_covariance == "inliers":
            r1 = self.r_bar
            for _ in range(6):
                r1 = self.residual_covariance(features, r1)
        if settings.misregistration:
            down, across = np.gradient(self.g, axis=(0, 1))
            both = np.einsum("ijk,ijm->km", down, down) + np.einsum("ijk,ijm->km", across, across)
            r1 = self._shaped(r1 + settings.step**2 / 6 * both / self.n_o.size)
        self._know(r1)

    def begin_as_known(self, before):
        """Take R(1) and the measurement noise of an earlier template."""
        self._know(before.r[0])

    def _know(self, r1):
        self.r, self.r_bar = [r1], r1
        self.c_f, self.c_g, self.c_w = 0.5 * r1, 0.5 * r1, np.zeros_like(r1)

    def share(self, features):
        """Share of outliers (equation 16)."""
        return float(self.outliers(features, self.r_bar).mean())

    def update(self, features):
        """Equations 7 to 14, for any view after the one of `begin`."""
        outliers = self.outliers(features, self.r_bar)
        self.r.append(self.residual_covariance(features, self.r_bar))
        last = self.r[-self._settings.average :]
        self.r_bar = sum(last) / len(last)
        if self._settings.adaptive_noise:
            self.c_w = raise_eigenvalues(self.r_bar - self.c_f - self.c_g, 0.0)
        self._filter(features, outliers)

    def update_first(self, features):
        """Equations 7 to 11 for the view of `begin`: R is known, and C_w is 0."""
        self._filter(features, self.outliers(features, self.r_bar))

    def _filter(self, features, outliers):
        if not self._settings.gate:
            outliers = np.full(outliers.shape, False)
        predicted = self.c_g + self.c_w
        gain = predicted @ np.linalg.inv(predicted + self.c_f)
        self.c_g = raise_eigenvalues(predicted - gain @ predicted, 0.0)
        for pixel in np.ndindex(outliers.shape):
            if not outliers[pixel]:
                self.g[pixel] += gain @ (features[pixel] - self.g[pixel])
                self.n_o[pixel] = 0
                continue
            self.n_o[pixel] += 1
            if self._settings.too_long(int(self.n_o[pixel])):
                self.g[pixel] = features[pixel]
                self.n_o[pixel] = 0

    def _shaped(self, covariance):
        if self._settings.covariance == "diagonal":
            covariance = np.diag(np.diag(covariance))
        return raise_eigenvalues(covariance, self._settings.floor)


class ScalarSmoother:
    """The Kalman filter of a pose with its velocity (see `test_kalman`).

    The pose that it begins with is as good as a measurement.
    """

    # Deviations of acceleration, measurement and speed at the start, of place and scale.
    PLACE, SCALE = (0.5, 0.5, 2.0), (0.002, 0.01, 0.01)

    def __init__(self, pose, velocity):
        noises = self.PLACE, self.PLACE, self.SCALE
        parts = zip(pose, velocity, noises, strict=True)
        self._filters = [
            kalman.ScalarSmoother(value, speed, *noise) for value, speed, noise in parts
        ]

    @property
    def pose(self):
        """Smoothed pose of the last frame measured."""
        return Pose(*(axis_filter.value for axis_filter in self._filters))

    @property
    def velocity(self):
        """Its change a frame."""
        return Pose(*(axis_filter.velocity for axis_filter in self._filters))

    def predicted(self):
        """Pose to expect in the next frame."""
        return Pose(*(axis_filter.predicted() for axis_filter in self._filters))

    def measure(self, pose):
        """Take the next frame's measured pose into account."""
        for axis_filter, value in zip(self._filters, pose, strict=True):
            axis_filter.measure(value)


class Candidate(NamedTuple):
    """Return the best pose in a frame that may end an occlusion."""

    pose: Pose
    cost: float
    share: float


class Target:
    """The target of a first box: its template, its place, and the steps of tracking it.

    `last` is the pose reported for the last frame in which it was followed.
    """

    def __init__(self, settings, image, box):
        self._settings = settings
        self._size = box[2:].copy()
        self._width, self._height = (floor(side + 0.5) for side in box[2:].tolist())
        x, y = (box[:2] + box[2:] / 2 - 0.5).tolist()
        self.last = Pose(x, y, 1.0)
        self._smoother = ScalarSmoother(self.last, Pose(0.0, 0.0, 0.0))
        self.appearance = Appearance(settings, self._view(self._features(image), self.last, True))

    def follow(self, image):
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

    def extrapolated(self, frames):
        """Pose so many frames after the last, had the target gone on as it went."""
        velocity = self._smoother.velocity
        return Pose(
            self.last.x + frames * velocity.x, self.last.y + frames * velocity.y, self.last.scale
        )

    def look(self, image, n):
        """Match the frozen template with the frame n after an occlusion's beginning."""
        features = self._features(image)
        search_range = min(self._settings.search_range + 2 * n, 64)
        pose, cost = self._match(features, self.extrapolated(n + 1), search_range)
        seen = self._view(features, pose, self._settings.subpixel)
        return Candidate(pose, cost, self.appearance.share(seen))

    def interpolated(self, pose, n):
        """Poses of the n frames of an occlusion that is over with this pose."""
        start, end = np.array(self.last), np.array(pose)
        return [Pose(*(start + (end - start) * i / (n + 1)).tolist()) for i in range(1, n + 1)]

    def take_again(self, image, pose, n):
        """Initialise again at the end of an occlusion, n frames after its beginning."""
        view = self._view(self._features(image), pose, bilinear=True)
        appearance = Appearance(self._settings, view)
        if self._settings.reinitialise == "keep":
            appearance.begin_as_known(self.appearance)
        self.appearance = appearance
        velocity = (np.array(pose) - np.array(self.last)) / (n + 1)
        self._smoother = ScalarSmoother(pose, Pose(*velocity.tolist()))
        self.last = pose

    def box(self, pose):
        """Its box."""
        size = self._size * pose.scale
        return np.concatenate([(pose.x + 0.5, pose.y + 0.5) - size / 2, size])

    def _features(self, image):
        return features_of(image, self._settings.features)

    def _view(self, features, pose, bilinear):
        return sample(features, pose, self._height, self._width, bilinear=bilinear)

    def _match(self, features, around, search_range):
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


def chosen_end(candidates, settings):
    """Frames from an occlusion's beginning to its end, by what was found in some frames."""
    for n, candidate in sorted(candidates.items()):
        if settings.end == "first" and candidate.share <= settings.accept:
            return n
    return min(candidates, key=lambda n: candidates[n].cost)


def track_offline(images, box, **parameters):
    """Track a target through a sequence that is known as a whole, as the paper does.

    Gives boxes (n, 4); first frame and end of each occlusion, the sequence's length where it found
    no end; and the covariances in the end.
    """
    settings = Settings(**parameters)
    target = Target(settings, images[0], box)
    poses, occlusions = [target.last], []
    while (frame := len(poses)) < len(images):
        pose = target.follow(images[frame])
        if pose is not None:
            poses.append(pose)
            continue
        candidates = {
            n: target.look(images[frame + n], n)
            for n in settings.offsets
            if frame + n < len(images)
        }
        if not candidates:
            rest = len(images) - frame
            poses += [target.extrapolated(i) for i in range(1, rest + 1)]
            occlusions.append((frame, len(images)))
            break
        n = chosen_end(candidates, settings)
        end = candidates[n].pose
        poses += [*target.interpolated(end, n), end]
        target.take_again(images[frame + n], end, n)
        occlusions.append((frame, frame + n))
    return np.array([target.box(pose) for pose in poses]), occlusions, target.appearance
