"""Measure of scenes for Fig. 2: distance of the mean state from the maximum of ρ."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers.measures import measure
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import JointBins
from trackmark.trackers.histograms.ellipses import bhattacharyya_coefficients
from trackmark.trackers.histograms.target_model import EllipseHistograms

RUN = 100  # number of frames of the run
CLEAR = 0.95  # minimum visible share of the target in measured frames
FRAMES = 15
REACH = 1.5  # extent of the surface to each side [half axes]
NEAR = 0.25  # distance from the maximum that counts as close [Hx]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CoefficientSurface:
    """ρ around the target in a frame, for ellipses of the mean state's size."""

    frame: int  # from 0
    image: NDArray[np.uint8]  # BGR
    x: Array  # (columns,): centres of the ellipses, one pixel apart [px]
    y: Array  # (rows,)
    coefficients: Array  # (rows, columns): ρ
    mean: Array  # (4,): x, y, Hx, Hy of the mean state [px]
    samples: Array  # (N, 4): x, y, Hx, Hy [px]

    @property
    def distance(self) -> float:
        """Distance of the mean state from the maximum in pixels."""
        row, column = np.unravel_index(self.coefficients.argmax(), self.coefficients.shape)
        return float(np.hypot(self.mean[0] - self.x[column], self.mean[1] - self.y[row]))

    def values_at(self, positions: Array) -> Array:
        """Return the values nearest to positions of shape (n, 2); NaN outside the grid."""
        columns, rows = np.round(positions - [self.x[0], self.y[0]]).astype(int).T
        inside = (rows >= 0) & (rows < len(self.y)) & (columns >= 0) & (columns < len(self.x))
        nearest = np.full(len(positions), np.nan)
        nearest[inside] = self.coefficients[rows[inside], columns[inside]]
        return nearest


@measure("share")
def mean_state_at_maximum(scene: str, tracker: str) -> float:
    """Return 1 if the median distance of the mean state from the maximum of ρ is at most Hx / 4.

    Source: Fig. 2. The tracker has no model update; frames show all of the target.
    """
    frame_surfaces = surfaces(scene, tracker, FRAMES)
    half_width = float(np.median([surface.mean[2] for surface in frame_surfaces]))
    return float(np.median([surface.distance for surface in frame_surfaces]) <= NEAR * half_width)


def surfaces(scene: str, tracker: str, n_frames: int) -> list[CoefficientSurface]:
    """Return the surfaces of ρ in up to `n_frames` clear frames of a run of the tracker."""
    sequence = datasets.load(scene)
    first = sequence.first_frame
    excerpt = sequence[: first + RUN]
    (run,) = run_protocol([(parse_tracker(tracker), 0)], excerpt, keep_arrays=True).runs
    if run.failure:
        raise datasets.SequenceError(f"{scene}: {tracker} failed: {run.failure.splitlines()[0]}")
    ellipses = EllipseHistograms(JointBins(), "isotropic")
    every = np.arange(ellipses.colours.n_bins)
    start = ellipse_in(excerpt.boxes[first])
    counted = ellipses.counts(SharedFrame(excerpt[first]), _states(start[np.newaxis]), every)
    model, bins = counted.counts[0] / counted.totals[0], np.flatnonzero(counted.counts[0])
    surfaces_found = []
    for frame in _clear_frames(excerpt, n_frames):
        mean, target = ellipse_in(run.boxes[frame]), ellipse_in(excerpt.boxes[frame])
        reach = (REACH * target[2:]).astype(int)
        x, y = (
            np.arange(-most, most + 1) + np.floor(centre) + 0.5
            for most, centre in zip(reach, target, strict=False)
        )
        centres = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
        candidates = np.hstack([centres, np.tile(mean[2:], (len(centres), 1))])
        counts = ellipses.counts(SharedFrame(excerpt[frame]), _states(candidates), bins)
        values = bhattacharyya_coefficients(counts.counts, counts.totals, model[np.newaxis, bins])
        surface = values.reshape(len(y), len(x))
        samples = run.arrays[frame]["particles"][:, [0, 1, 4, 5]]
        surfaces_found.append(
            CoefficientSurface(frame, excerpt[frame], x, y, surface, mean, samples)
        )
    return surfaces_found


def ellipse_in(box: Array) -> Array:
    """Return the ellipse in a box: x, y, Hx, Hy, shape (4,)."""
    return np.concatenate([box[:2] + box[2:] / 2, box[2:] / 2])


def _clear_frames(sequence: datasets.Sequence, n_frames: int) -> list[int]:
    clear = np.flatnonzero(sequence.present & (sequence.visibility >= CLEAR))
    clear = clear[clear > sequence.first_frame]
    indices = np.linspace(0, len(clear) - 1, min(n_frames, len(clear))).round().astype(int)
    return [int(frame) for frame in clear[indices]]


def _states(ellipses: Array) -> Array:
    """Convert ellipses, shape (n, 4), to states of the tracker without motion, shape (n, 7)."""
    states = np.zeros((len(ellipses), 7))
    states[:, [0, 1, 4, 5]] = ellipses
    return states
