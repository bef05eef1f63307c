"""Where trackers break: one knob is turned, runs are placed where they tell most.

A series is a tracker under a knob. Its runs survive or are lost; each has a scene of its own, or
a start and a draw of its own in recorded data, which the series of every tracker and knob share:
their runs of the same number are matched pairs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isfinite, log, nan
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.psychometric import FIRST, NEXT, Threshold, next_places, threshold
from trackmark.datasets.filters import FILTERS, split_filters, with_filters
from trackmark.datasets.spec_string import close_match, format_text, parse_text

ENOUGH = 0.05
"""Half of an interval's width, in ranges, with which a series ends early."""

RULE = "A run survives unless its centre is outside the target's box for ten visible frames on end."
"""As `first_loss` of the metrics preset `native` has it."""

LEVELS = 40
"""Steps of a range: runs are placed on these, so that names of levels are short."""

SHORTEST = 40
"""Frames of a sequence that runs begin in at different ones."""


@dataclass(frozen=True)
class Knob:
    """What is turned, between an easy and a hard level."""

    name: str
    unit: str
    easy: float
    hard: float
    whole: bool = False
    logarithmic: bool = False
    over: bool = True  # a filter, which any sequence takes; else a knob of the scenes

    def level(self, place: float) -> float:
        """Level at a place, in ranges; exact, and beyond the range where the place is."""
        if self.logarithmic:
            return float(self.easy * (self.hard / self.easy) ** place)
        return self.easy + (self.hard - self.easy) * place

    def place(self, level: float) -> float:
        """Place of a level, in ranges."""
        if self.logarithmic:
            return log(level / self.easy) / log(self.hard / self.easy)
        return (level - self.easy) / (self.hard - self.easy)

    def shown(self, place: float) -> float:
        """A level that a run can have: on the grid, with three digits, whole where it must be."""
        level = self.level(round(place * LEVELS) / LEVELS)
        return float(round(level)) if self.whole else float(f"{level:.3g}")

    @property
    def head(self) -> str:
        """Name, unit and range."""
        return f"{self.name} [{self.unit}], {self.easy:g} to {self.hard:g}"


def knob_of(text: str, sequences: Sequence[str]) -> Knob:
    """Return the knob of `NAME` or `NAME=FROM..TO`: a filter, or an option of the scenes.

    Raises `ExperimentError` for an unknown name or an invalid range.
    """
    name, equals, limits = text.partition("=")
    try:
        ends = [float(end) for end in limits.split("..")] if equals else []
    except ValueError:
        ends = [nan]
    if equals and (len(ends) != 2 or ends[0] == ends[1] or not all(map(isfinite, ends))):
        raise ExperimentError(f"knob {text!r}: give a range as {name}=FROM..TO, easy to hard.")
    filters = {key: kind for key, kind in FILTERS.items() if key != "start"}
    if name in filters:
        kind = filters[name]
        easy, hard = ends or (kind.easy, kind.hard)
        if kind.logarithmic and min(easy, hard) <= 0:
            raise ExperimentError(f"knob {text!r}: both ends must be above 0.")
        return Knob(name, kind.unit, easy, hard, kind.whole, kind.logarithmic)
    for sequence in sequences:
        options = {key["name"]: key for key in datasets.options(split_filters(sequence)[0])}
        if name not in options or name == "scene":
            raise ExperimentError(
                f"{sequence} has no knob {name!r}.{close_match(name, [*filters, *options])} "
                f"Filters go over any sequence: {', '.join(filters)}."
            )
        if not ends or type(options[name]["default"]) not in (int, float):
            raise ExperimentError(f"knob {name!r} of scenes: give numbers, {name}=FROM..TO.")
    _, bracket, unit = options[name]["meaning"].rpartition("[")
    whole = isinstance(options[name]["default"], int)
    unit = unit.rstrip("]") if bracket else "share"
    return Knob(name, unit, ends[0], ends[1], whole, over=False)


@dataclass(frozen=True)
class Course:
    """What runs take place on: the sequences in turn.

    A sequence with a free knob `scene` gives a new scene each time; any other begins at another
    frame of its first quarter, as long as there are any.
    """

    sequences: Sequence[str]  # text forms

    def __post_init__(self) -> None:
        """Raise `ExperimentError` for a sequence that is too short."""
        _ = self._kinds

    def text(self, knob: Knob, level: float, number: int) -> str:
        """Return the sequence of the run of this number, from 0, at a level."""
        turn, index = divmod(number, len(self.sequences))
        bare, filters = split_filters(self.sequences[index])
        free, quarter = self._kinds[index]
        options: dict[str, float] = {"scene": turn} if free else {}
        if not free and turn:
            filters["start"] = filters.get("start", 0) + int(_halving(turn) * quarter)
        if number:
            filters["draw"] = number
        if knob.over:
            filters[knob.name] = level
        else:
            options[knob.name] = int(level) if knob.whole else level
        return with_filters(format_text(bare, options), filters)

    @cached_property
    def _kinds(self) -> list[tuple[bool, int]]:
        """True by sequence if its scenes are free; number of frames at which runs may start."""
        return [_kind(text) for text in self.sequences]


