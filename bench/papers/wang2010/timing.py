"""Times of the paper's Table 1 and section 3.2 beside ours, and what a particle costs."""

from collections.abc import Collection, Mapping, Sequence
from math import exp
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from bench.experiments.contestant import contestant
from bench.papers.cells import number_words
from bench.papers.timing import failed_passes, frame_times
from bench.papers.wang2010.costs import (
    IMPLEMENTATIONS,
    METHODS,
    WINDOWED,
    WINDOWS,
    particle_slopes,
)
from bench.papers.wang2010.kept_times import kept_times
from bench.statistics.intervals import mean_interval
from bench.store.layout import Cell as StoredCell
from reports.tables import MISSING, Cell, Table

if TYPE_CHECKING:
    from bench.papers.context import Context

__all__ = [
    "PUBLISHED",
    "measured_times",
    "method_frames",
    "method_table",
    "particle_table",
    "tables",
    "time_rows",
]

TABLE_1, SECTION_3_2 = "wang2010/table-tennis", "wang2010/hand"
PUBLISHED: Mapping[str, Mapping[str, float]] = {
    TABLE_1: {"camshift": 0.063, "proposed": 0.120, "particle_filter": 0.214},
    SECTION_3_2: {"camshift": 0.071, "camshift_improved": 0.098},
}
"""Seconds a frame of Table 1 and of section 3.2, by sequence and method."""

TABLES = {TABLE_1: "table-1", SECTION_3_2: "section-3.2"}
"""What the report calls them, for scripts."""

WORDS = {
    "camshift": "CamShift",
    "camshift_improved": "improved CamShift",
    "proposed": "proposed, N = 60",
    "particle_filter": "particle filter, N = 400",
}


def method_frames(folder: Path, cells: Collection[StoredCell] | None = None) -> pd.DataFrame:
    """CPU seconds of every frame of the timing runs that no load disturbed.

    Returns
    -------
    DataFrame
        `method` (a key of `METHODS`; other trackers, and what is not as written, are left out),
        `sequence`, `frame`, `seconds`: medians over the repetitions.
    """
    written = {
        contestant(f"{name}:preset=as-written").label: method
        for method, (name, _) in METHODS.items()
    }
    frames = frame_times(folder, cells)
    frames = frames.assign(method=frames["tracker"].map(written))
    keys = ["method", "sequence", "frame"]
    return frames.groupby(keys, as_index=False).agg({"seconds": "median"})


def measured_times(
    folder: Path,
    kept: Path,
    cells: Collection[StoredCell] | None = None,
    *,
    quick: bool = False,
) -> dict[str, pd.DataFrame]:
    """What the claims on time rest on, by the names that the ledger gives.

    Parameters
    ----------
    folder : Path
        Results of the timing experiment.
    kept : Path
        Folder of the report; keeps what is measured here.
    cells : collection of Cell, optional
        The runs that are meant; all by default.
    quick : bool
        Measure few frames and passes.

    Returns
    -------
    dict of str to DataFrame
        Times are CPU seconds, methods as written: `camshift`, `camshift_improved`, `proposed`
        (N = 60), `particle_filter` (N = 400). `implementation` is `plain` or `compiled`, `window`
        that of both CamShifts.

        `frame_times`: see there. `method_times` (WA-18 to WA-20, WA-23, C9), a pass and window a
        row: `sequence` (`table-tennis`, `hand`), `implementation`, `window`, a column for each
        method and `motion` (the motion map alone), all measured side by side; the filters' are the
        same beside both windows. `motion_share` (WA-23): `implementation`, `window`,
        `share` of the motion map in what improved CamShift takes longer on `hand`.
        `particle_times` (WA-19), a pass a row: `method` (`proposed`, `particle_filter`),
        `implementation`, `particles`, `seconds`. `time_slopes` (WA-19), a line through these a
        row: `method`, `implementation`, `slope`, `lower_limit`, `upper_limit` [seconds a
        particle], `r_squared`. `disturbed_passes`, a row each of `method_times` that other load
        disturbed: they are left out of all the others.
    """
    known = kept_times(tuple(PUBLISHED), TABLE_1, kept / "times", quick=quick)
    by_method, by_number = (
        known[name][known[name]["disturbed"] == 0] for name in ("method_times", "particle_times")
    )
    every = known["method_times"]
    return {
        "disturbed_passes": every[(every["disturbed"] == 1) & (every["window"] == WINDOWS[0])],
        "frame_times": method_frames(folder, cells),
        "method_times": by_method,
        "motion_share": _motion_share(by_method),
        "particle_times": by_number,
        "time_slopes": particle_slopes(by_number),
    }


