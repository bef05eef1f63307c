"""What the snake finds on edges that the posterior map supports, and on all edges (MO-21)."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.metrics.regions import contour_accuracy, region_similarity
from bench.papers.moreno2005.checks.colours import (
    BACKGROUND_COMPONENTS,
    OBJECT_COMPONENTS,
    drawn_colours,
)
from datasets import Sequence
from datasets.interface import Image, Mask
from trackers.contours.contour.outline import filled, outline
from trackers.contours.contour.snake import refined
from trackers.contours.fisher.discriminant import discriminant_basis
from trackers.contours.fisher.mixture import fitted
from trackers.contours.fisher.posterior import posterior

__all__ = ["measure", "posterior_map", "started"]

FRAMES = 5
STARTS = 8
STRETCH, SHIFT = 0.04, 2.0  # deviations of a start: of an affine map, of a shift in pixels

Array = NDArray[np.float64]


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `mo-21`; see `bench.papers.moreno2005.checks`."""
    rows = []
    for frame in np.linspace(1, len(sequence) - 1, 1 if quick else FRAMES).astype(int).tolist():
        before, mask = sequence.mask(frame - 1), sequence.mask(frame)
        if before is None or mask is None or not (before.any() and mask.any()):
            continue
        generator = np.random.default_rng(frame)
        image = sequence[frame]
        shown = posterior_map(sequence[frame - 1], before, image, generator)
        starts = [started(outline(mask), generator) for _ in range(STARTS)]
        for name, support in (("supported", shown), ("all", None)):
            snakes = [refined(start, image, support) for start in starts]
            found = [filled(snake, *mask.shape) for snake, _ in snakes]
            rows.append(
                {
                    "edges": name,
                    "frame": frame,
                    "contour_accuracy": np.mean([contour_accuracy(one, mask) for one in found]),
                    "region_similarity": np.mean([region_similarity(one, mask) for one in found]),
                    "accepted": np.mean([taken for _, taken in snakes]),
                }
            )
    return {"mo-21": pd.DataFrame(rows)}


def posterior_map(
    before: Image, mask: Mask, image: Image, generator: np.random.Generator
) -> NDArray[np.float32]:
    """Posterior of an image by the colours of the frame before, whose mask is known."""
    sets = drawn_colours(before, mask, generator)
    basis = discriminant_basis(*sets)
    target, background = (
        fitted(colours @ basis, components, generator)
        for colours, components in zip(
            sets, (OBJECT_COMPONENTS, BACKGROUND_COMPONENTS), strict=True
        )
    )
    colours = image[..., ::-1].reshape(-1, 3) / 255.0
    values = posterior(colours @ basis, target, background)
    return np.asarray(values.reshape(image.shape[:2]), np.float32)


def started(contour: Array, generator: np.random.Generator) -> Array:
    """A contour (n, 2), stretched about its middle and moved at random."""
    middle = contour.mean(axis=0)
    stretch = np.eye(2) + generator.normal(0, STRETCH, (2, 2))
    moved = middle + generator.normal(0, SHIFT, 2)
    return np.asarray((contour - middle) @ stretch.T + moved)
