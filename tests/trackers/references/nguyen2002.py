"""Tracker `nguyen2002` in plain NumPy, equation by equation.

It follows the paper's text and shares with the tracker only the parameters and the Kalman filter of
a scalar. `track_offline` reads later frames, as the paper does. Images are BGR. Features have the
shape (rows, columns, d). Boxes are in coordinates where pixel centres are at halves.
"""

from math import floor, inf, sqrt
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from trackmark.trackers import resolve
from trackmark.trackers.base import kalman


def features_of(image, kind):
    """Return features: intensity, RGB, the ratios c1 to c3 of equation 18, or their arc tangents.

    A divisor of 0 counts as 1.
    """
    blue, green, red = np.moveaxis(image.astype(np.float64), 2, 0)
    if kind == "intensity":
        return (red + green + blue)[:, :, np.newaxis]
    if kind == "rgb":
        return np.stack([red, green, blue], axis=2)
    both = (red, green, blue), (green, blue, red), (blue, red, green)
    ratios = [channel / np.maximum(np.maximum(*others), 1.0) for channel, *others in both]
    return np.arctan(np.stack(ratios, axis=2)) if kind == "arctan" else np.stack(ratios, axis=2)


class Pose(NamedTuple):
    """Parameters a of equation 1: the template's centre (pixel centres at integers) and scale."""

    x: float
    y: float
    scale: float


def inside(pose, rows, columns):
    """Return the pose with its centre on the nearest position between the border pixels."""
    x, y = np.clip([pose.x, pose.y], 0, [columns - 1, rows - 1]).tolist()
    return Pose(x, y, pose.scale)


def sample(features, pose, height, width, *, bilinear):
    """Return features at φ(p; a) for the template's pixels."""
    rows, columns = features.shape[:2]
    x = pose.x + pose.scale * (np.arange(width) - (width - 1) / 2)
    y = pose.y + pose.scale * (np.arange(height) - (height - 1) / 2)
    x, y = np.clip(x, 0, columns - 1), np.clip(y, 0, rows - 1)
    if not bilinear:
        return features[np.ix_(np.floor(y + 0.5).astype(int), np.floor(x + 0.5).astype(int))]
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    right, bottom = np.minimum(left + 1, columns - 1), np.minimum(top + 1, rows - 1)
    u, v = (x - left)[np.newaxis, :, np.newaxis], (y - top)[:, np.newaxis, np.newaxis]
    upper = (1 - u) * features[np.ix_(top, left)] + u * features[np.ix_(top, right)]
    lower = (1 - u) * features[np.ix_(bottom, left)] + u * features[np.ix_(bottom, right)]
    return (1 - v) * upper + v * lower


def huber(error, cutoff):
    """Return ρ of equation 3."""
    with np.errstate(invalid="ignore"):  # an infinite cutoff times an error of 0
        return np.where(error < cutoff, error**2 / 2, cutoff * (error - cutoff / 2))


def matching_cost(features, template, inverse, pose, cutoff, *, bilinear):
    """Return the sum of equation 4."""
    r = sample(features, pose, *template.shape[:2], bilinear=bilinear) - template
    squared = np.einsum("...k,km,...m->...", r, inverse, r)
    return float(huber(np.sqrt(np.maximum(squared, 0)), cutoff).sum())