def _motion_share(times: pd.DataFrame) -> pd.DataFrame:
    here = times[times["sequence"] == SECTION_3_2].groupby(["implementation", "window"])
    medians = here[["camshift", "camshift_improved", "motion"]].median()
    longer = medians["camshift_improved"] - medians["camshift"]
    return (medians["motion"] / longer).rename("share").reset_index()


def tables(context: "Context") -> dict[str, pd.DataFrame]:
    """All of `measured_times`."""
    name = context.description.experiment("table-1")
    return measured_times(
        context.results / name,
        context.folder,
        context.asked.get(name, {}),
        quick=context.effort.quick,
    )


def method_table(context: "Context") -> Table:
    """Times as ratios beside the paper's."""
    name = context.description.experiment("table-1")
    failed = failed_passes(context.results / name, context.asked.get(name))
    return _method_table(context.tables, failed)


def particle_table(context: "Context") -> Table:
    """What a particle costs."""
    return _particle_table(context.tables["time_slopes"])


def _method_table(tables: Mapping[str, pd.DataFrame], failed: Sequence[str]) -> Table:
    data = [
        _row(tables, sequence, method, window)
        for sequence, published in PUBLISHED.items()
        for method in published
        for window in (WINDOWS if method in WINDOWED else ("",))
    ]
    published = PUBLISHED[TABLE_1]
    over_proposed = [
        f"{name} {_ratio_words(_timed(tables, TABLE_1, name), 'particle_filter', 'proposed')}"
        for name in IMPLEMENTATIONS
    ]
    shares = tables["motion_share"].query("window == 'fixed'").set_index("implementation")["share"]
    told = {name: number_words(100 * shares.get(name, np.nan), 0) for name in IMPLEMENTATIONS}
    return Table(
        name="table-1",
        caption=(
            "Table 1 and section 3.2: time a frame, as written, as ratios to CamShift with a fixed "
            "window beside the paper's (MATLAB 6.5 on a Pentium 4 of 2.8 GHz; seconds of two "
            "machines are not compared); medians of CPU time on one thread, in plain NumPy and "
            "compiled"
        ),
        heads=list(data[0]),
        n_labels=2,
        rows=[[Cell(text) for text in row.values()] for row in data],
        notes=[
            "particle filter over proposed: paper "
            f"{published['particle_filter'] / published['proposed']:.2f}, "
            + ", ".join(over_proposed),
            "ratios: geometric means over passes through frames that all methods were shown in "
            f"turns; {len(tables['disturbed_passes'])} passes that other load disturbed are left "
            "out",
            "of what improved CamShift takes longer the motion map takes "
            f"{told['plain']} % in plain NumPy, {told['compiled']} % compiled, with a fixed window "
            "(the paper: the difference is due to it); the rest is saturation, and steps on "
            "another map",
            "timing runs: compiled, each by itself; those that other load disturbed are left out, "
            "and where none is left there is a dash",
            *failed,
        ],
        data=pd.DataFrame(data),
    )


