"""Breaking points: levels of a difficulty at which half of a tracker's runs survive.

A difficulty is a filter or a parameter of scenes. A stress test consists of the runs of one tracker
under one difficulty. Each of its runs has its own scene or, on recorded data, its own start frame
and random filter. Runs of equal number have the same scene or start frame in all stress tests.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf, isfinite, log, nan
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.analysis.score_tables import failure_notes
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.output_files import write_file
from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.psychometric import (
    N_FIRST_RUNS,
    N_NEXT_RUNS,
    Threshold,
    next_difficulties,
    threshold,
)
from trackmark.bench.stress.breaking_plot import SurvivalCurve, breaking_plot
from trackmark.datasets.filters import FILTERS, split_filters, with_filters
from trackmark.datasets.spec_string import format_text, name_hint, parse_text
from trackmark.reports.figures import save_figure
from trackmark.reports.tables import MISSING, Cell, Table

ENOUGH = 0.05
"""Half-width of the interval, as a share of the range, at which no more runs are added."""

RULE = (
    "A run loses its target if the estimated centre is outside the ground-truth box in ten "
    "consecutive visible frames."
)
"""Definition of a loss; see `first_loss` in the metrics `native`."""

LEVELS = 40
"""Number of steps of a range. Levels on this grid keep the names of runs short."""

SHORTEST = 40
"""Minimum number of frames of a sequence whose parameter `scene` is missing or set."""

POSITIONS = np.linspace(0, 1, 201)
"""Positions along a range, from 0 (easy) to 1 (hard), at which curves are evaluated."""

BINS = 8
"""Number of dots that summarise the runs of a stress test in a figure."""


@dataclass(frozen=True)
class Difficulty:
    """A filter or a parameter of scenes, between an easy and a hard level."""

    name: str
    unit: str
    easy: float
    hard: float
    is_integer: bool = False  # True if levels are integers
    logarithmic: bool = False
    is_filter: bool = True  # False: a parameter of the scenes

    def level(self, position: float) -> float:
        """Return the level at a position: 0 is the easy end of the range, 1 the hard end."""
        if self.logarithmic:
            return float(self.easy * (self.hard / self.easy) ** position)
        return self.easy + (self.hard - self.easy) * position

    def position(self, level: float) -> float:
        """Return the position of a level in the range; see `level`."""
        if self.logarithmic:
            return log(level / self.easy) / log(self.hard / self.easy)
        return (level - self.easy) / (self.hard - self.easy)

    def run_level(self, position: float) -> float:
        """Return the level of a run near a position, on the grid, rounded to three digits."""
        level = self.level(round(position * LEVELS) / LEVELS)
        return float(round(level)) if self.is_integer else float(f"{level:.3g}")

    @property
    def heading(self) -> str:
        """Name, unit and range."""
        return f"{self.name} [{self.unit}], {self.easy:g} to {self.hard:g}"


def parse_difficulty(argument: str, sequences: Sequence[str]) -> Difficulty:
    """Parse `NAME` or `NAME=FROM..TO`: a filter, or a parameter of the scenes.

    Raises `ExperimentError` for an unknown name or an invalid range.
    """
    name, equals, limits = argument.partition("=")
    try:
        ends = [float(end) for end in limits.split("..")] if equals else []
    except ValueError:
        ends = [nan]
    if equals and (len(ends) != 2 or ends[0] == ends[1] or not all(map(isfinite, ends))):
        raise ExperimentError(
            f"--difficulty {argument}: invalid range. Expected: {name}=FROM..TO; FROM is the easy "
            "end."
        )
    filters = {key: value for key, value in FILTERS.items() if key != "start"}
    if name in filters:
        selected = filters[name]
        easy, hard = ends or (selected.easy, selected.hard)
        if selected.logarithmic and min(easy, hard) <= 0:
            raise ExperimentError(
                f"--difficulty {argument}: both ends of this range must be above 0."
            )
        return Difficulty(
            name, selected.unit, easy, hard, selected.is_integer, selected.logarithmic
        )
    for sequence in sequences:
        options = {option["name"]: option for option in datasets.options(_bare(sequence))}
        if name not in options or name == "scene":
            raise ExperimentError(
                f"--difficulty {name}: the sequence {sequence} has no parameter {name!r}. Choose a "
                f"filter, or a suite with this parameter.{name_hint(name, [*filters, *options])}"
            )
        default = options[name]["default"]
        if not ends or type(default) not in (int, float):
            problem = "the parameter is not a number" if ends else "the range is missing"
            raise ExperimentError(f"--difficulty {argument}: {problem}. Expected: {name}=FROM..TO.")
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

    def spec(self, difficulty: Difficulty, level: float, run_index: int) -> str:
        """Return the specification of the sequence of a run, numbered from 0, at a level."""
        turn, index = divmod(run_index, len(self.sequences))
        bare, filters = split_filters(self.sequences[index])
        start_frames = self._start_frames[index]
        options: dict[str, float] = {} if start_frames else {"scene": turn}
        if start_frames and turn:
            filters["start"] = filters.get("start", 0) + int(_halving(turn) * start_frames)
        if run_index:
            filters["draw"] = run_index
        if difficulty.is_filter:
            filters[difficulty.name] = level
        else:
            options[difficulty.name] = int(level) if difficulty.is_integer else level
        return with_filters(format_text(bare, options), filters)

    @cached_property
    def _start_frames(self) -> list[int]:
        """Number of possible start frames by sequence; 0 if each run has another scene."""
        return [_start_frames(text) for text in self.sequences]


def _start_frames(spec: str) -> int:
    bare = _bare(spec)
    names = [option["name"] for option in datasets.options(bare)]
    if "scene" in names and "scene" not in parse_text(bare)[1]:
        return 0
    frames = len(datasets.load(spec))
    if frames < SHORTEST:
        raise ExperimentError(
            f"{spec}: {frames} frames are too few for runs that start at different frames. "
            f"Give a sequence of {SHORTEST} frames or more."
        )
    return frames // 4


def _bare(spec: str) -> str:
    """Return the specification of a sequence without its filters."""
    return split_filters(spec)[0]


def _halving(index: int) -> float:
    """Return an element of van der Corput's sequence, which fills [0, 1) evenly."""
    digits = f"{index:b}"[::-1]
    return float(int(digits, 2) / 2.0 ** len(digits))


