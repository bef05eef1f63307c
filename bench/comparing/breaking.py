"""Results of `stress`: tables of breaking points, survival curves, correlation with scores."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark.bench.comparing.stressing import ENOUGH, RULE, Knob, Series, factor
from trackmark.bench.statistics.correlation import rank_correlation
from trackmark.bench.statistics.intervals import Interval
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.reports.comparison import Breaks, breaking_plot
from trackmark.reports.figures import write_figure
from trackmark.reports.tables import MISSING, Cell, Table, failure_notes
from trackmark.reports.write import file_names

Array = NDArray[np.float64]

SEVERITIES = (0.9, 0.75, 0.5, 0.25, 0.1)
"""Shares of the baseline's runs that survive: levels are equally severe that have the same."""

PLACES = np.linspace(0, 1, 201)
"""Along a range, where curves are drawn and read."""

BINS = 8
"""Dots by which the runs of a series are drawn."""


@dataclass(frozen=True)
class Breaking:
    """All series of a call.

    `scores`: mean overlap by tracker, on each recorded sequence; empty where none were asked for.
    """

    series: Sequence[Series]
    baseline: str  # label
    scores: Mapping[str, Sequence[float]]

    @cached_property
    def knobs(self) -> dict[Knob, dict[str, Series]]:
        """Series by knob and tracker."""
        by_knob: dict[Knob, dict[str, Series]] = {}
        for series in self.series:
            by_knob.setdefault(series.knob, {})[series.tracker] = series
        return by_knob

    @cached_property
    def points(self) -> list[dict[str, Any]]:
        """Numbers of each series."""
        return [_row(series, self.knobs[series.knob][self.baseline]) for series in self.series]

    @cached_property
    def runs(self) -> list[dict[str, Any]]:
        """All runs, with knob and tracker."""
        return [
            {"knob": series.knob.name, "tracker": series.tracker, **vars(trial)}
            for series in self.series
            for trial in series.trials
        ]

    def correlations(self) -> list[tuple[str, float, Interval]]:
        """Return the correlation of breaking points and overlaps by knob, then over all knobs."""
        if not self.scores:
            return []
        means = [float(np.mean(scores)) for scores in self.scores.values()]
        places = {
            knob.name: [
                min(1.0, max(0.0, by_tracker[name].threshold.place)) for name in self.scores
            ]
            for knob, by_tracker in self.knobs.items()
        }
        if len(places) > 1:
            places["mean over the knobs"] = np.mean(list(places.values()), axis=0).tolist()
        return [(name, *rank_correlation(points, means)) for name, points in places.items()]


def tables(result: Breaking, *, whole: bool = False) -> list[Table]:
    """Return the tables for a terminal; with severities and all runs if `whole`."""
    agreement = [_agreement(result)] if result.scores else []
    return [_points(result), *agreement, *([_severity(result), _runs(result)] if whole else [])]


def as_data(result: Breaking) -> dict[str, Any]:
    """Return the object of `--json`; values beyond the range are null."""
    return {
        "rule": RULE,
        "baseline": result.baseline,
        "series": [
            {**row, "runs": [vars(trial) for trial in series.trials]}
            for row, series in zip(result.points, result.series, strict=True)
        ],
        "recorded": {name: list(scores) for name, scores in result.scores.items()},
        "correlations": [
            {"knob": name, "rank_correlation": _number(r), "interval": list(interval)}
            for name, r, interval in result.correlations()
        ],
    }


def _row(series: Series, baseline: Series) -> dict[str, Any]:
    """Return a series in numbers; values beyond the range are None."""
    knob = series.knob
    ratio, ratios = factor(series, baseline)
    easy, hard = series.threshold.survival([0.0, 1.0]).tolist()
    return {
        "knob": knob.name,
        "unit": knob.unit,
        "easy": knob.easy,
        "hard": knob.hard,
        "tracker": series.tracker,
        "breaks": series.verdict,
        "level": series.level if series.verdict == "broken" else None,
        "level_low": _number(series.interval.low),
        "level_high": _number(series.interval.high),
        "factor": _number(ratio),
        "factor_low": _number(ratios.low),
        "factor_high": _number(ratios.high),
        "half_width_in_ranges": series.threshold.half_width,
        "survive_at_easy": easy,
        "survive_at_hard": hard,
        "runs": len(series.trials),
    }


def _number(value: float) -> float | None:
    return value if isfinite(value) else None


def _points(result: Breaking) -> Table:
    rows = []
    for series, row in zip(result.series, result.points, strict=True):
        harder = "1" if series.tracker == result.baseline else _factor(row)
        shares = f"{100 * row['survive_at_easy']:.0f} … {100 * row['survive_at_hard']:.0f}"
        texts = [series.knob.head, series.tracker, _level(row), _interval(series), harder, shares]
        rows.append([Cell(text) for text in (*texts, str(row["runs"]))])
    runs = pd.DataFrame(result.runs)
    runs["status"] = np.where(runs["failure"] == "", "finished", "failed")
    failures = failure_notes(runs, "lost", "counted as lost")
    end = f"Runs end at half an interval's width of {100 * ENOUGH:g} % of the range, or at --runs."
    return Table(
        name="breaking-points",
        caption=(
            "Breaking points: the level at which half of the runs survive, with 95 % intervals; "
            f"factor: how much harder that is than what {result.baseline} bears."
        ),
        heads=["knob", "tracker", "breaks at", "95 %", "factor", "survive at ends [%]", "runs"],
        n_labels=2,
        rows=rows,
        notes=[RULE, end, *(f"{tracker}: {note}" for tracker, note in failures.items())],
        data=pd.DataFrame(result.points),
        ranks=[0, 1, 2, 4, 3],
    )


