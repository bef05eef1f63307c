"""Times of the paper's tracker: what Fig. 5 shows, what the claims on time rest on, their table."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from bench.papers.nummiaro2003.costs import (
    clock_rate,
    compiled_filter,
    cost_slopes,
    cost_times,
    model_times,
    plain_filter,
    plain_times,
    weighting_times,
)
from bench.papers.timed import timed_runs
from bench.store.layout import Cell as StoredCell
from reports.tables import MISSING, Cell, Table

__all__ = ["frame_times", "measured_times", "time_tables"]

SEQUENCES = ("nummiaro2003/person", "nummiaro2003/car")
STUDENTS = "nummiaro2003/students"
PAPERS_CLOCK = 800e6  # Hz
FRAME = 40.0  # milliseconds

_FRAMES, _QUICK_FRAMES = 100, 10
_BLOCKS, _QUICK_BLOCKS = 6, 2
_UNITS = {"samples": ("µs a sample", 1e6), "area": ("ns a px²", 1e9), "bins": ("ns a bin", 1e9)}


def frame_times(folder: Path, cells: Collection[StoredCell] | None = None) -> pd.DataFrame:
    """CPU seconds of every frame of the timing runs that no load disturbed (Fig. 5).

    Returns
    -------
    DataFrame
        `sequence`, `repetition`, `frame`, `seconds`, and `area` of the mean state's ellipse
        [pixels²].
    """
    pieces = [pd.DataFrame(columns=["sequence", "repetition", "frame", "seconds", "area"])]
    for run in timed_runs(folder, cells):
        assert run.times is not None
        timed = np.flatnonzero(np.isfinite(run.times.cpu))
        area = np.pi * run.details["half_width"] * run.details["half_height"]
        pieces.append(
            pd.DataFrame(
                {
                    "sequence": run.identity.sequence,
                    "repetition": run.identity.repetition,
                    "frame": timed,
                    "seconds": run.times.cpu[timed],
                    "area": area[timed],
                }
            )
        )
    return pd.concat(pieces[1:] or pieces, ignore_index=True)


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
        Measure few frames and rounds.

    Returns
    -------
    dict of str to DataFrame
        `run_times`: see `frame_times`. `frame_times`: `sequence`, `frame`, `seconds`, `area`,
        medians over the repetitions. `plain_times`, a row a sequence: `milliseconds` and
        `milliseconds_at_800_mhz` of an update in plain NumPy, its quartiles over frames
        (`lower_quartile`, `upper_quartile`), `compiled_milliseconds` beside it and the
        `clock` [Hz]. `time_slopes`: see `cost_slopes`, with `implementation`. `profile`:
        `sequence`, `implementation`, `weighting_share` (of an update, the median over frames).
        `model_times`: see `costs.model_times`, on `students`.
    """
    runs = frame_times(folder, cells)
    frames, blocks = (_QUICK_FRAMES, _QUICK_BLOCKS) if quick else (_FRAMES, _BLOCKS)
    slopes = [
        cost_slopes(cost_times(SEQUENCES[0], make, blocks)).assign(implementation=implementation)
        for implementation, make in (("compiled", compiled_filter), ("plain", plain_filter))
    ]
    parts = weighting_times(SEQUENCES, frames)
    parts["weighting_share"] = parts["weighting"] / parts["update"]
    keys = ["sequence", "implementation"]
    medians = {"seconds": "median", "area": "median"}
    return {
        "run_times": runs,
        "frame_times": runs.groupby(["sequence", "frame"], as_index=False).agg(medians),
        "plain_times": _at_two_clocks(plain_times(SEQUENCES, frames), clock_rate()),
        "time_slopes": pd.concat(slopes, ignore_index=True),
        "model_times": model_times(STUDENTS, frames),
        "profile": parts.groupby(keys, as_index=False).agg({"weighting_share": "median"}),
    }


def _at_two_clocks(times: pd.DataFrame, clock: float) -> pd.DataFrame:
    """Milliseconds on this core, and what as many cycles take on the paper's."""
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
                "compiled_milliseconds": 1e3 * updates["compiled"].median(),
                "clock": clock,
            }
        )
    return pd.DataFrame(rows)


def time_tables(tables: Mapping[str, pd.DataFrame], failed: Sequence[str] = ()) -> list[Table]:
    """Milliseconds a frame, and what they grow with.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        See `measured_times`.
    failed : sequence of str
        Timing runs that failed, a line each.
    """
    return [_frame_table(tables, failed), _cost_table(tables["time_slopes"])]


def _frame_table(tables: Mapping[str, pd.DataFrame], failed: Sequence[str]) -> Table:
    shares = tables["profile"].set_index(["sequence", "implementation"])["weighting_share"]
    frames = tables["frame_times"]
    data = []
    for _, row in tables["plain_times"].iterrows():
        name = str(row["sequence"])
        timed = frames[frames["sequence"] == name]
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
    return Table(
        name="time",
        caption=(
            "Time a frame, CPU, 100 samples, one thread: median and quartiles over frames (the "
            "paper: real time on a PC of 800 MHz; the values of its Fig. 5 are lost)"
        ),
        heads=list(data[0]),
        n_labels=1,
        rows=[[Cell(text) for text in row.values()] for row in data],
        notes=[
            "plain is the same filter in NumPy, sample by sample, with the same estimates; at 800 "
            "MHz it would need as many cycles as here, where the core runs at "
            f"{tables['plain_times']['clock'].iloc[0] / 1e9:.2f} GHz; a frame has {FRAME:.0f} ms",
            f"a model for each sample takes {_ratio(tables['model_times']):.1f} times as long as "
            "one for all, compiled, on students (median over frames)",
            "weighting: bins, histograms and weights of the samples, of the whole update's time",
            "timing runs that other load disturbed are left out; where none is left, a dash",
            *failed,
        ],
        data=pd.DataFrame(data),
    )


def _ratio(times: pd.DataFrame) -> float:
    return float((times["per_particle"] / times["one"]).median())


def _cost_table(slopes: pd.DataFrame) -> Table:
    data = []
    for factor, rows in slopes.groupby("factor", sort=False):
        unit, scale = _UNITS[str(factor)]
        row = {"time grows with": f"{factor} [{unit}]"}
        for line in rows.to_dict("records"):
            slope, low, high = (
                scale * line[key] for key in ("slope", "lower_limit", "upper_limit")
            )
            row[str(line["implementation"])] = f"{slope:.3g} [{low:.3g}, {high:.3g}]"
            row[f"{line['implementation']}, R²"] = f"{line['r_squared']:.2f}"
        data.append(row)
    return Table(
        name="time-cost",
        caption=(
            "What an update's time grows with: slopes with 95 % intervals of lines through medians "
            "of updates on one image, one thing changed at a time"
        ),
        heads=list(data[0]),
        n_labels=1,
        rows=[[Cell(text) for text in row.values()] for row in data],
        notes=["bins: all of them, 4 to 16 a channel; area: of the given ellipse, 0.5 to 4 times"],
        data=slopes,
    )