@dataclass(frozen=True)
class Trial:
    """One run of a stress test."""

    sequence: str  # specification
    level: float
    survived: bool
    failure: str = ""


@dataclass(frozen=True)
class StressTest:
    """Runs of a tracker under a difficulty."""

    tracker: str  # label
    difficulty: Difficulty  # difficulty whose level varies between runs
    sequences: RunSequences
    max_runs: int
    trials: Sequence[Trial] = field(default_factory=tuple)

    @cached_property
    def threshold(self) -> Threshold:
        """Position in the range at which half of the runs survive."""
        positions = [self.difficulty.position(trial.level) for trial in self.trials]
        return threshold(positions, [trial.survived for trial in self.trials])

    @property
    def outcome(self) -> str:
        """`broken`; `never` or `at once` if the breaking point is past the hard or easy end."""
        position = self.threshold.median
        return "never" if position > 1 else "at once" if position < 0 else "broken"

    @property
    def level(self) -> float:
        """Breaking point: the level at which half of the runs survive."""
        return self.difficulty.level(self.threshold.median)

    @property
    def interval(self) -> Interval:
        """95 % interval of the breaking point, from easy to hard; infinite beyond the range."""
        low, high = self.threshold.interval
        away = inf if self.difficulty.hard > self.difficulty.easy else -inf
        return Interval(
            self.difficulty.level(low) if low >= 0 else -away,
            self.difficulty.level(high) if high <= 1 else away,
        )

    def next_runs(self) -> list[tuple[str, float]]:
        """Return sequences and levels of the next runs; none if the interval is narrow enough."""
        done = len(self.trials)
        if not done:
            positions: NDArray[np.float64] = (np.arange(N_FIRST_RUNS) + 0.5) / N_FIRST_RUNS
        else:
            low, high = self.threshold.interval
            if self.threshold.half_width <= ENOUGH or low > 1 or high < 0:
                return []
            key = crc32(self.tracker.encode()), crc32(self.difficulty.name.encode())
            random = np.random.default_rng(np.random.SeedSequence(done, spawn_key=key))
            positions = next_difficulties(self.threshold, random, N_NEXT_RUNS)
        levels = [
            self.difficulty.run_level(position)
            for position in positions[: self.max_runs - done].tolist()
        ]
        return [
            (self.sequences.spec(self.difficulty, level, done + i), level)
            for i, level in enumerate(levels)
        ]

    def extended_by(self, outcomes: Mapping[str, tuple[bool, str]]) -> "StressTest":
        """Return the stress test extended by its next runs.

        `outcomes` tells by sequence whether the run survived, and the reason of a failure.
        """
        new = [Trial(text, level, *outcomes[text]) for text, level in self.next_runs()]
        return replace(self, trials=[*self.trials, *new])