def _level(row: Mapping[str, Any]) -> str:
    if row["breaks"] == "never":
        return f"never to {row['hard']:g}"
    return f"at once, by {row['easy']:g}" if row["breaks"] == "at once" else f"{row['level']:.3g}"


def _interval(series: Series) -> str:
    """Return the interval from the easier to the harder end, cut at the ends of the range."""
    knob, places = series.knob, series.threshold.interval
    before = f"{'before' if knob.hard > knob.easy else 'above'} {knob.easy:g}"
    beyond = f"beyond {knob.hard:g}"
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


def _agreement(result: Breaking) -> Table:
    correlations = result.correlations()
    sequences = len(next(iter(result.scores.values())))
    return Table(
        name="agreement",
        caption=(
            f"Rank correlation over {len(result.scores)} trackers of breaking points with the mean "
            f"overlap on {sequences} recorded sequences."
        ),
        heads=["knob", "Spearman's", "95 %"],
        n_labels=1,
        rows=[
            [Cell(name), Cell(_text(r, ".2f")), Cell(f"{interval.low:.2f} to {interval.high:.2f}")]
            for name, r, interval in correlations
        ],
        notes=[
            f"Intervals are for other trackers of this kind; below {MIN_UNITS} they are -1 to 1."
        ],
        data=pd.DataFrame(
            {"knob": name, "rank_correlation": r, **interval._asdict()}
            for name, r, interval in correlations
        ),
    )


def _text(value: float, form: str) -> str:
    return format(value, form) if isfinite(value) else MISSING


def _severity(result: Breaking) -> Table:
    """Return levels at which shares of the baseline's runs survive; gaps beyond the range."""
    rows, data = [], []
    for knob, by_tracker in result.knobs.items():
        survival = by_tracker[result.baseline].threshold.survival(PLACES)
        places = np.interp(np.negative(SEVERITIES), -survival, PLACES, left=np.nan, right=np.nan)
        levels = [knob.level(place) for place in places.tolist()]
        rows.append([Cell(knob.head), *(Cell(_text(level, ".3g")) for level in levels)])
        data += [
            {"knob": knob.name, "survive": share, "level": level}
            for share, level in zip(SEVERITIES, levels, strict=True)
        ]
    return Table(
        name="severity",
        caption=f"Levels by severity: so much of {result.baseline}'s runs survive there.",
        heads=["knob", *(f"{100 * share:g} %" for share in SEVERITIES)],
        n_labels=1,
        rows=rows,
        data=pd.DataFrame(data),
    )


def _runs(result: Breaking) -> Table:
    heads = ["knob", "tracker", "sequence", "level", "survived"]
    rows = [[Cell(str(row[head])) for head in heads] for row in result.runs]
    return Table("runs", f"All runs. {RULE}", heads, 3, rows, data=pd.DataFrame(result.runs))


def write_curves(result: Breaking, folder: Path) -> list[Path]:
    """Draw survival by level into a folder, a figure for each knob; return the files."""
    names = file_names(knob.name for knob in result.knobs)
    paths = []
    for knob, by_tracker in result.knobs.items():
        levels = np.array([knob.level(place) for place in PLACES.tolist()])
        curves = {
            name: Breaks(levels, series.threshold.survival(PLACES), *_dots(series), *_ends(series))
            for name, series in by_tracker.items()
        }
        title = f"Runs that survive under {knob.name}"
        figure = breaking_plot(curves, f"{knob.name} [{knob.unit}]", title, knob.logarithmic)
        paths.append(write_figure(folder / f"curve-{names[knob.name]}.png", figure))
    return paths


def _ends(series: Series) -> list[float]:
    """Return the interval's ends, cut at the range; NaN if the tracker does not break in it."""
    if series.verdict != "broken":
        return [np.nan, np.nan]
    return [series.knob.level(min(1.0, max(0.0, end))) for end in series.threshold.interval]


def _dots(series: Series) -> tuple[Array, Array, Array]:
    """Return mean level, share of surviving runs and number of runs of groups of neighbours."""
    runs = [(series.knob.place(trial.level), trial.survived) for trial in series.trials]
    groups = np.array_split(sorted(runs, key=lambda run: run[0]), min(BINS, len(runs)))
    levels = [series.knob.level(float(np.mean(group[:, 0].copy()))) for group in groups]
    shares = [np.mean(group[:, 1]) for group in groups]
    return np.array(levels), np.array(shares), np.array([float(len(group)) for group in groups])
