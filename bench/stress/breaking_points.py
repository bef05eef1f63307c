"""Breaking points: levels of a difficulty at which half of a tracker's runs survive.

A difficulty is a filter or a parameter of scenes. A series contains the runs of one tracker under
one difficulty. Each run of a series has its own scene or, on recorded data, its own start frame and
random filter. Runs of equal number have the same scene or start frame in all series.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isfinite, log, nan
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.psychometric import (
    N_FIRST_RUNS,
    N_NEXT_RUNS,
    Threshold,
    next_difficulties,
    threshold,
)
from trackmark.datasets.filters import FILTERS, split_filters, with_filters
from trackmark.datasets.spec_string import format_text, name_hint, parse_text
from trackmark.reports.figures import write_figure
from trackmark.reports.plots import SurvivalCurve, breaking_plot
from trackmark.reports.tables import MISSING, Cell, Table, failure_notes

ENOUGH = 0.05
"""Half-width of the interval, as a share of the range, at which no more runs are added."""

RULE = "A run is lost if its centre is outside the target's box in ten consecutive visible frames."
"""Definition of a lost run; see `first_loss` in the metrics preset `native`."""

LEVELS = 40
"""Number of steps of a range. Levels on this grid keep the names of runs short."""

SHORTEST = 40
"""Minimum number of frames of a sequence whose parameter `scene` is missing or set."""

PLACES = np.linspace(0, 1, 201)
"""Positions along a range, from 0 (easy) to 1 (hard), at which curves are evaluated."""

BINS = 8
"""Number of dots that summarise the runs of a series in a figure."""


@dataclass(frozen=True)
class Difficulty:
    """A filter or a parameter of scenes, between an easy and a hard level."""

    name: str
    unit: str
    easy: float
    hard: float
    whole: bool = False  # levels are integers
    logarithmic: bool = False
    is_filter: bool = True  # False: a parameter of the scenes

    def level(self, place: float) -> float:
        """Return the level at a position: 0 is the easy end of the range, 1 the hard end."""
        if self.logarithmic:
            return float(self.easy * (self.hard / self.easy) ** place)
        return self.easy + (self.hard - self.easy) * place

    def place(self, level: float) -> float:
        """Return the position of a level in the range; see `level`."""
        if self.logarithmic:
            return log(level / self.easy) / log(self.hard / self.easy)
        return (level - self.easy) / (self.hard - self.easy)

    def run_level(self, place: float) -> float:
        """Return the level of a run near a position, on the grid, rounded to three digits."""
        level = self.level(round(place * LEVELS) / LEVELS)
        return float(round(level)) if self.whole else float(f"{level:.3g}")

    @property
    def head(self) -> str:
        """Name, unit and range."""
        return f"{self.name} [{self.unit}], {self.easy:g} to {self.hard:g}"


def parse_difficulty(text: str, sequences: Sequence[str]) -> Difficulty:
    """Parse `NAME` or `NAME=FROM..TO`: a filter, or a parameter of the scenes.

    Raises `ExperimentError` for an unknown name or an invalid range.
    """
    name, equals, limits = text.partition("=")
    try:
        ends = [float(end) for end in limits.split("..")] if equals else []
    except ValueError:
        ends = [nan]
    if equals and (len(ends) != 2 or ends[0] == ends[1] or not all(map(isfinite, ends))):
        raise ExperimentError(
            f"--knob {text}: invalid range. Expected: {name}=FROM..TO; FROM is the easy end."
        )
    filters = {key: kind for key, kind in FILTERS.items() if key != "start"}
    if name in filters:
        kind = filters[name]
        easy, hard = ends or (kind.easy, kind.hard)
        if kind.logarithmic and min(easy, hard) <= 0:
            raise ExperimentError(f"--knob {text}: both ends of this range must be above 0.")
        return Difficulty(name, kind.unit, easy, hard, kind.whole, kind.logarithmic)
    for sequence in sequences:
        options = {option["name"]: option for option in datasets.options(_bare(sequence))}
        if name not in options or name == "scene":
            raise ExperimentError(
                f"--knob {name}: {sequence} has no such parameter."
                f"{name_hint(name, [*filters, *options])}"
            )
        default = options[name]["default"]
        if not ends or type(default) not in (int, float):
            problem = "the parameter is not a number" if ends else "the range is missing"
            raise ExperimentError(f"--knob {text}: {problem}. Expected: {name}=FROM..TO.")
    _, bracket, unit = options[name]["meaning"].rpartition("[")
    unit = unit.rstrip("]") if bracket else "share"
    return Difficulty(name, unit, ends[0], ends[1], isinstance(default, int), is_filter=False)


@dataclass(frozen=True)
class RunSequences:
    """Sequences of numbered runs; successive runs use the given sequences in turn.

    If the parameter `scene` of a sequence is not set, each run has another scene. Runs on any other
    sequence start at different frames of its first quarter.
    """

    sequences: Sequence[str]  # specifications

    def __post_init__(self) -> None:
        """Raise `ExperimentError` for a sequence that is too short."""
        _ = self._start_frames

    def text(self, axis: Difficulty, level: float, number: int) -> str:
        """Return the specification of the sequence of a run, numbered from 0, at a level."""
        turn, index = divmod(number, len(self.sequences))
        bare, filters = split_filters(self.sequences[index])
        start_frames = self._start_frames[index]
        options: dict[str, float] = {} if start_frames else {"scene": turn}
        if start_frames and turn:
            filters["start"] = filters.get("start", 0) + int(_halving(turn) * start_frames)
        if number:
            filters["draw"] = number
        if axis.is_filter:
            filters[axis.name] = level
        else:
            options[axis.name] = int(level) if axis.whole else level
        return with_filters(format_text(bare, options), filters)

    @cached_property
    def _start_frames(self) -> list[int]:
        """Number of possible start frames by sequence; 0 if each run has another scene."""
        return [_start_frames(text) for text in self.sequences]


def _start_frames(text: str) -> int:
    bare = _bare(text)
    names = [option["name"] for option in datasets.options(bare)]
    if "scene" in names and "scene" not in parse_text(bare)[1]:
        return 0
    frames = len(datasets.load(text))
    if frames < SHORTEST:
        raise ExperimentError(
            f"{text}: {frames} frames are too few for runs that start at different frames. "
            f"Give a sequence of {SHORTEST} frames or more."
        )
    return frames // 4


def _bare(text: str) -> str:
    """Return the specification of a sequence without its filters."""
    return split_filters(text)[0]


def _halving(number: int) -> float:
    """Return an element of van der Corput's sequence, which fills [0, 1) evenly."""
    digits = f"{number:b}"[::-1]
    return float(int(digits, 2) / 2.0 ** len(digits))