def match(features, template, covariance, around, search_range, cutoff, *, subpixel):
    """Return the pose of the least cost with its centre in the image, and its cost."""
    rows, columns = features.shape[:2]
    inverse = np.linalg.inv(covariance)

    def best(poses, number, *, bilinear=False):
        rated = []
        for pose in poses:
            if inside(pose, rows, columns) != pose:
                continue
            held = pose._replace(scale=min(max(pose.scale, 0.5), 2.0))
            cost = matching_cost(features, template, inverse, held, cutoff, bilinear=bilinear)
            rated.append((cost, held))
        return sorted(rated, key=lambda rating: rating[0])[:number]  # stable: the first of equals

    centre = Pose(floor(around.x + 0.5), floor(around.y + 0.5), around.scale)
    actual = best(grid(centre, search_range, 4), 3)
    actual = best([pose for _, coarse in actual for pose in grid(coarse, 2, 2)], 1)
    for spread in (0.02, 0.01):
        actual = best(grid(actual[0][1], 1, 1, spread), 1)
    if subpixel:
        for step, spread in ((0.5, 0.01), (0.25, 0.005)):
            actual = best(grid(actual[0][1], step, step, spread), 1, bilinear=True)
    cost, pose = actual[0]
    return pose, cost


def grid(centre, half_range, step, spread=0.0):
    """Return poses around a centre in ascending order of scale, y and x."""
    shifts = [step * n - half_range for n in range(int(2 * half_range / step) + 1)]
    factors = [1 - spread, 1.0, 1 + spread] if spread else [1.0]
    return [
        Pose(centre.x + across, centre.y + down, centre.scale * factor)
        for factor in factors
        for down in shifts
        for across in shifts
    ]


Parameters = resolve("nguyen2002").plugin.Parameters

FLOORS = {"intensity": 3.0, "rgb": 1.0, "invariants": 1e-4, "arctan": 1e-4}
"""Least variances of residuals."""


class Settings:
    """Parameters of the tracker, and values derived from them."""

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
        """Least χ² of an outlier."""
        return chi2.ppf(self.delta, self.d)

    @property
    def cutoff(self):
        """Limit c above which Huber's function is linear."""
        return sqrt(self.limit) if self.norm == "huber" else inf

    @property
    def offsets(self):
        """Frames after an occlusion's beginning that are matched."""
        if self.candidates == "all":
            return list(range(5, self.longest_occlusion + 1))
        doubling = [5 + 2**n - 2 for n in range(1, 12)]
        return [offset for offset in doubling if offset <= self.longest_occlusion]

    def too_long(self, count):
        """Return whether a pixel was an outlier so long that it replaces its template value."""
        longest = round(self.gamma / self.minimal_speed, 9)  # 0.3 / 0.05 is less than 6
        if not self.rebootstrap:
            return False
        return count > longest if self.outlier_rule == "exceeds" else count >= longest


def raise_eigenvalues(matrix, least):
    """Return the symmetric part of a matrix, with eigenvalues raised to `least`."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    return vectors @ np.diag(np.maximum(values, least)) @ vectors.T


class Appearance:
    """Template g and the covariances of its noise (equations 5 to 15).

    All pixels have the same covariances. `n_o` is the number of consecutive frames in which a pixel
    was an outlier. `r` holds R of all frames since the second one.
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
        """Return R of equation 13 over the inliers, which the given covariance determines."""
        updated = np.full(self.n_o.shape, True)
        if self._settings.gate:
            updated = ~self.outliers(features, covariance)
        if not updated.any():
            return covariance
        r = (features - self.g)[updated]
        return self._shaped(r.T @ r / len(r))

    def begin(self, features):
        """Learn R(1) from the second view (equation 15)."""
        settings = self._settings
        r = (features - self.g).reshape(-1, settings.d)
        r1 = self._shaped(r.T @ r / len(r))
        if settings.first_covariance == "inliers":
            r1 = self.r_bar
            for _ in range(6):
                r1 = self.residual_covariance(features, r1)
        self._set_noise(r1)

    def begin_as_known(self, before):
        """Take R(1) and the measurement noise of an earlier template."""
        self._set_noise(before.r[0])

    def _set_noise(self, r1):
        self.r, self.r_bar = [r1], r1
        self.c_f, self.c_g, self.c_w = 0.5 * r1, 0.5 * r1, np.zeros_like(r1)

    def share(self, features):
        """Return the share of outliers (equation 16)."""
        return float(self.outliers(features, self.r_bar).mean())

    def update(self, features):
        """Apply equations 7 to 14 to a view after that of `begin`."""
        outliers = self.outliers(features, self.r_bar)
        self.r.append(self.residual_covariance(features, self.r_bar))
        last = self.r[-self._settings.average :]
        self.r_bar = sum(last) / len(last)
        if self._settings.adaptive_noise:
            self.c_w = raise_eigenvalues(self.r_bar - self.c_f - self.c_g, 0.0)
        self._filter(features, outliers)

    def update_first(self, features):
        """Apply equations 7 to 11 to the view of `begin`, where R is known and C_w is 0."""
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
    """Kalman filter of a pose and its velocity; its first pose counts as a measurement."""

    # Deviations of acceleration, measurement and first speed.
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
        """Velocity of the pose per frame."""
        return Pose(*(axis_filter.velocity for axis_filter in self._filters))

    def predicted(self):
        """Return the expected pose in the next frame."""
        return Pose(*(axis_filter.predicted() for axis_filter in self._filters))

    def measure(self, pose):
        """Update the filter with the next frame's measured pose."""
        for axis_filter, value in zip(self._filters, pose, strict=True):
            axis_filter.measure(value)


