"""Dynamics estimated off-line from hand-segmented sequences (Moreno-Noguer et al. 2005, section 4).

The paper says no more than that it is done by least squares. Here each step from a frame to the
next tells how far a random walk went: the plane's normal, the affine map of the contour, each
component of the colours. Random walks have no drift, so deviations are those from zero.
"""

from collections.abc import Sequence
from math import sqrt
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackers.contours.segmentation.colours import ANGLE, EIGENVALUES, MEAN, WEIGHT, MixtureScale
from trackers.contours.segmentation.steps import COMPONENTS, Steps

__all__ = ["learnt"]

Array: TypeAlias = NDArray[np.float64]

CLASSES = slice(0, COMPONENTS[0]), slice(COMPONENTS[0], None)  # target and background
LEAST_WEIGHT = 0.01  # of a component that is looked at: of fewer pixels there is little to see
LEAST_LENGTH = 2.0  # ratio of eigenvalues from which on a component has a direction
NORMAL = 1.4826  # a normal deviation over the median of absolute values
TAIL = 3.0  # deviations of the gain beyond which it has jumped


def learnt(steps: Sequence[Steps], colour_dynamics: MixtureScale) -> dict[str, float]:
    """Values of the trackers' parameters that fit the steps of one or more sequences.

    Of colours, medians of absolute values are taken, as a component that is lost or found again
    says nothing of how colours go on.

    Parameters
    ----------
    steps : sequence of Steps
    colour_dynamics : {'shared', 'diagonal'}
        What the colours' values are for. `shared`: what centroids do besides is told apart from a
        gain that all of them share, and from what those of a class share. `diagonal`: they go on
        by themselves, and there is no gain.

    Returns
    -------
    dict of str to float
        By name, in the order of `trackers.contours.segmentation.dynamics.LEARNT`.
    """
    normals, maps, shifts, components = (
        np.concatenate(parts) for parts in zip(*steps, strict=True)
    )
    turned = np.square(normals[:, 1] - normals[:, 0]).sum(axis=1).mean()
    affine = np.sqrt(np.square(maps - np.eye(2)).mean(axis=0)).ravel().tolist()
    shift = np.sqrt(np.square(shifts).mean(axis=0)).tolist()
    names = ("stretch_x_spread", "shear_x_spread", "shear_y_spread", "stretch_y_spread")
    return {
        # H and p have this deviation both, and turn the normal about two axes.
        "plane_spread": sqrt(turned / 4),
        **dict(zip(names, affine, strict=True)),
        "shift_x_spread": shift[0],
        "shift_y_spread": shift[1],
        **(_shared(components) if colour_dynamics == "shared" else _diagonal(components)),
    }


def _shared(components: Array) -> dict[str, float]:
    """Values of colours that share a gain; components before and after as in `Steps`."""
    before, after = components[:, 0], components[:, 1]
    weights = before[..., WEIGHT]
    along = (weights * (before[..., MEAN] * after[..., MEAN]).sum(axis=2)).sum(axis=1)
    gains = np.log(along / (weights * np.square(before[..., MEAN]).sum(axis=2)).sum(axis=1))
    gain = _deviation([[gains]])
    jumps = gains[np.abs(gains) > TAIL * gain]
    scaled = np.exp(gains)[:, np.newaxis, np.newaxis] * before[..., MEAN]
    moves = _by_class(after[..., MEAN] - scaled, components)
    mean = _deviation([_apart(own) for own in moves])
    together = _deviation([[of_step.mean(axis=0) for of_step in own] for own in moves])
    # The mean of k centroids has a k-th of their variance besides what they share.
    share = np.mean([1 / len(of_step) for own in moves for of_step in own])
    return {
        "mean_spread": mean,
        "class_spread": sqrt(max(together**2 - mean**2 * float(share), 0.0)),
        "gain_spread": gain,
        "jump_probability": len(jumps) / len(gains),
        "jump_spread": sqrt(float(np.square(jumps).mean())) if len(jumps) else 0.0,
        **_shapes(components, gains),
    }


def _diagonal(components: Array) -> dict[str, float]:
    """Values of colours that go on by themselves."""
    moves = _by_class(components[:, 1, :, MEAN] - components[:, 0, :, MEAN], components)
    return {"mean_spread": _deviation(moves), **_shapes(components, np.zeros(len(components)))}


def _shapes(components: Array, gains: Array) -> dict[str, float]:
    """Values of weights, eigenvalues and angles."""
    before, after = components[:, 0], components[:, 1]
    logarithms = np.log(np.maximum(components[..., WEIGHT], LEAST_WEIGHT))
    priors = _by_class(logarithms[:, 1] - logarithms[:, 0], components)
    growth = np.log(after[..., EIGENVALUES] / before[..., EIGENVALUES])
    growth -= gains[:, np.newaxis, np.newaxis]
    turns = (after[..., ANGLE] - before[..., ANGLE] + np.pi / 2) % np.pi - np.pi / 2
    first, second = np.moveaxis(components[..., EIGENVALUES], -1, 0)
    long = np.all(first > LEAST_LENGTH * second, axis=1)
    return {
        # Weights sum to one: what all those of a class did in common isn't seen.
        "prior_spread": _deviation([_apart(own) for own in priors]),
        "eigenvalue_spread": _deviation(_by_class(growth, components)),
        "angle_spread": _deviation(_by_class(turns, components, long)),
    }


def _by_class(
    values: Array, components: Array, kept: NDArray[np.bool_] | None = None
) -> list[list[Array]]:
    """Values (n, components, ...) of target and background, an array a step.

    Of components that are large enough, and `kept` (n, components) if given.
    """
    there = np.all(components[..., WEIGHT] > LEAST_WEIGHT, axis=1)
    if kept is not None:
        there &= kept
    return [
        [
            of_step[own][has[own]]
            for of_step, has in zip(values, there, strict=True)
            if has[own].any()
        ]
        for own in CLASSES
    ]


def _apart(steps: list[Array]) -> list[Array]:
    """What values do by themselves, with their own deviation; nothing of single ones."""
    return [
        (values - values.mean(axis=0)) / sqrt(1 - 1 / len(values))
        for values in steps
        if len(values) > 1
    ]


def _deviation(classes: Sequence[Sequence[Array]]) -> float:
    """Normal deviation from zero, by the median in each class; 0 of nothing.

    Variances of the classes are averaged: a background that stands still has more components, and
    a median over all would say that nothing moves.
    """
    together = [np.concatenate([some.ravel() for some in own]) for own in classes if own]
    deviations = [NORMAL * np.median(np.abs(values)) for values in together]
    return sqrt(np.mean(np.square(deviations))) if deviations else 0.0