def _row(
    tables: Mapping[str, pd.DataFrame], sequence: str, method: str, window: str
) -> dict[str, str]:
    published = PUBLISHED[sequence]
    row = {
        "sequence": sequence,
        "method": f"{WORDS[method]}, {window} window" if window else WORDS[method],
        "paper [s]": f"{published[method]:.3f}",
        "paper, ratio": f"{published[method] / published['camshift']:.2f}",
    }
    for implementation in IMPLEMENTATIONS:
        times = _timed(tables, sequence, implementation)
        fixed = times[times["window"] == "fixed"]
        own = times[times["window"] == window] if window else fixed
        pairs = {"own": own[method].to_numpy(), "camshift": fixed["camshift"].to_numpy()}
        milliseconds = f"{1e3 * np.median(pairs['own']):.3g}" if len(own) else MISSING
        row[f"{implementation} [ms]"] = milliseconds
        row[f"{implementation}, ratio"] = _ratio_words(pairs, "own", "camshift")
    runs = tables["frame_times"]
    runs = runs[(runs["sequence"] == sequence) & (runs["method"] == method)]
    timed = len(runs) > 0 and window != "adaptive"
    row["timing runs [ms]"] = f"{1e3 * runs['seconds'].median():.3g}" if timed else MISSING
    return row


def _timed(tables: Mapping[str, pd.DataFrame], sequence: str, implementation: str) -> pd.DataFrame:
    times = tables["method_times"]
    return times[(times["sequence"] == sequence) & (times["implementation"] == implementation)]


def _ratio_words(times: Any, longer: str, shorter: str) -> str:
    if not len(times[longer]):
        return MISSING
    return f"{float(np.exp(np.log(times[longer] / times[shorter]).mean())):.2f}"


def _particle_table(slopes: pd.DataFrame) -> Table:
    data: list[dict[str, Any]] = []
    for method, rows in slopes.groupby("method", sort=False):
        row = {"method": WORDS[str(method)].partition(",")[0]}
        for line in rows.to_dict("records"):
            words = [f"{1e6 * line[key]:.3g}" for key in ("slope", "lower_limit", "upper_limit")]
            name = line["implementation"]
            row[f"{name} [µs a particle]"] = f"{words[0]} [{words[1]}, {words[2]}]"
            row[f"{name}, R²"] = f"{line['r_squared']:.2f}"
        data.append(row)
    return Table(
        name="time-particles",
        caption=(
            "What a particle more costs: slopes with 95 % intervals of lines through times a frame "
            f"against the number of particles, on {TABLE_1}"
        ),
        heads=list(data[0]) if data else [],
        n_labels=1,
        rows=[[Cell(text) for text in row.values()] for row in data],
        notes=["the radius of the transition is that of N = 60 and of N = 400, whatever N is here"],
        data=slopes,
    )


def time_rows(times: pd.DataFrame) -> list[dict[str, Any]]:
    """Table 1 and the times of section 3.2: seconds a frame, and ratios to CamShift's.

    Parameters
    ----------
    times : DataFrame
        `method_times` of `timing`; ours are those in plain NumPy, CamShift's window fixed.

    Returns
    -------
    list of dict
        See `bench.papers.Report.rows`. Seconds have quartiles over passes, ratios a 95 %
        interval, which one pass alone has not; there is no row of what was never measured
        undisturbed.
    """
    plain = times[(times["implementation"] == "plain") & (times["window"] == "fixed")]
    rows = []
    for sequence, seconds in PUBLISHED.items():
        here = plain[plain["sequence"] == sequence]
        for method, published in seconds.items():
            label = {"table": TABLES[sequence], "label": method}
            if here.empty:
                continue
            low, middle, high = (float(here[method].quantile(q)) for q in (0.25, 0.5, 0.75))
            rows.append(
                label
                | {"column": "seconds a frame", "published": published}
                | {"measured": middle, "interval": [low, high]}
            )
            if method != "camshift":
                logs = np.log(here[method] / here["camshift"])
                rows.append(
                    label
                    | {
                        "column": "ratio to CamShift",
                        "published": published / seconds["camshift"],
                        "measured": exp(logs.mean()),
                        "interval": _ratios_between(logs),
                    }
                )
    return rows


def _ratios_between(logs: ArrayLike) -> list[float] | None:
    """95 % interval of a ratio from its logarithms a pass; None where a single one is left."""
    return [exp(limit) for limit in mean_interval(logs)] if np.size(logs) > 1 else None
