"""Times of the paper's Table 1 and section 3.2 beside ours, and what a particle costs."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bench.contestant import contestant
from bench.papers.timed import timed_runs
from bench.papers.wang2010.costs import (
    IMPLEMENTATIONS,
    METHODS,
    method_times,
    motion_times,
    particle_slopes,
    particle_times,
)
from bench.store.layout import Cell as StoredCell
from reports.tables import MISSING, Cell, Table

__all__ = ["PUBLISHED", "frame_times", "measured_times", "time_tables"]

TABLE_1, SECTION_3_2 = "wang2010/table-tennis", "wang2010/hand"
PUBLISHED: Mapping[str, Mapping[str, float]] = {
    TABLE_1: {"camshift": 0.063, "proposed": 0.120, "particle_filter": 0.214},
    SECTION_3_2: {"camshift": 0.071, "camshift_improved": 0.098},
}
"""Seconds a frame of Table 1 and of section 3.2, by sequence and method."""

WORDS = {
    "camshift": "CamShift",
    "camshift_improved": "improved CamShift",
    "proposed": "proposed, N = 60",
    "particle_filter": "particle filter, N = 400",
}

_PASSES, _FRAMES = 8, 60
_QUICK_PASSES, _QUICK_FRAMES = 2, 10


def frame_times(folder: Path, cells: Collection[StoredCell] | None = None) -> pd.DataFrame:
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
    pieces = [pd.DataFrame(columns=["method", "sequence", "frame", "seconds"])]
    for run in timed_runs(folder, cells):
        assert run.times is not None
        if run.identity.tracker not in written:
            continue
        timed = np.flatnonzero(np.isfinite(run.times.cpu))
        pieces.append(
            pd.DataFrame(
                {
                    "method": written[run.identity.tracker],
                    "sequence": run.identity.sequence,
                    "frame": timed,
                    "seconds": run.times.cpu[timed],
                }
            )
        )
    frames = pd.concat(pieces[1:] or pieces, ignore_index=True)
    keys = ["method", "sequence", "frame"]
    return frames.groupby(keys, as_index=False).agg({"seconds": "median"})


def measured_times(
    folder: Path, cells: Collection[StoredCell] | None = None, *, quick: bool = False
) -> dict[str, pd.DataFrame]:
    """What the claims on time rest on, by the names that the ledger gives.

    Parameters
    ----------
    folder : Path
        Results of the timing experiment.
    cells : collection of Cell, optional
        The runs that are meant; all by default.
    quick : bool
        Measure few frames and passes.

    Returns
    -------
    dict of str to DataFrame
        `implementation` is `plain` or `compiled`, times are CPU seconds, and methods as written:
        `camshift`, `camshift_improved`, `proposed` (N = 60), `particle_filter` (N = 400).

        `frame_times`: see there. `method_times` (WA-18, WA-20, WA-23, C9), a pass and frame a
        row, measured side by side: `sequence`, `implementation`, a column of seconds for each of
        the four. `particle_times` (WA-19), a pass a row: `method` (`proposed`,
        `particle_filter`), `implementation`, `particles`, `seconds`. `time_slopes` (WA-19), a
        line through these a row: `method`, `implementation`, `slope`, `lower_limit`,
        `upper_limit` [seconds a particle], `r_squared`. `motion_times` (WA-23), a pass a row:
        see `costs.motion_times`. `motion_share`: `implementation`, `share`, its median.
    """
    passes, frames = (_QUICK_PASSES, _QUICK_FRAMES) if quick else (_PASSES, _FRAMES)
    by_number = particle_times(TABLE_1, passes, frames)
    motion = motion_times(SECTION_3_2, passes, frames)
    return {
        "frame_times": frame_times(folder, cells),
        "method_times": method_times(list(PUBLISHED), passes, frames),
        "particle_times": by_number,
        "time_slopes": particle_slopes(by_number),
        "motion_times": motion,
        "motion_share": motion.groupby("implementation", as_index=False)[["share"]].median(),
    }


def time_tables(tables: Mapping[str, pd.DataFrame], failed: Sequence[str] = ()) -> list[Table]:
    """Times as ratios beside the paper's, and what a particle costs.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        See `measured_times`.
    failed : sequence of str
        Timing runs that failed, a line each.
    """
    return [_method_table(tables, failed), _particle_table(tables["time_slopes"])]


def _method_table(tables: Mapping[str, pd.DataFrame], failed: Sequence[str]) -> Table:
    data = [
        _row(tables, sequence, method)
        for sequence, published in PUBLISHED.items()
        for method in published
    ]
    return Table(
        name="table-1",
        caption=(
            "Table 1 and section 3.2: time a frame, as written, as ratios to CamShift beside the "
            "paper's (MATLAB 6.5 on a Pentium 4 of 2.8 GHz; seconds of two machines are not "
            "compared); medians of CPU time on one thread, in plain NumPy and compiled"
        ),
        heads=list(data[0]),
        n_labels=2,
        rows=[[Cell(text) for text in row.values()] for row in data],
        notes=[
            _filter_over_proposed(tables["method_times"]),
            "ratios: geometric means over frames that all methods were shown in turns; CamShift "
            "has a fixed window",
            _motion_words(tables["motion_share"]),
            "timing runs: compiled, each by itself; those that other load disturbed are left out, "
            "and where none is left there is a dash",
            *failed,
        ],
        data=pd.DataFrame(data),
    )


def _row(tables: Mapping[str, pd.DataFrame], sequence: str, method: str) -> dict[str, str]:
    published = PUBLISHED[sequence]
    row = {
        "sequence": sequence,
        "method": WORDS[method],
        "paper [s]": f"{published[method]:.3f}",
        "paper, ratio": f"{published[method] / published['camshift']:.2f}",
    }
    for implementation in IMPLEMENTATIONS:
        times = _timed(tables["method_times"], sequence, implementation)
        row[f"{implementation} [ms]"] = f"{1e3 * times[method].median():.3g}"
        row[f"{implementation}, ratio"] = f"{_ratio(times, method, 'camshift'):.2f}"
    runs = tables["frame_times"]
    runs = runs[(runs["sequence"] == sequence) & (runs["method"] == method)]
    row["timing runs [ms]"] = f"{1e3 * runs['seconds'].median():.3g}" if len(runs) else MISSING
    return row


def _timed(times: pd.DataFrame, sequence: str, implementation: str) -> pd.DataFrame:
    return times[(times["sequence"] == sequence) & (times["implementation"] == implementation)]


def _ratio(times: pd.DataFrame, longer: str, shorter: str) -> float:
    return float(np.exp(np.log(times[longer] / times[shorter]).mean()))


def _filter_over_proposed(times: pd.DataFrame) -> str:
    ratios = [
        f"{implementation} "
        f"{_ratio(_timed(times, TABLE_1, implementation), 'particle_filter', 'proposed'):.2f}"
        for implementation in IMPLEMENTATIONS
    ]
    published = PUBLISHED[TABLE_1]["particle_filter"] / PUBLISHED[TABLE_1]["proposed"]
    return f"particle filter over proposed: paper {published:.2f}, {', '.join(ratios)}"


def _motion_words(share: pd.DataFrame) -> str:
    shares = [f"{row['implementation']} {100 * row['share']:.0f} %" for _, row in share.iterrows()]
    return (
        "of what improved CamShift takes longer than CamShift the motion map takes "
        f"{', '.join(shares)} (the paper: the difference is due to it); the rest is saturation, "
        "and steps on another map"
    )


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
        heads=list(data[0]),
        n_labels=1,
        rows=[[Cell(text) for text in row.values()] for row in data],
        notes=["the radius of the transition is that of N = 60 and of N = 400, whatever N is here"],
        data=slopes,
    )
