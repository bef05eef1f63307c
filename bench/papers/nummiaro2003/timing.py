"""Times of the paper's tracker: what Fig. 5 shows, what the claims on time rest on.

All are CPU times. Those of the timing runs are the tracker's as written; beside them, in turns on
the same images, it is timed against a plain filter in NumPy with the same random numbers, by
samples, area and bins, and in its parts.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import repeat
from time import thread_time
from typing import Any

import numpy as np
import pandas as pd
from numba import njit

import trackers
from bench.papers.context import Context
from bench.papers.nummiaro2003.plain import PlainFilter
from bench.papers.timing import Update, beginning, frame_times, in_turns, slope
from trackers.base.interface import Box, Image
from trackers.base.particles import normalised
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.target_model import Ellipses, Likelihood, TargetModel

__all__ = ["SWEEPS", "clock_rate", "compiled_filter", "cost_slopes", "cost_times"]
__all__ += ["plain_filter", "side_by_side", "tables", "weighting_times"]

TIMED = "nummiaro2003-figure-5"
SEQUENCES = ("nummiaro2003/person", "nummiaro2003/car")
STUDENTS = "nummiaro2003/students"
PAPERS_CLOCK = 800e6  # Hz

PARTICLES, BINS = 100, 8
SWEEPS: Mapping[str, Sequence[float]] = {
    "samples": (50, 100, 200, 300, 400),
    "area": (0.5, 1.0, 2.0, 3.0, 4.0),  # of the given ellipse's
    "bins": (4, 6, 8, 12, 16),  # a channel
}
"""What is changed, one at a time, for the cost of each."""

ROUNDS = 7  # updates of which the median is taken
STEPS = 5_000_000  # of the chain that tells the clock
CYCLES_A_STEP = 6  # three shifts and three operations, none of which can begin before the last


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """What the claims on time and the tables of times rest on.

    `run_times`: `sequence`, `repetition`, `frame`, `seconds` and `area` (of the mean state's
    ellipse [pixels²]) of the timing runs (Fig. 5); `frame_times`: medians over the repetitions.
    `plain_times`: `sequence`, `milliseconds` of an update in plain NumPy, its median over frames,
    and `milliseconds_at_800_mhz`, in which the paper's processor has as many cycles. `model_times`,
    a frame of `students` a row: `one` model and one `per_particle` [seconds]. `time_slopes`: see
    `cost_slopes`, with `implementation`. `profile`: `sequence`, `implementation`,
    `weighting_share` (of an update, the median over frames). `times`: what of these is printed, a
    `value` of `what` on a sequence.
    """
    frames, blocks = (10, 2) if context.effort.quick else (100, 6)
    runs = frame_times(context.results / TIMED, context.asked[TIMED], ("half_width", "half_height"))
    runs["area"] = np.pi * runs["half_width"] * runs["half_height"]
    medians = runs.groupby(["sequence", "frame"], as_index=False)[["seconds", "area"]].median()
    clock = clock_rate()
    plain = pd.concat(
        side_by_side(name, {"milliseconds": plain_filter()}, frames).assign(sequence=name)
        for name in SEQUENCES
    )
    plain["milliseconds"] *= 1e3
    plain["milliseconds_at_800_mhz"] = plain["milliseconds"] * clock / PAPERS_CLOCK
    models = {"one": compiled_filter(), "per_particle": compiled_filter(models="per-particle")}
    model_times = side_by_side(STUDENTS, models, frames)
    parts = weighting_times(SEQUENCES, frames)
    parts["weighting_share"] = parts["weighting"] / parts["update"]
    slopes = [
        cost_slopes(cost_times(SEQUENCES[0], make, blocks)).assign(implementation=implementation)
        for implementation, make in (("compiled", compiled_filter), ("plain", plain_filter))
    ]
    times = [
        _told(plain, "plain", plain["milliseconds"]),
        _told(plain, "plain at 800 MHz", plain["milliseconds_at_800_mhz"]),
        _told(medians, "area", medians["area"]),
        _told(medians, "compiled", 1e3 * medians["seconds"]),
        _told(parts, "weighting, " + parts["implementation"], 100 * parts["weighting_share"]),
        pd.DataFrame({"sequence": SEQUENCES, "what": "clock", "value": clock / 1e9}),
        pd.DataFrame({"value": model_times["per_particle"] / model_times["one"]}).assign(
            sequence=STUDENTS, what="models"
        ),
    ]
    shares = parts.groupby(["sequence", "implementation"], as_index=False)[["weighting_share"]]
    return {
        "run_times": runs,
        "frame_times": medians,
        "plain_times": plain.groupby("sequence", as_index=False, sort=False).median(),
        "model_times": model_times,
        "time_slopes": pd.concat(slopes, ignore_index=True),
        "profile": shares.median(),
        "times": pd.concat([one for one in times if len(one)], ignore_index=True),
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


def side_by_side(name: str, filters: Mapping[str, Any], frames: int) -> pd.DataFrame:
    """CPU seconds of updates on the first so many frames of a sequence; a column each."""
    images, box = beginning(name, frames)
    for one in filters.values():
        one.init(images[0], box)
    return in_turns({label: one.update for label, one in filters.items()}, images[1:])


def cost_times(name: str, make: Callable[[int, int], Any], blocks: int) -> pd.DataFrame:
    """Times of updates on the first image of a sequence, for all settings in turn.

    `make` gives a filter for a number of samples and of bins a channel. A row a block of some
    rounds: `factor` (samples, area, bins), `value` (their number; pixels²; the number of bins in
    all), `seconds` (the median).
    """
    (image, *_), box = beginning(name, 0)
    values, updates = {}, {}
    for factor, settings in SWEEPS.items():
        for setting in settings:
            particles = int(setting) if factor == "samples" else PARTICLES
            bins = int(setting) if factor == "bins" else BINS
            enlarged = _enlarged(box, setting if factor == "area" else 1.0)
            one = make(particles, bins)
            one.init(image, enlarged)
            area = np.pi / 4 * enlarged[2] * enlarged[3]
            known = {"samples": particles, "area": area, "bins": bins**3}
            values[f"{factor} {setting}"] = factor, known[factor]
            updates[f"{factor} {setting}"] = one.update
    medians = [in_turns(updates, repeat(image, ROUNDS)).median() for _ in range(blocks)]
    return pd.DataFrame(
        {"factor": factor, "value": value, "seconds": block[label]}
        for block in medians
        for label, (factor, value) in values.items()
    )


def cost_slopes(costs: pd.DataFrame) -> pd.DataFrame:
    """Lines through the times of `cost_times`, a row a factor: `factor`, and what `slope` gives.

    In seconds a sample, a pixel² and a bin.
    """
    return pd.DataFrame(
        {"factor": factor} | slope(times["value"], times["seconds"])
        for factor, times in costs.groupby("factor", sort=False)
    )


def weighting_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """Updates, and observing and weighting their samples once more, on a sequence's first frames.

    A row a frame: `sequence`, `implementation`, `update` and `weighting` [seconds].
    """
    pieces = []
    for name in names:
        images, box = beginning(name, frames)
        for implementation, parts_of in (("compiled", _compiled_parts), ("plain", _plain_parts)):
            found = in_turns(parts_of(images[0], box), images[1:], shuffled=False)
            pieces.append(found.assign(sequence=name, implementation=implementation))
    return pd.concat(pieces, ignore_index=True)


def clock_rate() -> float:
    """Clock of the core that this runs on [Hz], by a chain of operations of a cycle each."""
    _chain(np.uint64(1), 1)
    seconds = []
    for _ in range(ROUNDS):
        began = thread_time()
        _chain(np.uint64(1), STEPS)
        seconds.append(thread_time() - began)
    return STEPS * CYCLES_A_STEP / min(seconds)


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


def _told(
    rows: pd.DataFrame, what: "str | pd.Series[str]", values: "pd.Series[float]"
) -> pd.DataFrame:
    return pd.DataFrame({"sequence": rows["sequence"], "what": what, "value": values})
