"""Times of the paper's tracker: what Fig. 5 shows, what the claims on time rest on.

All are CPU times, warm. Those of the timing runs are the tracker's as written; beside them a plain
filter in NumPy with the same random numbers, either with and without weighting its samples once
more, and either by samples, area and bins take turns; see `bench.papers.timing`.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numba import njit

import trackers
from bench.papers.context import Context
from bench.papers.nummiaro2003.plain import PlainFilter
from bench.papers.timing import beginning, frame_times, kept_times, slope, turn_times
from bench.statistics.intervals import mean_interval
from trackers.base.interface import Box, Image
from trackers.base.particles import normalised
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.target_model import Ellipses, Likelihood, TargetModel

__all__ = ["SWEEPS", "compiled_filter", "cost_slopes", "cost_times", "model_times"]
__all__ += ["plain_filter", "tables", "update_times"]

TIMED = "nummiaro2003-figure-5"
SEQUENCES = ("nummiaro2003/person", "nummiaro2003/car")
STUDENTS = "nummiaro2003/students"
PAPERS_CLOCK = 800e6  # Hz

PARTICLES, BINS = 100, 8
SWEEPS: Mapping[str, Sequence[float]] = {
    "samples": (50, 100, 200, 400),
    "area": (0.5, 1.0, 2.0, 4.0),  # of the given ellipse's
    "bins": (4, 8, 12, 16),  # a channel
}
"""What is changed, one at a time, for the cost of each."""

SHOWN = 2  # times that an image is shown for the cost of each
STEPS = 250_000  # of the chain that tells the clock
CYCLES_A_STEP = 6  # three shifts and three operations, none of which can begin before the last


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """What the claims on time and the tables of times rest on.

    `run_times`: `sequence`, `repetition`, `frame`, `seconds` and `area` (of the mean state's
    ellipse [pixels²]) of the timing runs (Fig. 5); `frame_times`: medians over the repetitions.
    `plain_times`, a sequence a row: `milliseconds` of an update in plain NumPy, and
    `at_800_mhz`, in which the paper's processor has as many cycles, each with 95 % limits over
    rounds (`low`, `high`; `low_at_800_mhz`, `high_at_800_mhz`). `model_times` and `update_times`:
    see these functions. `time_slopes`: see `cost_slopes`, with `implementation`. `times`: what of
    these is printed, a `value` of `what` on a sequence.
    """
    if TIMED not in context.asked:  # a quick look times nothing
        return {}
    runs = frame_times(context.results / TIMED, context.asked[TIMED], ("half_width", "half_height"))
    runs = runs[runs["disturbed"] == 0].copy()
    runs["area"] = np.pi * runs["half_width"] * runs["half_height"]
    keys = ["sequence", "frame"]
    medians = runs.groupby(keys, as_index=False)[["seconds", "decoded", "area"]].median()
    updates = kept_times(context, update_times, SEQUENCES, frames=15)
    models = kept_times(context, model_times, (STUDENTS,), frames=15)
    costs = kept_times(context, cost_times, SEQUENCES[:1])
    clock = STEPS * CYCLES_A_STEP / updates["clock"]
    at_800_mhz = 1e3 * updates["plain"] * clock / PAPERS_CLOCK
    times = {
        "plain": (updates, 1e3 * updates["plain"]),
        "plain at 800 MHz": (updates, at_800_mhz),
        "area": (medians, medians["area"]),
        "compiled": (medians, 1e3 * medians["seconds"]),
        "as decoded": (medians, 1e3 * medians["decoded"]),
        "weighting, compiled": (updates, 100 * _share(updates, "compiled")),
        "weighting, plain": (updates, 100 * _share(updates, "plain")),
        "models": (models, models["per_particle"] / models["one"]),
        "clock": (updates, clock / 1e9),
        "reference": (updates, 1e3 * updates["reference"]),
    }
    told = [
        pd.DataFrame({"sequence": rows["sequence"], "what": what, "value": values})
        for what, (rows, values) in times.items()
    ]
    return {
        "run_times": runs,
        "frame_times": medians,
        "plain_times": _with_limits(updates["sequence"], 1e3 * updates["plain"], at_800_mhz),
        "update_times": updates,
        "model_times": models,
        "time_slopes": cost_slopes(costs),
        "times": pd.concat([one for one in told if len(one)], ignore_index=True),
    }


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


FILTERS: Mapping[str, Callable[..., Any]] = {"compiled": compiled_filter, "plain": plain_filter}


def update_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """Updates of both implementations on sequences, a round a row.

    `sequence`; seconds a frame: `compiled`, `plain`, either with its samples observed and weighted
    once more (`compiled_twice`, `plain_twice`); `clock` (of the chain that tells it), `reference`.
    """
    methods: dict[str, Callable[[], Any]] = dict(FILTERS)
    methods |= {"compiled_twice": _CompiledTwice, "plain_twice": _PlainTwice, "clock": _Clock}
    return turn_times(methods, {name: beginning(name, frames) for name in names})


def model_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """Updates with `one` model, and with one `per_particle` [seconds], a round a row."""
    methods = {"one": compiled_filter}
    methods["per_particle"] = partial(compiled_filter, models="per-particle")
    return turn_times(methods, {name: beginning(name, frames) for name in names})


def cost_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """Times of updates on the first image of a sequence, by all settings, which take turns.

    A row a round: `implementation`, `factor` (samples, area, bins), `value` (their number;
    pixels²; the number of bins in all), `seconds`, and those of the `reference`.
    """
    (image,), box = beginning(names[0], 0)
    shown = [image] * (min(frames, SHOWN) + 1)
    settings = [(factor, one) for factor, several in SWEEPS.items() for one in several]
    pieces = []
    for implementation, make in FILTERS.items():
        methods = {
            f"{factor} {one}": partial(_Enlarged, make, factor, one) for factor, one in settings
        }
        times = turn_times(methods, {names[0]: (shown, box)})
        for factor, one in settings:
            size = box[2:].prod() * np.pi / 4
            value = {"samples": one, "area": one * size, "bins": one**3}[factor]
            known = {"implementation": implementation, "factor": factor, "value": value}
            rows = times[["reference"]].assign(seconds=times[f"{factor} {one}"], **known)
            pieces.append(rows)
    return pd.concat(pieces, ignore_index=True)


def cost_slopes(costs: pd.DataFrame) -> pd.DataFrame:
    """Lines through the times of `cost_times`, a row a way and factor, and what `slope` gives.

    In seconds a sample, a pixel² and a bin.
    """
    keys = ["implementation", "factor"]
    return pd.DataFrame(
        dict(zip(keys, values, strict=True)) | slope(times["value"], times["seconds"])
        for values, times in costs.groupby(keys, sort=False)
    )


def _share(updates: pd.DataFrame, implementation: str) -> "pd.Series[float]":
    """Of an update, what observing and weighting take."""
    return updates[f"{implementation}_twice"] / updates[implementation] - 1


def _with_limits(
    sequences: "pd.Series[str]", milliseconds: "pd.Series[float]", at_800_mhz: "pd.Series[float]"
) -> pd.DataFrame:
    rows = []
    for sequence in sequences.unique():
        row = {"sequence": sequence}
        for name, values in (("milliseconds", milliseconds), ("at_800_mhz", at_800_mhz)):
            here = values[sequences == sequence]
            suffix = "" if name == "milliseconds" else f"_{name}"
            row[name] = here.mean()
            row[f"low{suffix}"], row[f"high{suffix}"] = mean_interval(here)
            row["degrees"] = len(here) - 1
        rows.append(row)
    return pd.DataFrame(rows)


class _Enlarged:
    """A filter with one of the `SWEEPS` settings, begun with a box that may be enlarged."""

    def __init__(self, make: Callable[..., Any], factor: str, setting: float) -> None:
        known = {"samples": "particles", "bins": "bins"}
        options = {known[factor]: int(setting)} if factor in known else {}
        self._filter, self.update = (one := make(**options)), one.update
        self._scale = np.sqrt(setting) if factor == "area" else 1.0

    def init(self, image: Image, box: Box) -> None:
        """Begin with a box of this factor's area about the same centre."""
        size = box[2:] * self._scale
        self._filter.init(image, np.concatenate([box[:2] + (box[2:] - size) / 2, size]))


