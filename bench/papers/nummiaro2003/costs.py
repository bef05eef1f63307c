"""What an update costs: in plain NumPy, by samples, area and bins, and in which of its parts.

All are CPU times, measured in one process, in turns on the same images.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import repeat
from time import thread_time
from typing import Any

import numpy as np
import pandas as pd
from numba import njit

import trackers
from bench.papers.in_turns import Update, beginning, in_turns, slope
from bench.papers.nummiaro2003.plain import PlainFilter
from trackers.base.interface import Box, Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.colour.joint import JointBins
from trackers.histograms.elliptic.likelihood import Likelihood
from trackers.histograms.elliptic.model import Ellipses, TargetModel
from trackers.particles.weights import normalised

__all__ = [
    "clock_rate",
    "compiled_filter",
    "cost_slopes",
    "cost_times",
    "model_times",
    "plain_filter",
    "plain_times",
    "weighting_times",
]

PARTICLES, BINS = 100, 8
SWEEPS: Mapping[str, Sequence[float]] = {
    "samples": (50, 100, 200, 300, 400),
    "area": (0.5, 1.0, 2.0, 3.0, 4.0),  # of the given ellipse's
    "bins": (4, 6, 8, 12, 16),  # a channel
}
"""What is changed, one at a time, for the cost of each."""

_ROUNDS = 7
_STEPS = 5_000_000
_CYCLES_A_STEP = 6  # three shifts and three operations, none of which can begin before the last


def compiled_filter(particles: int = PARTICLES, bins: int = BINS, models: str = "one") -> Any:
    """The tracker as written, without what happens while a target is lost."""
    return trackers.create(
        "nummiaro2003",
        preset="as-written",
        particles=particles,
        bins=bins,
        models=models,
        reinitialise=False,
    )


def plain_filter(particles: int = PARTICLES, bins: int = BINS) -> PlainFilter:
    """The same in plain NumPy, with the same random numbers."""
    return PlainFilter(np.random.SeedSequence(0), particles, bins)


def plain_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """The tracker and the plain filter side by side, with the same random numbers.

    Parameters
    ----------
    names : sequence of str
        Sequences.
    frames : int
        How many of each, from the first.

    Returns
    -------
    DataFrame
        A row a frame: `sequence`, `compiled` and `plain` [seconds].
    """
    pieces = []
    for name in names:
        images, box = beginning(name, frames)
        compiled, plain = compiled_filter(), plain_filter()
        for one in (compiled, plain):
            one.init(images[0], box)
        found = in_turns({"compiled": compiled.update, "plain": plain.update}, images[1:])
        pieces.append(found.assign(sequence=name))
    return pd.concat(pieces, ignore_index=True)


def model_times(name: str, frames: int) -> pd.DataFrame:
    """The tracker with one model for all samples and with one for each, side by side.

    Parameters
    ----------
    name : str
        Sequence.
    frames : int
        How many of it, from the first.

    Returns
    -------
    DataFrame
        A row a frame: `one` and `per_particle` [seconds].
    """
    images, box = beginning(name, frames)
    filters = {"one": compiled_filter(), "per_particle": compiled_filter(models="per-particle")}
    for each in filters.values():
        each.init(images[0], box)
    return in_turns({label: each.update for label, each in filters.items()}, images[1:])


def cost_times(name: str, make: Callable[[int, int], Any], blocks: int) -> pd.DataFrame:
    """Times of updates on the first image of a sequence, for all settings in turn.

    Parameters
    ----------
    name : str
        Sequence.
    make : callable
        Makes a filter for a number of samples and of bins a channel.
    blocks : int
        How many medians are given of each setting.

    Returns
    -------
    DataFrame
        Medians of some rounds: `factor` (samples, area, bins), `value` (their number; pixels²;
        the number of bins in all), `seconds`.
    """
    (image, *_), box = beginning(name, 0)
    settings = [(factor, value) for factor, values in SWEEPS.items() for value in values]
    values, updates = {}, {}
    for factor, value in settings:
        particles = int(value) if factor == "samples" else PARTICLES
        bins = int(value) if factor == "bins" else BINS
        enlarged = _enlarged(box, value if factor == "area" else 1.0)
        one = make(particles, bins)
        one.init(image, enlarged)
        label = f"{factor} {value}"
        area = np.pi / 4 * enlarged[2] * enlarged[3]
        values[label] = {"samples": particles, "area": area, "bins": bins**3}[factor]
        updates[label] = one.update
    medians = [in_turns(updates, repeat(image, _ROUNDS)).median() for _ in range(blocks)]
    return pd.DataFrame(
        {"factor": label.split()[0], "value": values[label], "seconds": block[label]}
        for block in medians
        for label in updates
    )


def cost_slopes(costs: pd.DataFrame) -> pd.DataFrame:
    """Lines through the times of `cost_times`.

    Returns
    -------
    DataFrame
        A row a factor: `factor`, `slope`, `lower_limit` and `upper_limit` of its 95 % interval
        [seconds a sample, a pixel² and a bin], `r_squared`.
    """
    return pd.DataFrame(
        {"factor": factor} | slope(times["value"], times["seconds"])
        for factor, times in costs.groupby("factor", sort=False)
    )


def weighting_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """Observing and weighting the samples of an update once more, right after it.

    Parameters as `plain_times`.

    Returns
    -------
    DataFrame
        A row a frame: `sequence`, `implementation`, `update` and `weighting` [seconds].
    """
    pieces = []
    for name in names:
        images, box = beginning(name, frames)
        for implementation, parts_of in (("compiled", _compiled_parts), ("plain", _plain_parts)):
            found = in_turns(parts_of(images[0], box), images[1:], shuffled=False)
            pieces.append(found.assign(sequence=name, implementation=implementation))
    return pd.concat(pieces, ignore_index=True)


def _compiled_parts(image: Image, box: Box) -> dict[str, Update]:
    tracker = compiled_filter()
    tracker.init(image, box)
    settings = tracker.parameters
    ellipses = Ellipses(JointBins(settings.colour, settings.bins), settings.kernel)
    model = TargetModel(tracker.histogram_of(image, box), PARTICLES, False, settings.alpha)
    likelihood = Likelihood(settings.sigma, settings.update_reading, settings.update_threshold)
    particles = np.zeros((0, 7))

    def update(image: Image) -> None:
        nonlocal particles
        particles = tracker.update(image).arrays["particles"]

    def weigh(image: Image) -> None:
        found = ellipses.counts(SharedFrame(image), particles, model.bins)
        normalised(likelihood.log(model.coefficients(found)))

    return {"update": update, "weighting": weigh}


def _plain_parts(image: Image, box: Box) -> dict[str, Update]:
    plain = plain_filter()
    plain.init(image, box)
    return {"update": plain.update, "weighting": lambda image: plain.weigh(plain.codes(image))}


def clock_rate() -> float:
    """Clock of the core that this runs on [Hz], by a chain of operations of a cycle each."""
    _chain(np.uint64(1), 1)
    seconds = []
    for _ in range(_ROUNDS):
        began = thread_time()
        _chain(np.uint64(1), _STEPS)
        seconds.append(thread_time() - began)
    return _STEPS * _CYCLES_A_STEP / min(seconds)


@njit(cache=True)
def _chain(state: Any, steps: int) -> Any:
    """Steps of xorshift (Marsaglia 2003): each needs the one before."""
    for _ in range(steps):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
    return state


def _enlarged(box: Box, factor: float) -> Box:
    """A box of this factor's area about the same centre."""
    size = box[2:] * np.sqrt(factor)
    return np.asarray(np.concatenate([box[:2] + (box[2:] - size) / 2, size]))
