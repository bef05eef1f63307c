"""What no score of a run shows, measured on the scenes of the figures for single claims.

A table is named by its claim. Every one has `name` (the sequence, canonical), `sequence` (without
variant), `scene`, then columns of its own. Frames count from 0. Shares, J and F are floats in
[0, 1].

- `mo-11`, of the octopus, a preset, mask and part of the frames a row: `preset`, `mask` (`contour`:
  what the snake encloses; `mean contour`; `posterior map`: where it is above 1/2), `contrast`
  (`all`, or a quarter of the frames by the distance of the mean colours of the target and of what
  is within 12 pixels of it: `least`, `less`, `more`, `most`), `distance` (its mean),
  `region_similarity`. All masks are those of one run;
- `mo-20`, a space and frame a row: `space` (`Fisher plane`, `chromaticity`, `principal components`,
  `random planes`), `frame`, `told_apart` (share of the pixels, those of target and background
  counting alike, that two mixtures tell apart which were fitted to other pixels of the frame; of
  random planes the mean of five);
- `mo-21`, a frame and image of edges a row: `edges` (`supported` by the posterior map, or `all`),
  `frame`, `contour_accuracy`, `region_similarity` (of what the snake encloses, the mean over eight
  starts: the true contour, moved and stretched as the tracker's dynamics would), `accepted` (share
  of the snakes that the tracker would take). The map's mixtures were fitted to the frame before.
"""

from collections.abc import Callable, Iterator
from typing import TypeAlias

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run
from bench.metrics.regions import contour_accuracy, region_similarity
from bench.papers.scenes import SceneCheck, short_runs
from datasets.interface import Image, Mask
from trackers.contours.mixture import Mixture, fitted
from trackers.contours.outline import filled, outline
from trackers.contours.plane_cue import discriminant_basis
from trackers.contours.posterior import posterior
from trackers.contours.snake import refined

__all__ = ["CHECKS", "QUARTERS", "by_contrast", "chromaticity", "contrast", "drawn_colours"]
__all__ += ["edges", "frame_rows", "masks", "posterior_map", "principal_basis", "spaces"]
__all__ += ["started", "told_apart"]

Array: TypeAlias = NDArray[np.float64]
Space: TypeAlias = Callable[[Array], Array]
Sets: TypeAlias = tuple[Array, Array]
"""Colours (n, 3) of target and background, RGB in [0, 1]."""

COMPONENTS = 2, 5  # of the mixtures of target and background, as the tracker has them
COLOURS = 500, 1500  # that are drawn, likewise

PRESETS = ("as-written", "recommended")
QUARTERS = ("least", "less", "more", "most")
NEAR = 12  # pixels, of what is around a target
QUICK_FRAMES = 20

FRAMES = {"mo-20": 4, "mo-21": 5}
"""That are looked at, evenly spaced; one where it is quick."""

RANDOM_PLANES = 5
DARKEST = 1e-3  # sum of R, G and B from which on a colour has a chromaticity

STARTS = 8  # of the snake
STRETCH, SHIFT = 0.04, 2.0  # deviations of a start: of an affine map, of a shift in pixels


