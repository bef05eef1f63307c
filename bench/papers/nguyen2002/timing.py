"""The time of section 3 beside ours: usual frames, and the burst at an occlusion's end."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from bench.experiments.contestant import contestant
from bench.papers.tables import number_words, text_table
from bench.store.layout import Cell, run_path
from bench.store.loading import load_results
from bench.store.results import Results
from reports.tables import Table

__all__ = ["PUBLISHED", "run_times", "time_table"]

PUBLISHED = 0.005
"""Seconds a frame of section 3, on a Pentium II of 400 MHz."""


def run_times(folder: Path, cells: Collection[Cell] | None = None) -> pd.DataFrame:
    """What the claim on time rests on, a way of tracking a row.

    Parameters
    ----------
    folder : Path
        Results of the timing experiment.
    cells : collection of Cell, optional
        The runs that are meant; all by default.

    Returns
    -------
    DataFrame
        `preset`, `features`; CPU milliseconds a frame over all runs, NaN for none: `milliseconds`
        (mean), `usual` (median where no occlusion is declared), `burst` (mean where one ends, and
        the frames since are tracked again); `disturbed` (1 where other load disturbed all runs;
        else those that it did are left out).
    """
    results, frames = Results(folder), []
    runs = load_results(folder, cells)
    for row in runs[runs["status"] == "finished"].to_dict("records"):
        place = row["tracker"], row["sequence"], row["repetition"], row["protocol"]
        run = results.read(folder / run_path(*place))
        assert run.times is not None
        settled = contestant(run.identity.tracker)
        ends, hidden = run.details["revision"] > 0, run.details["occluded"] == 1
        kinds = np.select([ends, hidden], ["burst", "hidden"], "usual")
        rows = pd.DataFrame({"milliseconds": 1e3 * run.times.cpu, "kind": kinds})
        labels = {"preset": settled.preset, "features": settled.parameters["features"]}
        frames.append(rows.dropna().assign(**labels, disturbed=row["disturbed"]))
    if not frames:
        return pd.DataFrame(columns=["preset", "features", "milliseconds"])
    ways = pd.concat(frames).groupby(["preset", "features"], sort=False)
    return pd.DataFrame(
        {"preset": preset, "features": features} | _told(rows) for (preset, features), rows in ways
    )


def _told(rows: pd.DataFrame) -> dict[str, float]:
    disturbed = rows["disturbed"].min()
    rows = rows[rows["disturbed"] == disturbed]
    by_kind = rows.groupby("kind")["milliseconds"]
    return {
        "milliseconds": rows["milliseconds"].mean(),
        "usual": by_kind.median().get("usual", np.nan),
        "burst": by_kind.mean().get("burst", np.nan),
        "disturbed": disturbed,
    }


def time_table(times: pd.DataFrame, failed: Sequence[str] = ()) -> Table:
    """Times beside the paper's.

    Parameters
    ----------
    times : DataFrame
        See `run_times`.
    failed : sequence of str
        Timing runs that failed, a line each.
    """
    data = [
        {
            "setting": row["preset"].replace("-", " "),
            "features": row["features"],
            "all frames [ms]": number_words(row["milliseconds"], 2),
            "usual frame [ms]": number_words(row["usual"], 2),
            "at an occlusion's end [ms]": number_words(row["burst"], 1),
            "in usual frames": number_words(row["burst"] / row["usual"], 1),
            "disturbed": "yes" if row["disturbed"] else "no",
        }
        for row in times.to_dict("records")
    ]
    table = text_table(
        "time",
        f"Section 3: CPU time a frame on one thread, of whole runs; the paper says {PUBLISHED} s "
        "on a Pentium II of 400 MHz, for features that it does not name. Frames are 320x240, the "
        "template is about 60x80. A usual frame is one in which no occlusion is declared (median); "
        "at an occlusion's end up to 30 frames are tracked again at once (mean). All frames (mean) "
        "are also those of a declared occlusion, in which the box only goes on and next to nothing "
        "is computed: hence a usual frame may take longer than these. Disturbed: by other load",
        data,
        n_labels=2,
    )
    return replace(table, notes=list(failed))
