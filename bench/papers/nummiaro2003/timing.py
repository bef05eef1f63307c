"""Times of the paper's tracker on the person and the car (Fig. 5, section 7)."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import SETTING_LABELS, SETTINGS
from trackmark.bench.papers.nummiaro2003.plain import PlainFilter
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.timing import (
    MethodMaker,
    Methods,
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


def numpy_methods(specs: Mapping[str, str]) -> Methods:
    """Return the filter in plain NumPy, and a variant that weights twice."""
    (spec,) = specs.values()
    options = {name: parse_tracker(spec).parameters[name] for name in PLAIN}
    filters = {"once": PlainFilter, "twice": _PlainWeighting}
    seed = np.random.SeedSequence(0)
    return {name: partial(method, seed, **options) for name, method in filters.items()}


def compiled_methods(specs: Mapping[str, str]) -> Methods:
    """Return the compiled tracker, and a variant that weights its samples twice."""
    (spec,) = specs.values()
    make = partial(parse_tracker(spec).make, np.random.SeedSequence(0))
    return {"once": make, "twice": partial(_Weighting, spec)}


def _times(context: Context, setting: str, methods: MethodMaker) -> Times:
    return kept_times(context, methods, setting, ["adaptive"], SEQUENCES, FRAMES, STRETCHES)


def _weighting(times: Mapping[str, Values]) -> Values:
    """Return the share of an update's time that weighting takes."""
    return np.maximum(times["twice"] / times["once"] - 1, 0)


def time_table(context: Context) -> Table:
    """Return the table of times: both sequences in both settings."""
    rows = []
    for setting in SETTINGS:
        slow, fast = (
            _times(context, setting, methods) for methods in (numpy_methods, compiled_methods)
        )
        for name in SEQUENCES:
            times = slow[name]["once"], fast[name]["once"]
            shares = [
                f"{100 * float(np.median(_weighting(times_of[name]))):.0f} %"
                for times_of in (slow, fast)
            ]
            label = [name, SETTING_LABELS[setting], "real time at 800 MHz"]
            rows.append([*label, *map(milliseconds, times), *shares])
    headings = ["sequence", "setting", "paper", "NumPy [ms]", "compiled [ms]"]
    headings += ["weighting, NumPy", "weighting, compiled"]
    caption = (
        "Time per frame with 100 samples, Fig. 5 (its values are not in the text). Our times "
        "are the median of 12 rounds. The last columns show the share of the time that weighting "
        "takes. The paper calls weighting the most time-consuming part."
    )
    return text_table("times", caption, headings, rows, 2)