def masks(sequence: datasets.Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """`mo-11`: what the shape makes of the colours' posterior map, by contrast."""
    if quick:
        sequence = sequence[:QUICK_FRAMES]
    made = short_runs(sequence, [f"moreno2005:preset={preset}" for preset in PRESETS])
    tables = [
        by_contrast(frame_rows(sequence, run)).assign(preset=preset)
        for preset, run in zip(PRESETS, made, strict=True)
    ]
    return {"mo-11": pd.concat(tables, ignore_index=True)}


def frame_rows(sequence: datasets.Sequence, run: Run) -> pd.DataFrame:
    """J of every mask in every frame that a run with arrays has.

    `mask`, `frame`, `distance` (see `contrast`), `region_similarity`.
    """
    rows = []
    for frame, arrays in run.arrays.items():
        truth = sequence.mask(frame)
        if truth is None or not truth.any() or "mask" not in arrays:
            continue
        distance = contrast(sequence[frame], truth)
        shown = {
            "contour": arrays["mask"],
            "mean contour": filled(arrays["mean_contour"].astype(np.float64), *truth.shape),
            "posterior map": arrays["posterior"] > 0.5,
        }
        for name, mask in shown.items():
            row = {"mask": name, "frame": frame, "distance": distance}
            rows.append(row | {"region_similarity": region_similarity(mask, truth)})
    return pd.DataFrame(rows)


def contrast(image: Image, mask: Mask) -> float:
    """Distance of the mean colours of a target and of what is near it, in [0, √3]."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * NEAR + 1, 2 * NEAR + 1))
    around = cv2.dilate(mask.astype(np.uint8), disc).astype(bool) & ~mask
    means = [image[where].mean(axis=0) / 255.0 for where in (mask, around)]
    return float(np.linalg.norm(means[0] - means[1]))


def by_contrast(frames: pd.DataFrame) -> pd.DataFrame:
    """Means of `frame_rows` by `mask` and `contrast`: all frames, and quarters of them."""
    ranks = frames.groupby("mask")["distance"].rank(method="first", pct=True)
    quarter = np.minimum((ranks * len(QUARTERS) - 1e-9).astype(int), len(QUARTERS) - 1)
    parts = [
        frames.assign(contrast="all"),
        frames.assign(contrast=np.array(QUARTERS, object)[quarter]),
    ]
    means = pd.concat(parts).groupby(["mask", "contrast"], sort=False)
    return means[["distance", "region_similarity"]].mean().reset_index()


def spaces(sequence: datasets.Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """`mo-20`: how well target and background are told apart in spaces of two dimensions."""
    rows = []
    for frame in _looked_at(sequence, "mo-20", 0, quick):
        mask = sequence.mask(frame)
        if mask is None or not mask.any():
            continue
        generator = np.random.default_rng(frame)
        inside, outside = drawn_colours(sequence[frame], mask, generator, 2.0)
        known, asked = ((inside[half::2], outside[half::2]) for half in (0, 1))
        for name, candidates in _spaces(known, generator):
            shares = [told_apart(space, known, asked, generator) for space in candidates]
            rows.append({"space": name, "frame": frame, "told_apart": float(np.mean(shares))})
    return {"mo-20": pd.DataFrame(rows)}


def _spaces(known: Sets, generator: np.random.Generator) -> Iterator[tuple[str, list[Space]]]:
    yield "Fisher plane", [_onto(discriminant_basis(*known))]
    yield "chromaticity", [chromaticity]
    yield "principal components", [_onto(principal_basis(np.vstack(known)))]
    drawn = generator.normal(size=(RANDOM_PLANES, 3, 2))
    yield "random planes", [_onto(np.linalg.qr(axes)[0]) for axes in drawn]


def _onto(basis: Array) -> Space:
    return lambda colours: colours @ basis


def told_apart(space: Space, known: Sets, asked: Sets, generator: np.random.Generator) -> float:
    """Share of colours, those of both classes counting alike, that mixtures assign to their class.

    A space takes colours (n, 3) to points (n, 2); mixtures are fitted to the known ones.
    """
    target, background = _fits((space(known[0]), space(known[1])), generator)
    inside, outside = (
        posterior(space(colours), target, background, floor=0.0) > 0.5 for colours in asked
    )
    return float((inside.mean() + 1 - outside.mean()) / 2)


def chromaticity(colours: Array) -> Array:
    """Shares of R and G in R + G + B, shape (n, 2); a third each of black."""
    total = colours.sum(axis=1, keepdims=True)
    shares = np.divide(
        colours[:, :2], total, out=np.full((len(colours), 2), 1 / 3), where=total > DARKEST
    )
    return np.asarray(shares)


def principal_basis(colours: Array) -> Array:
    """The two directions (3, 2) in which colours vary most."""
    return np.asarray(np.linalg.eigh(np.cov(colours.T))[1][:, :0:-1])


def edges(sequence: datasets.Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """`mo-21`: what the snake finds on edges that the posterior map supports, and on all."""
    rows = []
    for frame in _looked_at(sequence, "mo-21", 1, quick):
        before, mask = sequence.mask(frame - 1), sequence.mask(frame)
        if before is None or mask is None or not (before.any() and mask.any()):
            continue
        generator = np.random.default_rng(frame)
        image = sequence[frame]
        shown = posterior_map(sequence[frame - 1], before, image, generator)
        starts = [started(outline(mask), generator) for _ in range(STARTS)]
        for name, support in (("supported", shown), ("all", None)):
            snakes = [refined(start, image, support, "by-spacing") for start in starts]
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
    inside, outside = drawn_colours(before, mask, generator)
    basis = discriminant_basis(inside, outside)
    target, background = _fits((inside @ basis, outside @ basis), generator)
    colours = image[..., ::-1].reshape(-1, 3) / 255.0
    values = posterior(colours @ basis, target, background)
    return np.asarray(values.reshape(image.shape[:2]), np.float32)


def started(contour: Array, generator: np.random.Generator) -> Array:
    """A contour (n, 2), stretched about its middle and moved at random."""
    middle = contour.mean(axis=0)
    stretch = np.eye(2) + generator.normal(0, STRETCH, (2, 2))
    moved = middle + generator.normal(0, SHIFT, 2)
    return np.asarray((contour - middle) @ stretch.T + moved)


def drawn_colours(
    image: Image, mask: Mask, generator: np.random.Generator, share: float = 1.0
) -> Sets:
    """Colours of pixels inside a mask and outside, none of them twice.

    At most so many as the tracker starts with, `share` times.
    """
    colours = image[..., ::-1] / 255.0
    inside, outside = (
        generator.permutation(colours[where])[: round(share * number)]
        for where, number in zip((mask, ~mask), COLOURS, strict=True)
    )
    return inside, outside


def _fits(points: Sets, generator: np.random.Generator) -> tuple[Mixture, Mixture]:
    """Mixtures of target and background, of points (n, 2)."""
    target, background = (
        fitted(where, components, generator)
        for where, components in zip(points, COMPONENTS, strict=True)
    )
    return target, background


def _looked_at(sequence: datasets.Sequence, table: str, first: int, quick: bool) -> list[int]:
    numbers: list[int] = (
        np.linspace(first, len(sequence) - 1, 1 if quick else FRAMES[table]).astype(int).tolist()
    )
    return numbers


ALL = tuple(f"moreno2005/{name}" for name in ("ellipse", "octopus", "book", "leaf"))

CHECKS = (
    SceneCheck(masks, ("moreno2005/octopus",)),
    SceneCheck(spaces, ALL),
    SceneCheck(edges, ALL),
)