@dataclass(frozen=True)
class Trial:
    """One run of a series."""

    sequence: str  # specification
    level: float
    survived: bool
    failure: str = ""


@dataclass(frozen=True)
class Series:
    """Runs of a tracker under a difficulty."""

    tracker: str  # label
    axis: Difficulty  # difficulty whose level varies between runs
    sequences: RunSequences
    max_runs: int
    trials: Sequence[Trial] = field(default_factory=tuple)

    @cached_property
    def threshold(self) -> Threshold:
        """Position in the range at which half of the runs survive."""
        places = [self.axis.place(trial.level) for trial in self.trials]
        return threshold(places, [trial.survived for trial in self.trials])

    @property
    def verdict(self) -> str:
        """`broken`; `never` or `at once` if the breaking point is past the hard or easy end."""
        place = self.threshold.median
        return "never" if place > 1 else "at once" if place < 0 else "broken"

    @property
    def level(self) -> float:
        """Breaking point: the level at which half of the runs survive."""
        return self.axis.level(self.threshold.median)

    @property
    def interval(self) -> Interval:
        """95 % interval of the breaking point, from easy to hard; infinite beyond the range."""
        low, high = self.threshold.interval
        away = inf if self.axis.hard > self.axis.easy else -inf
        return Interval(
            self.axis.level(low) if low >= 0 else -away,
            self.axis.level(high) if high <= 1 else away,
        )

    def next_runs(self) -> list[tuple[str, float]]:
        """Return sequences and levels of the next runs; none if the interval is narrow enough."""
        done = len(self.trials)
        if not done:
            places: NDArray[np.float64] = (np.arange(N_FIRST_RUNS) + 0.5) / N_FIRST_RUNS
        else:
            low, high = self.threshold.interval
            if self.threshold.half_width <= ENOUGH or low > 1 or high < 0:
                return []
            key = crc32(self.tracker.encode()), crc32(self.axis.name.encode())
            random = np.random.default_rng(np.random.SeedSequence(done, spawn_key=key))
            places = next_difficulties(self.threshold, random, N_NEXT_RUNS)
        levels = [self.axis.run_level(place) for place in places[: self.max_runs - done].tolist()]
        return [
            (self.sequences.text(self.axis, level, done + i), level)
            for i, level in enumerate(levels)
        ]

    def with_outcomes(self, outcomes: Mapping[str, tuple[bool, str]]) -> "Series":
        """Return the series extended by its next runs.

        `outcomes`: by sequence, whether the run survived and the reason of a failure.
        """
        new = [Trial(text, level, *outcomes[text]) for text, level in self.next_runs()]
        return replace(self, trials=[*self.trials, *new])