def difficulty_ratio(stress_test: StressTest, against: StressTest) -> tuple[float, Interval]:
    """Return the ratio of two trackers' breaking points and its 95 % interval.

    A ratio above 1 means that the tracker survives harder levels. If a tracker never breaks, the
    ratio is a lower bound and the interval is open. It is NaN if `against` does not break within
    the range, or for levels of 0 or below.
    """
    difficulty = stress_test.difficulty
    if (
        against.outcome != "broken"
        or stress_test.outcome == "at once"
        or min(difficulty.easy, difficulty.hard) < 0
    ):
        return nan, Interval(nan, nan)
    smallest = 1 / LEVELS / 10  # a level of 0 has no ratio
    limits = 0 if difficulty.easy else smallest, 1 if difficulty.hard else 1 - smallest
    shares = ((np.arange(200) + 0.5) / 200).tolist()
    positions = np.array(
        [[side.threshold.quantile(x) for x in shares] for side in (stress_test, against)]
    )
    levels = [
        difficulty.level(position) for position in np.clip(positions, *limits).ravel().tolist()
    ]
    logs = np.log(levels).reshape(positions.shape) * (
        1 if difficulty.hard > difficulty.easy else -1
    )
    ratios = logs[0][:, None] - logs[1][None]
    middle, low = (float(np.exp(end)) for end in (np.median(ratios), np.quantile(ratios, 0.025)))
    ratios[positions[0] > 1] = inf
    return middle, Interval(low, float(np.exp(np.quantile(ratios, 0.975, method="higher"))))


@dataclass(frozen=True)
class BreakingPoints:
    """Stress tests of several trackers and difficulties, compared with the tracker `against`."""

    stress_tests: Sequence[StressTest]
    against: str  # label of the tracker with which the others are compared

    @cached_property
    def by_difficulty(self) -> dict[Difficulty, dict[str, StressTest]]:
        """Stress tests by difficulty and tracker."""
        by_difficulty: dict[Difficulty, dict[str, StressTest]] = {}
        for stress_test in self.stress_tests:
            by_difficulty.setdefault(stress_test.difficulty, {})[stress_test.tracker] = stress_test
        return by_difficulty

    @cached_property
    def points(self) -> list[dict[str, Any]]:
        """One row of values per stress test; values beyond the range are None."""
        return [
            _row(stress_test, self.by_difficulty[stress_test.difficulty][self.against])
            for stress_test in self.stress_tests
        ]

    @cached_property
    def runs(self) -> list[dict[str, Any]]:
        """All runs, with difficulty and tracker."""
        return [
            {
                "difficulty": stress_test.difficulty.name,
                "tracker": stress_test.tracker,
                **vars(trial),
            }
            for stress_test in self.stress_tests
            for trial in stress_test.trials
        ]


def _row(stress_test: StressTest, against: StressTest) -> dict[str, Any]:
    difficulty = stress_test.difficulty
    ratio, ratios = difficulty_ratio(stress_test, against)
    easy, hard = stress_test.threshold.survival([0.0, 1.0]).tolist()
    return {
        "difficulty": difficulty.name,
        "unit": difficulty.unit,
        "easy": difficulty.easy,
        "hard": difficulty.hard,
        "tracker": stress_test.tracker,
        "outcome": stress_test.outcome,
        "level": stress_test.level if stress_test.outcome == "broken" else None,
        "level_low": _finite(stress_test.interval.low),
        "level_high": _finite(stress_test.interval.high),
        "ratio": _finite(ratio),
        "ratio_low": _finite(ratios.low),
        "ratio_high": _finite(ratios.high),
        "relative_half_width": stress_test.threshold.half_width,
        "survive_at_easy": easy,
        "survive_at_hard": hard,
        "runs": len(stress_test.trials),
    }


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def stress_json(result: BreakingPoints) -> dict[str, Any]:
    """Return the object of `--json`; values beyond the range are null."""
    return {
        "rule": RULE,
        "against": result.against,
        "stress_tests": [
            {**row, "runs": [vars(trial) for trial in stress_test.trials]}
            for row, stress_test in zip(result.points, result.stress_tests, strict=True)
        ],
    }


def breaking_point_lines(result: BreakingPoints) -> list[str]:
    """Return a sentence per difficulty: the trackers by their breaking points, the best first."""
    lines = []
    for difficulty in dict.fromkeys(stress_test.difficulty for stress_test in result.stress_tests):
        pairs = zip(result.stress_tests, result.points, strict=True)
        rows = [
            (stress_test, row) for stress_test, row in pairs if stress_test.difficulty == difficulty
        ]
        rows.sort(key=lambda pair: -pair[0].threshold.median)
        open_outcomes = {
            "never": f"never breaks up to {difficulty.hard:g}",
            "at once": "breaks at once",
        }
        outcomes = [
            f"{stress_test.tracker} {open_outcomes.get(row['outcome'], f'breaks at {_level(row)}')}"
            for stress_test, row in rows
        ]
        lines.append(f"{difficulty.heading}: {', '.join(outcomes)}.")
    return lines


