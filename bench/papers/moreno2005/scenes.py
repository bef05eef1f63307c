"""Measures of scenes without stored runs: gain of the contour over the map, and of refined edges.

`example.py` contains the one-dimensional example of section 3.
"""

from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.metrics.regions import contour_accuracy, region_similarity
from trackmark.bench.papers.measures import measure
from trackmark.bench.papers.moreno2005.example import gain_of_dependence, gain_of_filtering
from trackmark.datasets.interface import Image, Mask
from trackmark.trackers.contours.mixture import fit_mixture
from trackmark.trackers.contours.outline import fill_contour, outline
from trackmark.trackers.contours.plane_cue import discriminant_basis
from trackmark.trackers.contours.posterior import posterior
from trackmark.trackers.contours.snake import refine_by_snake

__all__ = ["contour_gain", "edge_gain", "gain_of_dependence", "gain_of_filtering"]

Array: TypeAlias = NDArray[np.float64]

COMPONENTS = 2, 5  # components of the mixtures of target and background, as in the tracker
COLOURS = 500, 1500  # sampled pixels of target and background, as in the tracker
NEAR = 12  # width of the target's surroundings [px]
LOW_CONTRAST = 0.25  # share of the frames of a scene that count as low-contrast
FRAMES = 5  # number of evenly spaced frames of a scene in which snakes are started
STARTS = 8  # snakes per frame
STRETCH, SHIFT = 0.04, 2.0  # standard deviations of a start: affine coefficients, shift [px]


@measure("J")
def contour_gain(scene: str, tracker: str) -> float:
    """Return J of the contour minus J of the map in the frames of least contrast (Fig. 8).

    The mask of the map contains the pixels with a posterior above 1/2. Both masks are from one run
    of the method. The quarter of the frames with the least contrast is used. Contrast is the
    distance between the mean colours of the target and of its surroundings.
    """
    sequence = datasets.load(scene)
    (run,) = run_protocol([(parse_tracker(tracker), 0)], sequence, keep_arrays=True).runs
    if run.failure:
        raise datasets.SequenceError(f"{scene}: {tracker} failed: {run.failure.splitlines()[0]}")
    rows = []
    for frame, arrays in run.arrays.items():
        truth = sequence.mask(frame)
        if truth is None or not truth.any() or "mask" not in arrays:
            continue
        gain = region_similarity(arrays["mask"], truth)
        gain -= region_similarity(arrays["posterior"] > 0.5, truth)
        rows.append((contrast(sequence[frame], truth), gain))
    rows.sort()
    return float(np.mean([gain for _, gain in rows[: max(1, round(LOW_CONTRAST * len(rows)))]]))


@measure("F")
def edge_gain(scene: str) -> float:
    """Return the contour accuracy F with edges refined by the posterior map minus F with all edges.

    Source: section 5.5, Fig. 6. Snakes start from the true contour, which is shifted and deformed
    as by the tracker's dynamics. The mixtures of the map are fitted to the frame before.
    """
    sequence, gains = datasets.load(scene), []
    for frame in np.linspace(1, len(sequence) - 1, FRAMES).astype(int).tolist():
        before, mask = sequence.mask(frame - 1), sequence.mask(frame)
        if before is None or mask is None or not (before.any() and mask.any()):
            continue
        generator, image = np.random.default_rng(frame), sequence[frame]
        posterior = posterior_map(sequence[frame - 1], before, image, generator)
        starts = [started(outline(mask), generator) for _ in range(STARTS)]
        accuracies = [
            np.mean([_accuracy(start, image, support, mask) for start in starts])
            for support in (posterior, None)
        ]
        gains.append(accuracies[0] - accuracies[1])
    return float(np.mean(gains))


def contrast(image: Image, mask: Mask) -> float:
    """Return the distance between the mean colours of target and surroundings, in [0, √3]."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * NEAR + 1, 2 * NEAR + 1))
    around = cv2.dilate(mask.astype(np.uint8), disc).astype(bool) & ~mask
    means = [image[where].mean(axis=0) / 255.0 for where in (mask, around)]
    return float(np.linalg.norm(means[0] - means[1]))


def posterior_map(
    before: Image, mask: Mask, image: Image, generator: np.random.Generator
) -> NDArray[np.float32]:
    """Return the posterior map of an image by the colours of the frame before, shape (h, w)."""
    colours = before[..., ::-1] / 255.0
    inside, outside = (
        generator.permutation(colours[where])[:number]
        for where, number in zip((mask, ~mask), COLOURS, strict=True)
    )
    basis = discriminant_basis(inside, outside)
    target, background = (
        fit_mixture(points @ basis, components, generator)
        for points, components in zip((inside, outside), COMPONENTS, strict=True)
    )
    values = posterior((image[..., ::-1].reshape(-1, 3) / 255.0) @ basis, target, background)
    return np.asarray(values.reshape(image.shape[:2]), np.float32)


def started(contour: Array, generator: np.random.Generator) -> Array:
    """Return a contour, shape (n, 2), with a random affine deformation and shift."""
    middle = contour.mean(axis=0)
    stretch = np.eye(2) + generator.normal(0, STRETCH, (2, 2))
    moved = middle + generator.normal(0, SHIFT, 2)
    return np.asarray((contour - middle) @ stretch.T + moved)


def _accuracy(start: Array, image: Image, support: NDArray[np.float32] | None, mask: Mask) -> float:
    snake, _ = refine_by_snake(start, image, support)
    return float(contour_accuracy(fill_contour(snake, *mask.shape), mask))