def factor(series: Series, baseline: Series) -> tuple[float, Interval]:
    """Return the ratio of a tracker's breaking point to the baseline's, and its 95 % interval.

    A ratio above 1 means that the tracker survives harder levels. If a tracker never breaks, the
    ratio is a lower bound and the interval is open. It is NaN if the baseline does not break within
    the range, or for levels of 0 or below.
    """
    axis = series.axis
    if baseline.verdict != "broken" or series.verdict == "at once" or min(axis.easy, axis.hard) < 0:
        return nan, Interval(nan, nan)
    least = 1 / LEVELS / 10  # a level of 0 has no ratio
    limits = 0 if axis.easy else least, 1 if axis.hard else 1 - least
    shares = ((np.arange(200) + 0.5) / 200).tolist()
    places = np.array([[side.threshold.quantile(x) for x in shares] for side in (series, baseline)])
    levels = [axis.level(place) for place in np.clip(places, *limits).ravel().tolist()]
    logs = np.log(levels).reshape(places.shape) * (1 if axis.hard > axis.easy else -1)
    ratios = logs[0][:, None] - logs[1][None]
    middle, low = (float(np.exp(end)) for end in (np.median(ratios), np.quantile(ratios, 0.025)))
    ratios[places[0] > 1] = inf
    return middle, Interval(low, float(np.exp(np.quantile(ratios, 0.975, method="higher"))))


@dataclass(frozen=True)
class BreakingPoints:
    """Series of several trackers and difficulties, compared with a baseline tracker."""

    series: Sequence[Series]
    baseline: str  # label

    @cached_property
    def axes(self) -> dict[Difficulty, dict[str, Series]]:
        """Series by difficulty and tracker."""
        by_axis: dict[Difficulty, dict[str, Series]] = {}
        for series in self.series:
            by_axis.setdefault(series.axis, {})[series.tracker] = series
        return by_axis

    @cached_property
    def points(self) -> list[dict[str, Any]]:
        """One row of values per series; values beyond the range are None."""
        return [_row(series, self.axes[series.axis][self.baseline]) for series in self.series]

    @cached_property
    def runs(self) -> list[dict[str, Any]]:
        """All runs, with difficulty and tracker."""
        return [
            {"knob": series.axis.name, "tracker": series.tracker, **vars(trial)}
            for series in self.series
            for trial in series.trials
        ]


def _row(series: Series, baseline: Series) -> dict[str, Any]:
    axis = series.axis
    ratio, ratios = factor(series, baseline)
    easy, hard = series.threshold.survival([0.0, 1.0]).tolist()
    return {
        "knob": axis.name,
        "unit": axis.unit,
        "easy": axis.easy,
        "hard": axis.hard,
        "tracker": series.tracker,
        "breaks": series.verdict,
        "level": series.level if series.verdict == "broken" else None,
        "level_low": _finite(series.interval.low),
        "level_high": _finite(series.interval.high),
        "factor": _finite(ratio),
        "factor_low": _finite(ratios.low),
        "factor_high": _finite(ratios.high),
        "half_width_in_ranges": series.threshold.half_width,
        "survive_at_easy": easy,
        "survive_at_hard": hard,
        "runs": len(series.trials),
    }


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def as_data(result: BreakingPoints) -> dict[str, Any]:
    """Return the object of `--json`; values beyond the range are null."""
    return {
        "rule": RULE,
        "baseline": result.baseline,
        "series": [
            {**row, "runs": [vars(trial) for trial in series.trials]}
            for row, series in zip(result.points, result.series, strict=True)
        ],
    }


def answer_lines(result: BreakingPoints) -> list[str]:
    """Return a sentence per difficulty: the trackers by their breaking points, the best first."""
    lines = []
    for axis in dict.fromkeys(series.axis for series in result.series):
        pairs = zip(result.series, result.points, strict=True)
        rows = [(series, row) for series, row in pairs if series.axis == axis]
        rows.sort(key=lambda pair: -pair[0].threshold.median)
        words = {"never": f"never breaks up to {axis.hard:g}", "at once": "breaks at once"}
        parts = [
            f"{series.tracker} {words.get(row['breaks'], f'breaks at {_level(row)}')}"
            for series, row in rows
        ]
        lines.append(f"{axis.head}: {', '.join(parts)}.")
    return lines


def tables(result: BreakingPoints, *, whole: bool = False) -> list[Table]:
    """Return the table of breaking points; if `whole`, also the table of all runs."""
    return [_points(result), *([_runs(result)] if whole else [])]


