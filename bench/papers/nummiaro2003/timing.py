"""Times of the paper's tracker: what Fig. 5 shows, what the claims on time rest on, their tables.

All are CPU times. Those of the timing runs are the tracker's as written; beside them, in turns on
the same images, it is timed against a plain filter in NumPy with the same random numbers, by
samples, area and bins, and in its parts.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from itertools import repeat
from pathlib import Path
from time import thread_time
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from numba import njit

import trackers
from bench.papers.in_turns import Update, beginning, in_turns, slope
from bench.papers.nummiaro2003.plain import PlainFilter
from bench.papers.tables import text_table
from bench.papers.timed import frame_times
from bench.store.layout import Cell
from reports.tables import MISSING, Table
from trackers.base.interface import Box, Image
from trackers.base.particles import normalised
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.target_model import Ellipses, Likelihood, TargetModel

__all__ = [
    "SWEEPS",
    "clock_rate",
    "compiled_filter",
    "cost_slopes",
    "cost_times",
    "measured_times",
    "plain_filter",
    "side_by_side",
    "time_tables",
    "weighting_times",
]

Tables: TypeAlias = Mapping[str, pd.DataFrame]

SEQUENCES = ("nummiaro2003/person", "nummiaro2003/car")
STUDENTS = "nummiaro2003/students"
PAPERS_CLOCK = 800e6  # Hz
FRAME = 40.0  # milliseconds

PARTICLES, BINS = 100, 8
SWEEPS: Mapping[str, Sequence[float]] = {
    "samples": (50, 100, 200, 300, 400),
    "area": (0.5, 1.0, 2.0, 3.0, 4.0),  # of the given ellipse's
    "bins": (4, 6, 8, 12, 16),  # a channel
}
"""What is changed, one at a time, for the cost of each."""

UNITS = {"samples": ("µs a sample", 1e6), "area": ("ns a px²", 1e9), "bins": ("ns a bin", 1e9)}

ROUNDS = 7  # updates of which the median is taken
STEPS = 5_000_000  # of the chain that tells the clock
CYCLES_A_STEP = 6  # three shifts and three operations, none of which can begin before the last


def measured_times(
    folder: Path, cells: Collection[Cell] | None = None, *, quick: bool = False
) -> dict[str, pd.DataFrame]:
    """What the claims on time rest on, by the names that the ledger gives.

    Parameters
    ----------
    folder : Path
        Results of the timing experiment.
    cells : collection of Cell, optional
        The runs that are meant; all by default.
    quick : bool
        Measure few frames and rounds.

    Returns
    -------
    dict of str to DataFrame
        `run_times`: `sequence`, `repetition`, `frame`, `seconds` and `area` (of the mean state's
        ellipse [pixels²]) of the timing runs (Fig. 5); `frame_times`: medians of these over the
        repetitions. `plain_times`: a row a sequence, see `_at_two_clocks`. `model_times`, a row a
        frame of `students`: `one` model and one `per_particle` [seconds]. `time_slopes`: see
        `cost_slopes`, with `implementation`. `profile`: `sequence`, `implementation`,
        `weighting_share` (of an update, the median over frames).
    """
    frames, blocks = (10, 2) if quick else (100, 6)
    runs = frame_times(folder, cells, ("half_width", "half_height"))
    runs["area"] = np.pi * runs["half_width"] * runs["half_height"]
    plain = [
        side_by_side(name, {"plain": plain_filter()}, frames).assign(sequence=name)
        for name in SEQUENCES
    ]
    slopes = [
        cost_slopes(cost_times(SEQUENCES[0], make, blocks)).assign(implementation=implementation)
        for implementation, make in (("compiled", compiled_filter), ("plain", plain_filter))
    ]
    models = {"one": compiled_filter(), "per_particle": compiled_filter(models="per-particle")}
    parts = weighting_times(SEQUENCES, frames)
    parts["weighting_share"] = parts["weighting"] / parts["update"]
    shares = parts.groupby(["sequence", "implementation"], as_index=False)[["weighting_share"]]
    return {
        "run_times": runs,
        "frame_times": runs.groupby(["sequence", "frame"], as_index=False)[
            ["seconds", "area"]
        ].median(),
        "plain_times": _at_two_clocks(pd.concat(plain, ignore_index=True), clock_rate()),
        "time_slopes": pd.concat(slopes, ignore_index=True),
        "model_times": side_by_side(STUDENTS, models, frames),
        "profile": shares.median(),
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

    Parameters
    ----------
    names : sequence of str
        Sequences.
    frames : int
        How many of each, from the first.

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


def clock_rate() -> float:
    """Clock of the core that this runs on [Hz], by a chain of operations of a cycle each."""
    _chain(np.uint64(1), 1)
    seconds = []
    for _ in range(ROUNDS):
        began = thread_time()
        _chain(np.uint64(1), STEPS)
        seconds.append(thread_time() - began)
    return STEPS * CYCLES_A_STEP / min(seconds)


def time_tables(tables: Tables, failed: Sequence[str] = ()) -> list[Table]:
    """Milliseconds a frame, and what they grow with.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        See `measured_times`.
    failed : sequence of str
        Timing runs that failed, a line each.
    """
    return [_frame_table(tables, failed), _cost_table(tables["time_slopes"])]


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


def _at_two_clocks(times: pd.DataFrame, clock: float) -> pd.DataFrame:
    """Milliseconds of an update in plain NumPy on this core, and at the paper's clock.

    `milliseconds`, `lower_quartile` and `upper_quartile` over frames; `milliseconds_at_800_mhz`,
    which as many cycles take; the `clock` [Hz].
    """
    rows = []
    for sequence, updates in times.groupby("sequence", sort=False):
        low, middle, high = (1e3 * updates["plain"].quantile(q) for q in (0.25, 0.5, 0.75))
        rows.append(
            {
                "sequence": sequence,
                "milliseconds": middle,
                "milliseconds_at_800_mhz": middle * clock / PAPERS_CLOCK,
                "lower_quartile": low,
                "upper_quartile": high,
                "clock": clock,
            }
        )
    return pd.DataFrame(rows)


def _frame_table(tables: Tables, failed: Sequence[str]) -> Table:
    shares = tables["profile"].set_index(["sequence", "implementation"])["weighting_share"]
    data = []
    for _, row in tables["plain_times"].iterrows():
        name = str(row["sequence"])
        timed = tables["frame_times"].query("sequence == @name")
        low, middle, high = (1e3 * timed["seconds"].quantile(q) for q in (0.25, 0.5, 0.75))
        quartiles = f"[{row['lower_quartile']:.1f}–{row['upper_quartile']:.1f}]"
        data.append(
            {
                "sequence": name,
                "ellipse [px²]": f"{timed['area'].median():.0f}" if len(timed) else MISSING,
                "compiled [ms]": f"{middle:.2f} [{low:.2f}–{high:.2f}]" if len(timed) else MISSING,
                "plain [ms]": f"{row['milliseconds']:.1f} {quartiles}",
                "plain, at 800 MHz [ms]": f"{row['milliseconds_at_800_mhz']:.0f}",
                "weighting, compiled": f"{100 * shares[name, 'compiled']:.0f} %",
                "weighting, plain": f"{100 * shares[name, 'plain']:.0f} %",
            }
        )
    models = tables["model_times"]
    ratio = (models["per_particle"] / models["one"]).median()
    table = text_table(
        "time",
        "Time a frame, CPU, 100 samples, one thread: median and quartiles over frames (the "
        "paper: real time on a PC of 800 MHz; the values of its Fig. 5 are lost)",
        data,
        n_labels=1,
    )
    notes = [
        "plain is the same filter in NumPy, sample by sample, with the same estimates; at 800 "
        "MHz it would need as many cycles as here, where the core runs at "
        f"{tables['plain_times']['clock'].iloc[0] / 1e9:.2f} GHz; a frame has {FRAME:.0f} ms",
        f"a model for each sample takes {ratio:.1f} times as long as "
        "one for all, compiled, on students (median over frames)",
        "weighting: bins, histograms and weights of the samples, of the whole update's time",
        "timing runs that other load disturbed are left out; where none is left, a dash",
        *failed,
    ]
    return replace(table, notes=notes)


def _cost_table(slopes: pd.DataFrame) -> Table:
    data = []
    for factor, rows in slopes.groupby("factor", sort=False):
        unit, scale = UNITS[str(factor)]
        row = {"time grows with": f"{factor} [{unit}]"}
        for line in rows.to_dict("records"):
            name = str(line["implementation"])
            middle, low, high = (
                scale * line[key] for key in ("slope", "lower_limit", "upper_limit")
            )
            row[name] = f"{middle:.3g} [{low:.3g}, {high:.3g}]"
            row[f"{name}, R²"] = f"{line['r_squared']:.2f}"
        data.append(row)
    table = text_table(
        "time-cost",
        "What an update's time grows with: slopes with 95 % intervals of lines through medians "
        "of updates on one image, one thing changed at a time",
        data,
        n_labels=1,
    )
    notes = ["bins: all of them, 4 to 16 a channel; area: of the given ellipse, 0.5 to 4 times"]
    return replace(table, notes=notes)
