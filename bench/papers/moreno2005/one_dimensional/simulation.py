"""The same filters compiled: many repetitions with up to 500 samples in a minute.

With the same generator they give what `cues.estimates` does, the definition.
"""

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.papers.moreno2005.one_dimensional.cues import FILTERS, Filter
from bench.papers.moreno2005.one_dimensional.settings import COLOURS, Course, Setting

__all__ = ["simulated"]

Array: TypeAlias = NDArray[np.float64]

_INDEPENDENT, _DEPENDENT, _UNWEIGHTED = range(len(FILTERS))
_LOW, _SPAN = COLOURS[0], COLOURS[1] - COLOURS[0]
_BELOW_ONE = float(np.nextafter(1.0, 0.0))


def simulated(
    kind: Filter, setting: Setting, samples: int, seen: Course, generator: np.random.Generator
) -> Array:
    """Follow a course; see `cues.estimates`."""
    followed: Array = _follow(
        FILTERS.index(kind),
        setting.scale,
        *setting.dynamics,
        samples,
        seen.start,
        seen.observed,
        generator,
    )
    return followed


@njit(cache=True)
def _follow(
    kind: int,
    scale: float,
    spread: float,
    colour_spread: float,
    samples: int,
    start: Array,
    observed: Array,
    generator: np.random.Generator,
) -> Array:
    frames = len(observed)
    rows = np.empty((frames, 4))
    positions, colours = np.full(samples, start[0]), np.full(samples, start[1])
    weights, colour_weights = np.full(samples, 1 / samples), np.full(samples, 1 / samples)
    even = np.full(samples, 1 / samples)
    for frame in range(frames):
        position, colour = observed[frame]
        colours = _drawn(colours, colour_weights, colour_spread, generator)
        for j in range(samples):
            colour_weights[j] = np.exp(-abs(colours[j] - colour) / scale)
        _normalise(colour_weights)
        attachable, by = colours, colour_weights
        if kind == _INDEPENDENT:
            attachable, by = _LOW + _SPAN * generator.random(samples), even
            generator.random(samples)  # to which of the filter's these are attached
        elif kind == _UNWEIGHTED:
            by = even
        positions = _drawn(positions, weights, spread, generator)
        attached = attachable[_independent_draws(by, generator.random(samples))]
        for j in range(samples):
            far = abs(attached[j] - colour) + abs(positions[j] - position)
            weights[j] = np.exp(-far / scale)
        _normalise(weights)
        rows[frame, 0] = (weights * positions).sum()
        rows[frame, 1] = (weights * attached).sum()
        rows[frame, 2] = (colour_weights * colours).sum()
        rows[frame, 3] = 1 / (samples * (weights * weights).sum())
    return rows


@njit(cache=True)
def _drawn(states: Array, weights: Array, spread: float, generator: np.random.Generator) -> Array:
    """Systematic resampling, and a step of the random walk."""
    samples = len(states)
    shift = generator.random(samples)[0]
    steps = generator.standard_normal(samples)
    drawn = np.empty(samples)
    cumulative = weights.cumsum()
    found = 0
    for j in range(samples):
        sought = min((j + shift) / samples, _BELOW_ONE) * cumulative[-1]
        while cumulative[found] <= sought:
            found += 1
        drawn[j] = states[found] + spread * steps[j]
    return drawn


@njit(cache=True)
def _independent_draws(weights: Array, uniforms: Array) -> NDArray[np.intp]:
    cumulative = weights.cumsum()
    sought = np.minimum(uniforms, _BELOW_ONE) * cumulative[-1]
    found: NDArray[np.intp] = np.searchsorted(cumulative, sought, side="right")
    return found


@njit(cache=True)
def _normalise(weights: Array) -> None:
    weights /= weights.sum()