class _CompiledTwice:
    """The tracker, whose samples are observed and weighted once more."""

    def __init__(self) -> None:
        self._tracker = compiled_filter()

    def init(self, image: Image, box: Box) -> None:
        """Begin."""
        self._tracker.init(image, box)
        settings = self._tracker.parameters
        self._ellipses = Ellipses(JointBins(settings.colour, settings.bins), settings.kernel)
        histogram = self._tracker.histogram_of(image, box)
        self._model = TargetModel(histogram, PARTICLES, False, settings.alpha)
        readings = settings.update_reading, settings.update_threshold
        self._likelihood = Likelihood(settings.sigma, *readings)

    def update(self, image: Image) -> None:
        """Update, and weigh again."""
        particles = self._tracker.update(image).arrays["particles"]
        found = self._ellipses.counts(SharedFrame(image), particles, self._model.bins)
        normalised(self._likelihood.log(self._model.coefficients(found)))


class _PlainTwice(PlainFilter):
    """The plain filter, whose samples are observed and weighted once more."""

    def __init__(self) -> None:
        super().__init__(np.random.SeedSequence(0), PARTICLES, BINS)

    def update(self, image: Image) -> None:
        """Update, and weigh again."""
        super().update(image)
        self.weigh(self.codes(image))


class _Clock:
    """Operations of a cycle each, whose time tells the clock of the core that this runs on."""

    def init(self, *_: object) -> None:
        """Begin."""

    def update(self, _: object) -> None:
        """Go through the chain."""
        _chain(np.uint64(1), STEPS)


@njit(cache=True)
def _chain(state: Any, steps: int) -> Any:
    """Steps of xorshift (Marsaglia 2003): each needs the one before."""
    for _ in range(steps):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
    return state
