"""How well target and background are told apart in spaces of two dimensions (MO-20)."""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.moreno2005.checks.colours import (
    BACKGROUND_COMPONENTS,
    OBJECT_COMPONENTS,
    drawn_colours,
)
from datasets import Sequence
from trackers.contours.fisher.discriminant import discriminant_basis
from trackers.contours.fisher.mixture import fitted
from trackers.contours.fisher.posterior import posterior

__all__ = ["chromaticity", "measure", "principal_basis", "told_apart"]

FRAMES = 4
RANDOM_PLANES = 5
DARKEST = 1e-3  # sum of R, G and B from which on a colour has a chromaticity

Array = NDArray[np.float64]
Space = Callable[[Array], Array]


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `mo-20`; see `bench.papers.moreno2005.checks`."""
    rows = []
    for frame in np.linspace(0, len(sequence) - 1, 1 if quick else FRAMES).astype(int).tolist():
        mask = sequence.mask(frame)
        if mask is None or not mask.any():
            continue
        generator = np.random.default_rng(frame)
        inside, outside = drawn_colours(sequence[frame], mask, generator, 2.0)
        known = inside[::2], outside[::2]
        asked = inside[1::2], outside[1::2]
        for name, spaces in _spaces(known, generator):
            shares = [told_apart(space, known, asked, generator) for space in spaces]
            rows.append({"space": name, "frame": frame, "told_apart": float(np.mean(shares))})
    return {"mo-20": pd.DataFrame(rows)}


def told_apart(
    space: Space,
    known: tuple[Array, Array],
    asked: tuple[Array, Array],
    generator: np.random.Generator,
) -> float:
    """Share of colours, those of both classes counting alike, that mixtures assign to their class.

    Parameters
    ----------
    space : callable
        Takes colours (n, 3) to points (n, 2).
    known, asked : tuple of ndarray of float64, shape (n, 3)
        Colours of target and background: those to which mixtures are fitted, and others.
    generator : Generator
        Begins the fits.
    """
    target = fitted(space(known[0]), OBJECT_COMPONENTS, generator)
    background = fitted(space(known[1]), BACKGROUND_COMPONENTS, generator)
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


def _spaces(
    known: tuple[Array, Array], generator: np.random.Generator
) -> Iterator[tuple[str, list[Space]]]:
    yield "Fisher plane", [_onto(discriminant_basis(*known))]
    yield "chromaticity", [chromaticity]
    yield "principal components", [_onto(principal_basis(np.vstack(known)))]
    drawn = generator.normal(size=(RANDOM_PLANES, 3, 2))
    yield "random planes", [_onto(np.linalg.qr(axes)[0]) for axes in drawn]


def _onto(basis: Array) -> Space:
    return lambda colours: colours @ basis
