"""Times per frame in tables: which runs they come from, and notes on them."""

from dataclasses import replace
from math import isfinite

import numpy as np
import pandas as pd

from trackmark.bench.metrics.times import MAX_RUN_DELAY, RUN_DELAY_CLOCK
from trackmark.reports.tables import MISSING, Cell, ScoreMeasure, Table

TIME = ScoreMeasure("ms_per_frame", "ms/frame", "", None, 3, minimum=0.0)
"""Mean time of an update [ms]."""

TIMES = (
    TIME,
    ScoreMeasure("ms_per_frame_median", "median", "ms", None, 3),
    ScoreMeasure("ms_per_frame_p95", "95th percentile", "ms", None, 3, rank=1),
    ScoreMeasure("ms_first_update", "first update", "ms", None, 3, rank=2),
    ScoreMeasure("ms_init", "init", "ms", None, 3, rank=3),
    ScoreMeasure("cpu_ms_per_frame", "CPU", "ms", None, 3, rank=4),
    ScoreMeasure("run_delay_share", "run delay", "%", None, 1, scale=100, rank=5),
)
"""Columns of timing runs."""

APPROXIMATE = "~"
"""Mark of times of one-pass runs, in which trackers share the machine."""

DISTURBED = "!"
"""Mark of times that other load has disturbed."""


_COLUMNS = (TIME.name, "clock", "machine", "time_note", "run_delay_share")


