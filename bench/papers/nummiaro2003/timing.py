"""Times of the paper's tracker on the person and the car (Fig. 5, section 7)."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from numba import njit

from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import SETTING_LABELS, SETTINGS
from trackmark.bench.papers.measures import measure
from trackmark.bench.papers.nummiaro2003.plain import PlainFilter
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.timing import (
    MethodMaker,
    Methods,
    Pairs,
    Times,
    Values,
    kept_times,
    milliseconds,
)
from trackmark.reports.tables import Table, text_table
from trackmark.trackers.base.interface import Box, Image
from trackmark.trackers.base.particles import normalise_log_weights
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import JointBins
from trackmark.trackers.histograms.target_model import EllipseHistograms, Likelihood, TargetModel

SEQUENCES = ("person", "car")
FRAMES, STRETCHES = 4, 4  # clips from the whole sequence, because the target's size changes
PLAIN = ("particles", "bins", "sigma", "update_reading", "update_threshold", "scale_persistence")

PAPERS_CLOCK = 800e6  # Hz
STEPS = 250_000  # steps of the operations that measure the clock frequency
CYCLES_PER_STEP = 6  # three shifts and three operations, each dependent on the one before
SHORTEST = 1e-9  # s


class _Weighting:
    """Tracker that weights its particles twice in every frame."""

    def __init__(self, spec: str) -> None:
        self._tracker: Any = parse_tracker(spec).make(np.random.SeedSequence(0))

    def init(self, image: Image, box: Box) -> None:
        self._tracker.init(image, box)
        settings = self._tracker.parameters
        self._ellipses = EllipseHistograms(
            JointBins(settings.colour, settings.bins), settings.kernel
        )
        histogram = self._tracker.histogram_of(image, box)
        self._model = TargetModel(histogram, settings.particles, False, settings.alpha)
        reading = settings.update_reading, settings.update_threshold
        self._likelihood = Likelihood(settings.sigma, *reading)

    def update(self, image: Image) -> None:
        particles = self._tracker.update(image).arrays["particles"]
        counts = self._ellipses.counts(SharedFrame(image), particles, self._model.bins)
        normalise_log_weights(self._likelihood.log(self._model.coefficients(counts)))


class _PlainWeighting(PlainFilter):
    """Plain filter that weights its particles twice in every frame."""

    def update(self, image: Image) -> None:
        super().update(image)
        self.weigh(self.codes(image))


class _ClockFrequency:
    """Dependent operations of one cycle each, whose time gives the clock frequency of the core."""

    def init(self, *_: object) -> None:
        pass

    def update(self, *_: object) -> None:
        _chain(np.uint64(1), STEPS)


@njit(cache=True)
def _chain(state: Any, steps: int) -> Any:
    """Run steps of the random generator xorshift (Marsaglia 2003)."""
    for _ in range(steps):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
    return state


def numpy_methods(specs: Mapping[str, str]) -> Methods:
    """Return the filter in NumPy, a variant that weights twice, and a measurement of the clock."""
    (spec,) = specs.values()
    options = {name: parse_tracker(spec).parameters[name] for name in PLAIN}
    filters = {"once": PlainFilter, "twice": _PlainWeighting}
    seed = np.random.SeedSequence(0)
    return {name: partial(method, seed, **options) for name, method in filters.items()} | {
        "clock": _ClockFrequency
    }


def compiled_methods(specs: Mapping[str, str]) -> Methods:
    """Return the compiled tracker, and a variant that weights its samples twice."""
    (spec,) = specs.values()
    make = partial(parse_tracker(spec).make, np.random.SeedSequence(0))
    return {"once": make, "twice": partial(_Weighting, spec)}


def _times(context: Context, setting: str, methods: MethodMaker) -> Times:
    return kept_times(context, methods, setting, ["adaptive"], SEQUENCES, FRAMES, STRETCHES)


def _at_800_mhz(times: Mapping[str, Values]) -> Values:
    """Return the time of equally many cycles at the paper's clock frequency [s].

    This is a lower bound: a processor of 2003 needs more cycles for the same work.
    """
    return times["once"] * (STEPS * CYCLES_PER_STEP / times["clock"]) / PAPERS_CLOCK


def _weighting(times: Mapping[str, Values]) -> tuple[Values, Values]:
    """Return the times of weighting and of the rest of an update [s]."""
    weighting = np.maximum(times["twice"] - times["once"], SHORTEST)
    return weighting, np.maximum(times["once"] - weighting, SHORTEST)


@measure("ms")
def frame_time_at_800_mhz(context: Context, setting: str) -> Pairs:
    """Return the time per frame at 800 MHz of the plain filter, on the slower sequence."""
    times = _times(context, setting, numpy_methods).values()
    slower = 1e3 * max(map(_at_800_mhz, times), key=np.mean)
    return [(slower, slower)]


@measure()
def car_over_person(context: Context, setting: str) -> Pairs:
    """Return the times of car and person."""
    times = _times(context, setting, compiled_methods)
    return [(times["car"]["once"], times["person"]["once"])]


@measure()
def weighting_over_rest(context: Context, setting: str) -> Pairs:
    """Return the times of weighting and of the rest of an update, on the person."""
    return [_weighting(_times(context, setting, compiled_methods)["person"])]


def time_table(context: Context) -> Table:
    """Return the table of times: both sequences in both settings."""
    rows = []
    for setting in SETTINGS:
        slow, fast = (
            _times(context, setting, methods) for methods in (numpy_methods, compiled_methods)
        )
        for name in SEQUENCES:
            times = slow[name]["once"], _at_800_mhz(slow[name]), fast[name]["once"]
            weighting_shares = [
                _weighting(times_of[name])[0] / times_of[name]["once"] for times_of in (slow, fast)
            ]
            shares = [f"{100 * float(np.median(share)):.0f} %" for share in weighting_shares]
            label = [name, SETTING_LABELS[setting], "real time at 800 MHz"]
            rows.append([*label, *map(milliseconds, times), *shares])
    headings = ["sequence", "setting", "paper", "NumPy [ms]", "NumPy at 800 MHz [ms]"]
    headings += ["compiled [ms]", "weighting, NumPy", "weighting, compiled"]
    caption = (
        "Time per frame with 100 samples, Fig. 5 (its values are not in the text). Our times "
        "are the median of 12 rounds. The column for 800 MHz assumes the same number of "
        "cycles at 800 MHz; the paper's processor needs more cycles for the same work. The last "
        "columns show the share of the time that weighting takes."
    )
    return text_table("times", caption, headings, rows, 2)
