"""What stress shows: tables of breaking points, curves of survival, agreement with other scores."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.comparing.stressing import ENOUGH, RULE, Knob, Series, factor
from bench.statistics.correlation import rank_correlation
from bench.statistics.intervals import Interval
from reports.comparison import Breaks, breaking_plot
from reports.figures import write_figure
from reports.notes import failure_notes
from reports.tables import MISSING, Cell, Table
from reports.write import file_names

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
        found: dict[Knob, dict[str, Series]] = {}
        for one in self.series:
            found.setdefault(one.knob, {})[one.tracker] = one
        return found

    def correlations(self) -> list[tuple[str, float, Interval]]:
        """Of breaking points with the mean overlap over trackers, by knob; and over all knobs."""
        if not self.scores:
            return []
        trackers = list(self.scores)
        means = [float(np.mean(self.scores[name])) for name in trackers]
        points = {
            knob.name: [_held(found[name]) for name in trackers]
            for knob, found in self.knobs.items()
        }
        if len(points) > 1:
            points["mean over the knobs"] = np.mean(list(points.values()), axis=0).tolist()
        return [(name, *rank_correlation(found, means)) for name, found in points.items()]


def _held(series: Series) -> float:
    """Place of the breaking point, no further than the range: beyond it nothing was seen."""
    return min(1.0, max(0.0, series.threshold.place))


def screen(found: Breaking) -> list[Table]:
    """Tables for a terminal."""
    return [_points(found), *([_agreement(found)] if found.scores else [])]


def files(found: Breaking) -> list[Table]:
    """All tables, for a folder."""
    return [*screen(found), _severity(found), _runs(found)]


def as_data(found: Breaking) -> dict[str, Any]:
    """All of it for `--json`; what is beyond the range is null."""
    return {
        "rule": RULE,
        "baseline": found.baseline,
        "series": [
            {**_row(found, one), "runs": [vars(trial) for trial in one.trials]}
            for one in found.series
        ],
        "recorded": {name: list(scores) for name, scores in found.scores.items()},
        "correlations": [
            {"knob": name, "rank_correlation": _number(r), "interval": list(interval)}
            for name, r, interval in found.correlations()
        ],
    }


def _row(found: Breaking, one: Series) -> dict[str, Any]:
    """A series in numbers; what is beyond the range is None."""
    ratio, ratios = factor(one, found.knobs[one.knob][found.baseline])
    easy, hard = one.threshold.survival([0.0, 1.0]).tolist()
    return {
        "knob": one.knob.name,
        "unit": one.knob.unit,
        "easy": one.knob.easy,
        "hard": one.knob.hard,
        "tracker": one.tracker,
        "breaks": one.verdict,
        "level": one.level if one.verdict == "broken" else None,
        "level_low": _number(one.interval.low),
        "level_high": _number(one.interval.high),
        "factor": _number(ratio),
        "factor_low": _number(ratios.low),
        "factor_high": _number(ratios.high),
        "half_width_in_ranges": one.threshold.half_width,
        "survive_at_easy": easy,
        "survive_at_hard": hard,
        "runs": len(one.trials),
    }


def _number(value: float) -> float | None:
    return value if isfinite(value) else None


def _points(found: Breaking) -> Table:
    rows, data = [], []
    for knob, by_tracker in found.knobs.items():
        for name, one in by_tracker.items():
            row = _row(found, one)
            cells = [_level(one), _interval(one), _factor(one, by_tracker[found.baseline])]
            shares = f"{100 * row['survive_at_easy']:.0f} … {100 * row['survive_at_hard']:.0f}"
            rows.append([knob.head, name, *cells, shares, str(row["runs"])])
            data.append(row)
    trials = [
        {"tracker": one.tracker, **vars(trial)} for one in found.series for trial in one.trials
    ]
    runs = pd.DataFrame(trials).assign(status=lambda rows: rows["failure"].map(_status))
    failures = failure_notes(runs, "lost", "counted as lost")
    notes = [
        RULE,
        f"Runs end at half an interval's width of {100 * ENOUGH:g} % of the range, or at --runs.",
        *(f"{tracker}: {note}" for tracker, note in failures.items()),
    ]
    return Table(
        name="breaking-points",
        caption=(
            "Breaking points: the level at which half of the runs survive, with 95 % intervals; "
            f"factor: how much harder that is than what {found.baseline} bears."
        ),
        heads=["knob", "tracker", "breaks at", "95 %", "factor", "survive at ends [%]", "runs"],
        n_labels=2,
        rows=[[Cell(text) for text in row] for row in rows],
        notes=notes,
        data=pd.DataFrame(data),
        ranks=[0, 1, 2, 4, 3],
    )


def _status(failure: str) -> str:
    return "failed" if failure else "finished"


def _level(one: Series) -> str:
    if one.verdict == "never":
        return f"never to {one.knob.hard:g}"
    return f"at once, by {one.knob.easy:g}" if one.verdict == "at once" else f"{one.level:.3g}"


def _interval(one: Series) -> str:
    """From the easier end to the harder one; an end beyond the range is that of the range."""
    easier = "before" if one.knob.hard > one.knob.easy else "above"
    before, beyond = f"{easier} {one.knob.easy:g}", f"beyond {one.knob.hard:g}"
    places = one.threshold.interval
    if places.low > 1 or places.high < 0:
        return beyond if places.low > 1 else before
    low = before if places.low < 0 else f"{one.interval.low:.3g}"
    return f"{low} to {beyond if places.high > 1 else f'{one.interval.high:.3g}'}"


def _factor(one: Series, baseline: Series) -> str:
    if one is baseline:
        return "1"
    ratio, (low, high) = factor(one, baseline)
    if not isfinite(ratio):
        return MISSING
    if one.verdict == "never":
        return f"more than {_times(low)}"
    return f"{_times(ratio)} ({_times(low)} to {_times(high) if high < inf else 'more'})"


def _times(ratio: float) -> str:
    """A ratio with two digits, and no power of ten."""
    return f"{ratio:.2g}" if ratio < 99.5 else f"{ratio:.0f}"


def _agreement(found: Breaking) -> Table:
    rows, data = [], []
    for name, r, interval in found.correlations():
        said = f"{r:.2f}" if isfinite(r) else MISSING
        rows.append([Cell(name), Cell(said), Cell(f"{interval.low:.2f} to {interval.high:.2f}")])
        data.append({"knob": name, "rank_correlation": r, **interval._asdict()})
    sequences = len(next(iter(found.scores.values())))
    return Table(
        name="agreement",
        caption=(
            f"Rank correlation over {len(found.scores)} trackers of breaking points with the mean "
            f"overlap on {sequences} recorded sequences."
        ),
        heads=["knob", "Spearman's", "95 %"],
        n_labels=1,
        rows=rows,
        notes=["Intervals tell of other trackers like these; fewer than 4 tell nothing."],
        data=pd.DataFrame(data),
    )


def _severity(found: Breaking) -> Table:
    """Levels at which given shares of the baseline's runs survive; gaps beyond the range."""
    rows, data = [], []
    for knob, by_tracker in found.knobs.items():
        survival = by_tracker[found.baseline].threshold.survival(PLACES)
        places = [
            float(np.interp(-share, -survival, PLACES, left=np.nan, right=np.nan))
            for share in SEVERITIES
        ]
        levels = [knob.level(place) if isfinite(place) else np.nan for place in places]
        said = [f"{level:.3g}" if isfinite(level) else MISSING for level in levels]
        rows.append([Cell(knob.head), *map(Cell, said)])
        data += [
            {"knob": knob.name, "survive": share, "level": level}
            for share, level in zip(SEVERITIES, levels, strict=True)
        ]
    return Table(
        name="severity",
        caption=f"Levels by severity: so much of {found.baseline}'s runs survive there.",
        heads=["knob", *(f"{100 * share:g} %" for share in SEVERITIES)],
        n_labels=1,
        rows=rows,
        data=pd.DataFrame(data),
    )