def stress_tables(result: BreakingPoints, *, with_runs: bool = False) -> list[Table]:
    """Return the table of breaking points; if `with_runs`, also the table of all runs."""
    return [_points(result), *([_runs(result)] if with_runs else [])]


def _points(result: BreakingPoints) -> Table:
    rows = []
    for stress_test, row in zip(result.stress_tests, result.points, strict=True):
        harder = "1" if stress_test.tracker == result.against else _ratio_text(row)
        shares = f"{100 * row['survive_at_easy']:.0f} … {100 * row['survive_at_hard']:.0f}"
        values = [
            stress_test.difficulty.heading,
            stress_test.tracker,
            _level(row),
            _interval(stress_test),
            harder,
            shares,
        ]
        rows.append([Cell(value) for value in (*values, str(row["runs"]))])
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
            f"ratio: how much harder this level is than the breaking point of {result.against}."
        ),
        headings=[
            "difficulty",
            "tracker",
            "breaks at",
            "95 % interval",
            "ratio",
            "survive at ends [%]",
            "runs",
        ],
        n_labels=2,
        rows=rows,
        notes=[RULE, end, *(f"{tracker}: {note}" for tracker, note in failures.items())],
        records=pd.DataFrame(result.points),
        ranks=[0, 1, 2, 4, 3],
    )


def _level(row: Mapping[str, Any]) -> str:
    if row["outcome"] == "never":
        return f"never to {row['hard']:g}"
    return "at once" if row["outcome"] == "at once" else f"{row['level']:.3g}"


def _interval(stress_test: StressTest) -> str:
    """Return the interval as text, from the easier to the harder end, clipped at the range."""
    difficulty, positions = stress_test.difficulty, stress_test.threshold.interval
    before = f"{'before' if difficulty.hard > difficulty.easy else 'above'} {difficulty.easy:g}"
    beyond = f"beyond {difficulty.hard:g}"
    if positions.low > 1 or positions.high < 0:
        return beyond if positions.low > 1 else before
    low = before if positions.low < 0 else f"{stress_test.interval.low:.3g}"
    return f"{low} to {beyond if positions.high > 1 else f'{stress_test.interval.high:.3g}'}"


def _ratio_text(row: Mapping[str, Any]) -> str:
    ratio, low, high = (row[key] for key in ("ratio", "ratio_low", "ratio_high"))
    if ratio is None:
        return MISSING
    if row["outcome"] == "never":
        return f"more than {_times(low)}"
    return f"{_times(ratio)} ({_times(low)} to {'more' if high is None else _times(high)})"


def _times(ratio: float) -> str:
    """Return a ratio with two digits, without a power of ten."""
    return f"{ratio:.2g}" if ratio < 99.5 else f"{ratio:.0f}"


def _runs(result: BreakingPoints) -> Table:
    headings = ["difficulty", "tracker", "sequence", "level", "survived"]
    rows = [[Cell(str(row[heading])) for heading in headings] for row in result.runs]
    return Table("runs", f"All runs. {RULE}", headings, 3, rows, records=pd.DataFrame(result.runs))


def write_curves(result: BreakingPoints, folder: Path) -> list[Path]:
    """Write a figure of survival by level for each difficulty; return the files."""
    paths = []
    for difficulty, by_tracker in result.by_difficulty.items():
        levels = np.array([difficulty.level(position) for position in POSITIONS.tolist()])
        curves = {name: _curve(stress_test, levels) for name, stress_test in by_tracker.items()}
        title = f"Runs that survive under {difficulty.name}"
        figure = breaking_plot(
            curves, f"{difficulty.name} [{difficulty.unit}]", title, difficulty.logarithmic
        )
        path = folder / f"curve-{difficulty.name}.png"
        paths.append(write_file(path, partial(save_figure, figure=figure)))
    return paths


def _curve(stress_test: StressTest, levels: NDArray[np.float64]) -> SurvivalCurve:
    """Return the survival curve, dots for groups of neighbouring runs, and the interval."""
    difficulty = stress_test.difficulty
    runs = [(difficulty.position(trial.level), trial.survived) for trial in stress_test.trials]
    groups = np.array_split(sorted(runs, key=lambda run: run[0]), min(BINS, len(runs)))
    dots = (
        np.array([difficulty.level(float(np.mean(group[:, 0].copy()))) for group in groups]),
        np.array([np.mean(group[:, 1]) for group in groups]),
        np.array([float(len(group)) for group in groups]),
    )
    ends = [nan, nan]
    if stress_test.outcome == "broken":
        ends = [difficulty.level(min(1.0, max(0.0, end))) for end in stress_test.threshold.interval]
    return SurvivalCurve(levels, stress_test.threshold.survival(POSITIONS), *dots, *ends)