def _kind(text: str) -> tuple[bool, int]:
    bare = split_filters(text)[0]
    names = [option["name"] for option in datasets.options(bare)]
    if "scene" in names and "scene" not in parse_text(bare)[1]:
        return True, 1
    frames = len(datasets.load(text))
    if frames < SHORTEST:
        raise ExperimentError(
            f"{text}: it is too short to begin at different frames: it needs {SHORTEST}."
        )
    return False, frames // 4


def _halving(number: int) -> float:
    """Return an element of van der Corput's sequence, which fills [0, 1) evenly at any length."""
    digits = f"{number:b}"[::-1]
    return float(int(digits, 2) / 2.0 ** len(digits))


@dataclass(frozen=True)
class Trial:
    """One run of a series."""

    sequence: str  # text form
    level: float
    survived: bool
    failure: str = ""


@dataclass(frozen=True)
class Series:
    """A tracker under a knob, as far as it went."""

    tracker: str  # label
    knob: Knob
    course: Course
    most: int  # runs
    trials: Sequence[Trial] = field(default_factory=tuple)

    @cached_property
    def threshold(self) -> Threshold:
        """Where along the range half of the runs survive."""
        places = [self.knob.place(trial.level) for trial in self.trials]
        return threshold(places, [trial.survived for trial in self.trials])

    @property
    def verdict(self) -> str:
        """`broken` within the range; or `never` or `at once`, where it lies beyond an end."""
        place = self.threshold.place
        return "never" if place > 1 else "at once" if place < 0 else "broken"

    @property
    def level(self) -> float:
        """The breaking point."""
        return self.knob.level(self.threshold.place)

    @property
    def interval(self) -> Interval:
        """Its 95 % interval from the easier to the harder end; infinite beyond the range."""
        low, high = self.threshold.interval
        away = inf if self.knob.hard > self.knob.easy else -inf
        return Interval(
            self.knob.level(low) if low >= 0 else -away,
            self.knob.level(high) if high <= 1 else away,
        )

    def wanted(self) -> list[tuple[str, float]]:
        """Sequences and levels of the next runs; none when it is known well enough."""
        done = len(self.trials)
        if not done:
            places: NDArray[np.float64] = (np.arange(FIRST) + 0.5) / FIRST
        else:
            now = self.threshold
            low, high = now.interval
            if now.half_width <= ENOUGH or low > 1 or high < 0:
                return []
            key = crc32(self.tracker.encode()), crc32(self.knob.name.encode())
            random = np.random.default_rng(np.random.SeedSequence(done, spawn_key=key))
            places = next_places(now, random, NEXT)
        levels = [self.knob.shown(place) for place in places[: self.most - done].tolist()]
        return [
            (self.course.text(self.knob, level, done + i), level) for i, level in enumerate(levels)
        ]

    def with_trials(self, outcomes: Mapping[str, tuple[bool, str]]) -> "Series":
        """The series after the runs that it wanted, by their sequences: survived, and why not."""
        new = [Trial(text, level, *outcomes[text]) for text, level in self.wanted()]
        return replace(self, trials=[*self.trials, *new])


def factor(series: Series, baseline: Series) -> tuple[float, Interval]:
    """Return how much harder a level a tracker bears than the baseline, and its 95 % interval.

    If a tracker never breaks it is a lower bound with an infinite upper end. It is NaN if the
    baseline does not break within the range, or for levels below 0, which have no ratio.
    """
    knob = series.knob
    if baseline.verdict != "broken" or series.verdict == "at once" or min(knob.easy, knob.hard) < 0:
        return nan, Interval(nan, nan)
    least = 1 / LEVELS / 10  # a level of 0 has no ratio
    limits = 0 if knob.easy else least, 1 if knob.hard else 1 - least
    shares = ((np.arange(200) + 0.5) / 200).tolist()
    places = np.array([[side.threshold.quantile(x) for x in shares] for side in (series, baseline)])
    levels = [knob.level(place) for place in np.clip(places, *limits).ravel().tolist()]
    logs = np.log(levels).reshape(places.shape) * (1 if knob.hard > knob.easy else -1)
    ratios = logs[0][:, None] - logs[1][None]
    middle, low = (float(np.exp(end)) for end in (np.median(ratios), np.quantile(ratios, 0.025)))
    ratios[places[0] > 1] = inf
    return middle, Interval(low, float(np.exp(np.quantile(ratios, 0.975, method="higher"))))