def _runs(found: Breaking) -> Table:
    """Every run: data for who draws the curves anew."""
    data = [
        {"knob": one.knob.name, "tracker": one.tracker, **vars(trial)}
        for one in found.series
        for trial in one.trials
    ]
    heads = ["knob", "tracker", "sequence", "level", "survived"]
    rows = [[Cell(str(row[head])) for head in heads] for row in data]
    return Table("runs", f"All runs. {RULE}", heads, 3, rows, data=pd.DataFrame(data))


def write_curves(found: Breaking, folder: Path) -> list[Path]:
    """Draw survival against level, a figure a knob, into a folder; give the files."""
    names = file_names(knob.name for knob in found.knobs)
    paths = []
    for knob, by_tracker in found.knobs.items():
        levels = np.array([knob.level(place) for place in PLACES.tolist()])
        curves = {
            name: Breaks(levels, one.threshold.survival(PLACES), *_dots(one), *_bar(one))
            for name, one in by_tracker.items()
        }
        title = f"Runs that survive under {knob.name}"
        figure = breaking_plot(curves, f"{knob.name} [{knob.unit}]", title, knob.logarithmic)
        paths.append(write_figure(folder / f"curve-{names[knob.name]}.png", figure))
    return paths


def _bar(one: Series) -> list[float]:
    """Ends of the breaking point's interval within the range; NaN where it is beyond."""
    if one.verdict != "broken":
        return [np.nan, np.nan]
    return [one.knob.level(min(1.0, max(0.0, end))) for end in one.threshold.interval]


def _dots(one: Series) -> tuple[Array, Array, Array]:
    """Runs in groups of neighbours: mean level, share that survived, how many."""
    trials = sorted(one.trials, key=lambda trial: one.knob.place(trial.level))
    groups = np.array_split(np.arange(len(trials)), min(BINS, len(trials)))
    places = [np.mean([one.knob.place(trials[i].level) for i in group]) for group in groups]
    shares = [np.mean([trials[i].survived for i in group]) for group in groups]
    levels = [one.knob.level(float(place)) for place in places]
    return np.array(levels), np.array(shares), np.array([float(len(group)) for group in groups])