def _points(result: BreakingPoints) -> Table:
    rows = []
    for series, row in zip(result.series, result.points, strict=True):
        harder = "1" if series.tracker == result.baseline else _factor(row)
        shares = f"{100 * row['survive_at_easy']:.0f} … {100 * row['survive_at_hard']:.0f}"
        texts = [series.axis.head, series.tracker, _level(row), _interval(series), harder, shares]
        rows.append([Cell(text) for text in (*texts, str(row["runs"]))])
    runs = pd.DataFrame(result.runs)
    runs["status"] = np.where(runs["failure"] == "", "finished", "failed")
    failures = failure_notes(runs, "lost", "counted as lost")
    end = (
        f"No more runs are added if the interval is within ±{100 * ENOUGH:g} % of the range or "
        "entirely outside the range, or after --runs runs."
    )
    return Table(
        name="breaking-points",
        caption=(
            "Breaking points: the level at which half of the runs survive, with 95 % intervals; "
            f"factor: how much harder this level is than the breaking point of {result.baseline}."
        ),
        heads=[
            "difficulty",
            "tracker",
            "breaks at",
            "95 %",
            "factor",
            "survive at ends [%]",
            "runs",
        ],
        n_labels=2,
        rows=rows,
        notes=[RULE, end, *(f"{tracker}: {note}" for tracker, note in failures.items())],
        data=pd.DataFrame(result.points),
        ranks=[0, 1, 2, 4, 3],
    )


def _level(row: Mapping[str, Any]) -> str:
    if row["breaks"] == "never":
        return f"never to {row['hard']:g}"
    return "at once" if row["breaks"] == "at once" else f"{row['level']:.3g}"


def _interval(series: Series) -> str:
    """Return the interval as text, from the easier to the harder end, clipped at the range."""
    axis, places = series.axis, series.threshold.interval
    before = f"{'before' if axis.hard > axis.easy else 'above'} {axis.easy:g}"
    beyond = f"beyond {axis.hard:g}"
    if places.low > 1 or places.high < 0:
        return beyond if places.low > 1 else before
    low = before if places.low < 0 else f"{series.interval.low:.3g}"
    return f"{low} to {beyond if places.high > 1 else f'{series.interval.high:.3g}'}"


def _factor(row: Mapping[str, Any]) -> str:
    ratio, low, high = (row[key] for key in ("factor", "factor_low", "factor_high"))
    if ratio is None:
        return MISSING
    if row["breaks"] == "never":
        return f"more than {_times(low)}"
    return f"{_times(ratio)} ({_times(low)} to {'more' if high is None else _times(high)})"


def _times(ratio: float) -> str:
    """Return a ratio with two digits, without a power of ten."""
    return f"{ratio:.2g}" if ratio < 99.5 else f"{ratio:.0f}"


def _runs(result: BreakingPoints) -> Table:
    heads = ["knob", "tracker", "sequence", "level", "survived"]
    rows = [[Cell(str(row[head])) for head in heads] for row in result.runs]
    return Table("runs", f"All runs. {RULE}", heads, 3, rows, data=pd.DataFrame(result.runs))


def write_curves(result: BreakingPoints, folder: Path) -> list[Path]:
    """Write a figure of survival by level for each difficulty; return the files."""
    paths = []
    for axis, by_tracker in result.axes.items():
        levels = np.array([axis.level(place) for place in PLACES.tolist()])
        curves = {name: _curve(series, levels) for name, series in by_tracker.items()}
        title = f"Runs that survive under {axis.name}"
        figure = breaking_plot(curves, f"{axis.name} [{axis.unit}]", title, axis.logarithmic)
        paths.append(write_figure(folder / f"curve-{axis.name}.png", figure))
    return paths


def _curve(series: Series, levels: NDArray[np.float64]) -> SurvivalCurve:
    """Return the survival curve, dots for groups of neighbouring runs, and the interval."""
    axis = series.axis
    runs = [(axis.place(trial.level), trial.survived) for trial in series.trials]
    groups = np.array_split(sorted(runs, key=lambda run: run[0]), min(BINS, len(runs)))
    dots = (
        np.array([axis.level(float(np.mean(group[:, 0].copy()))) for group in groups]),
        np.array([np.mean(group[:, 1]) for group in groups]),
        np.array([float(len(group)) for group in groups]),
    )
    ends = [nan, nan]
    if series.verdict == "broken":
        ends = [axis.level(min(1.0, max(0.0, end))) for end in series.threshold.interval]
    return SurvivalCurve(levels, series.threshold.survival(PLACES), *dots, *ends)