def with_times(scored: pd.DataFrame, timed: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Set the column `ms_per_frame` of one-pass runs, and return the runs that have these times.

    `scored`, `timed`: one-pass runs and timing runs. The times are those of timing runs if there is
    one for each tracker and sequence, because the two kinds of runs are never mixed. Otherwise they
    are those of the one-pass runs. A failed run has no time and gets the mean of its tracker.
    """
    # Published scores have no times.
    scored, timed = (
        runs.reindex(columns=[*dict.fromkeys([*runs.columns, *_COLUMNS])])
        for runs in (scored, timed)
    )
    pairs = ["tracker", "sequence"]
    finished = timed[timed["status"] == "finished"]
    means = finished.groupby(pairs, observed=True)[TIME.name].mean()
    times = means.reindex(pd.MultiIndex.from_frame(scored[pairs])).to_numpy(np.float64)
    if len(times) and np.isfinite(times).all():
        return scored.assign(**{TIME.name: times}), finished
    times_of_runs = scored[TIME.name].where(scored["status"] != "failed")
    of_tracker = times_of_runs.groupby(scored["tracker"], observed=True).transform("mean")
    times_of_runs = times_of_runs.where(scored["status"] != "failed", of_tracker)
    return scored.assign(**{TIME.name: times_of_runs}), scored


def clock_of(runs: pd.DataFrame) -> dict[str, str]:
    """Return the clock of each tracker with times. Only times of equal clocks are comparable."""
    pairs = runs.reindex(columns=["tracker", "clock"]).dropna().astype(str).drop_duplicates()
    pairs = pairs[pairs["clock"] != ""]
    return dict(pairs.itertuples(index=False))


def time_mark(runs: pd.DataFrame) -> str:
    """Return the mark of the times of runs: `APPROXIMATE`, `DISTURBED` or empty."""
    if runs.empty:
        return ""
    if (runs["protocol"] == "timing").all():
        return DISTURBED if (runs["run_delay_share"] > MAX_RUN_DELAY).any() else ""
    return APPROXIMATE if runs[TIME.name].notna().any() else ""


def time_marks(runs: pd.DataFrame) -> dict[str, str]:
    """Return the mark of the times of each tracker."""
    return {str(name): time_mark(group) for name, group in runs.groupby("tracker", observed=True)}


def time_notes(runs: pd.DataFrame) -> list[str]:
    """Return notes for tables and charts with the times of runs: machine, clocks, peculiarities."""
    columns = ["clock", "machine", "time_note"]
    runs = runs.assign(**{name: runs[name].astype(object).fillna("") for name in columns})
    measured = runs[runs["machine"] != ""]
    if measured.empty:
        return []
    machines = "ms/frame on " + measured["machine"].astype(str)
    notes = [*machines.unique()]
    if len(notes) > 1:
        notes = _by_tracker(measured.assign(machine=machines), "machine")
    notes += _by_tracker(measured[measured["clock"] != RUN_DELAY_CLOCK], "clock")
    notes += _by_tracker(measured[measured["time_note"] != ""], "time_note")
    mark = time_mark(measured)
    if mark == DISTURBED:
        max_share = measured["run_delay_share"].max()
        notes.append(
            f"{DISTURBED}: other load delayed the updates by up to {100 * max_share:.0f} % of the "
            "time; `run --timing` on a quieter machine measures these runs again"
        )
    elif mark == APPROXIMATE:
        notes.append(f"{APPROXIMATE}: next to other trackers; `run --timing` measures without them")
    return notes


def _by_tracker(runs: pd.DataFrame, column: str) -> list[str]:
    """Return a note with the trackers for each value of a column."""
    trackers: dict[str, dict[str, None]] = {}
    for tracker, value in zip(runs["tracker"].astype(str), runs[column].astype(str), strict=True):
        trackers.setdefault(value, {})[tracker] = None
    return [f"{value}: {', '.join(names)}" for value, names in trackers.items()]


def time_text(milliseconds: float, mark: str = "", digits: int = 2) -> str:
    """Return a time per frame in milliseconds, with its mark.

    >>> time_text(23.94), time_text(0.0128, "~"), time_text(1234.5, digits=3)
    ('24', '~0.013', '1230')
    """
    if not isfinite(milliseconds):
        return MISSING
    return f"{mark}{float(f'{milliseconds:.{digits}g}'):g}"


def fps_text(milliseconds: float) -> str:
    """Return the frames per second of a mean time per frame, with two digits.

    >>> fps_text(23.94), fps_text(0.0128), fps_text(12345)
    ('42', '78000', '0.081')
    """
    if not milliseconds > 0:
        return MISSING
    return f"{float(f'{1e3 / milliseconds:.2g}'):g}"


def _fps(milliseconds: float) -> str:
    """Return the frames per second for a table of all digits."""
    if not milliseconds > 0:
        return MISSING
    rate = 1e3 / milliseconds
    return f"{rate:.0f}" if rate >= 100 else f"{rate:.1f}"


def with_fps(table: Table, measured: pd.DataFrame) -> Table:
    """Insert the column `fps` after `ms/frame`, and put marks before the times.

    `measured`: the runs that have these times.
    """
    column, labels = table.headings.index(TIME.heading), table.headings[: table.n_labels]
    marks = {key: time_mark(runs) for key, runs in measured.groupby(labels, observed=True)}
    times = table.records[table.records["measure"] == TIME.name]  # one value per row of the table
    rows = []
    keys = times[labels].itertuples(index=False, name=None)
    for cells, key, mean in zip(table.rows, keys, times["mean"].tolist(), strict=True):
        time = cells[column]
        if isfinite(mean):
            time = replace(time, text=f"{marks.get(key, '')}{time.text}")
        rows.append([*cells[:column], time, Cell(_fps(mean)), *cells[column + 1 :]])
    gaps = ["standard_deviation", "low", "high"]
    fps = times.assign(measure="fps", mean=1e3 / times["mean"], **dict.fromkeys(gaps, np.nan))
    values = pd.concat([table.records, fps.set_axis(fps.index + 0.5)]).sort_index(ignore_index=True)
    headings = [*table.headings[: column + 1], "fps", *table.headings[column + 1 :]]
    after = column - table.n_labels + 1
    ranks = [*table.ranks[:after], 0, *table.ranks[after:]] if table.ranks else []
    return replace(table, headings=headings, rows=rows, records=values, ranks=ranks)