class Candidate(NamedTuple):
    """Best pose in a frame that may end an occlusion."""

    pose: Pose
    cost: float
    share: float


class Target:
    """Template and pose of the target; `last` is the last reported pose outside occlusions."""

    def __init__(self, settings, image, box):
        self._settings = settings
        self._size = box[2:].copy()
        self._shape = image.shape[:2]
        self._width, self._height = (floor(side + 0.5) for side in box[2:].tolist())
        x, y = (box[:2] + box[2:] / 2 - 0.5).tolist()
        self.last = Pose(x, y, 1.0)
        self._smoother = ScalarSmoother(self.last, Pose(0.0, 0.0, 0.0))
        self.appearance = Appearance(settings, self._view(self._features(image), self.last, True))

    def follow(self, image):
        """Return the pose to report for the next frame; None if an occlusion begins in it."""
        features = self._features(image)
        around = inside(self._smoother.predicted(), *self._shape)
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
        smoothed = inside(self._smoother.pose, *self._shape)
        self.last = smoothed if self._settings.report == "smoothed" else pose
        return self.last

    def extrapolated(self, frames):
        """Return the pose `frames` frames after the last one, at constant velocity."""
        velocity = self._smoother.velocity
        x, y = self.last.x + frames * velocity.x, self.last.y + frames * velocity.y
        return inside(Pose(x, y, self.last.scale), *self._shape)

    def look(self, image, n):
        """Match the frozen template with the frame n after an occlusion's beginning."""
        features = self._features(image)
        search_range = min(self._settings.search_range + 2 * n, 64)
        pose, cost = self._match(features, self.extrapolated(n + 1), search_range)
        seen = self._view(features, pose, self._settings.subpixel)
        return Candidate(pose, cost, self.appearance.share(seen))

    def interpolated(self, pose, n):
        """Return the poses of the n frames of an occlusion that ends with this pose."""
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
        """Return the box of a pose."""
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
        )


def select_end(candidates, settings):
    """Return the number of frames from an occlusion's beginning to its end."""
    for n, candidate in sorted(candidates.items()):
        if settings.end == "first" and candidate.share <= settings.accept:
            return n
    return min(candidates, key=lambda n: candidates[n].cost)


def track_offline(images, box, **parameters):
    """Track a target, and return boxes (n, 4), occlusions and the final covariances.

    An occlusion is its first frame and its end; an open one ends with the sequence.
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
        n = select_end(candidates, settings)
        end = candidates[n].pose
        poses += [*target.interpolated(end, n), end]
        target.take_again(images[frame + n], end, n)
        occlusions.append((frame, frame + n))
    return np.array([target.box(pose) for pose in poses]), occlusions, target.appearance
