"""From stored results to what `reports` draws: data frames, tables, boxes by label.

Reads the folder of results alone; only film strips and videos open sequences, for pixels.
"""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.evaluation.record import Trace
from bench.evaluation.reference import reference
from bench.metrics.centre_error import centre_error
from bench.metrics.measures import MASKS, PER_SEQUENCE, SEGMENTATION, SUMMARY, TIMES
from bench.metrics.overlap import overlap
from bench.store.index import experiment_folders
from bench.store.layout import Cell
from bench.store.loading import as_revised, load_results, ordered_rows
from bench.store.results import Results
from bench.store.truth import read_truth
from reports.overlay import TRUTH
from reports.plots import TRACE_WORDS
from reports.renderers import to_text
from reports.tables import Table, sequence_table, summary_table

__all__ = ["boxes_of", "frame_table", "summary_text", "tables", "timing_runs", "title_of"]

PRESET = "native"


def title_of(folder: Path) -> str:
    """Title of an experiment's results."""
    return Results(folder).asked().title or folder.name


def tables(folder: Path, cells: Collection[Cell] | None = None) -> list[Table]:
    """Tables of one experiment: summary and sequences, masks where there are any, and times.

    With `cells` they show these runs alone. Where a tracker revised boxes there are tables of
    what was said at once and of what was said in the end, and captions say which.
    """
    runs = load_results(folder, cells)
    title = title_of(folder)
    scored = runs[runs["protocol"] == "accuracy"]
    revised = as_revised(scored)
    if revised is None:
        made = _score_tables(scored, title)
    else:
        made = _score_tables(scored, f"{title}, online boxes (what was said at once)")
        again = _score_tables(revised, f"{title}, revised boxes (what was said in the end)")
        made += [replace(table, name=f"{table.name}-revised") for table in again]
    segmenting = scored[scored["tracker"].isin(_segmenting(scored))]
    if len(segmenting):
        table = sequence_table(
            segmenting,
            SEGMENTATION,
            f"{title}, masks: region similarity J and contour accuracy F as DAVIS defines them",
            PRESET,
        )
        made.append(replace(table, name="segmentation"))
    timed = timing_runs(runs)
    if len(timed):
        table = sequence_table(
            timed,
            TIMES,
            f"{title}, timing runs (none where load disturbed a pass: remove it and run again)",
            PRESET,
        )
        made.append(replace(table, name="times"))
    return made


def _score_tables(scored: pd.DataFrame, title: str) -> list[Table]:
    made = []
    masks = MASKS if _segmenting(scored) else ()
    if len(scored["sequence"].unique()) > 1:
        made.append(summary_table(scored, SUMMARY + masks, title, PRESET))
    if len(scored):
        made.append(sequence_table(scored, PER_SEQUENCE + masks, title, PRESET))
    return made


def _segmenting(scored: pd.DataFrame) -> set[str]:
    """Trackers with scores of masks."""
    there = [measure.name for measure in MASKS if measure.name in scored]
    return set(scored["tracker"][scored[there].notna().any(axis=1)])


def summary_text(folder: Path, cells: Collection[Cell]) -> str:
    """Tables of some runs of an experiment for a terminal."""
    return "\n".join(to_text(table) for table in tables(folder, cells))


def timing_runs(runs: pd.DataFrame) -> pd.DataFrame:
    """Those of the runs that were timed."""
    return runs[runs["protocol"] == "timing"]


def frame_table(folder: Path) -> pd.DataFrame:
    """A row an evaluated frame of every finished run that was scored.

    Returns
    -------
    DataFrame
        `tracker`, `sequence`, `repetition`, `frame`, and of online boxes `overlap` in [0, 1] and
        `centre_error` in pixels; `revised`, whether the run revised some of them later.
    """
    results = Results(folder)
    pieces = []
    for row in ordered_rows(results, status="finished", protocol="accuracy"):
        run = results.read(folder / row["path"])
        stored = read_truth(folder, row["sequence"], row["fingerprint"])
        truth = reference(stored, run.identity.init, row["sequence"])
        present = np.isfinite(truth.boxes).all(axis=1)
        evaluated = np.flatnonzero(present)[1:]
        pieces.append(
            pd.DataFrame(
                {
                    "tracker": row["tracker"],
                    "sequence": row["sequence"],
                    "repetition": row["repetition"],
                    "frame": evaluated,
                    "overlap": overlap(truth.boxes[evaluated], run.boxes[evaluated]),
                    "centre_error": centre_error(truth.boxes[evaluated], run.boxes[evaluated]),
                    "revised": run.revised is not None,
                }
            )
        )
    return pd.concat(pieces, ignore_index=True) if pieces else pd.DataFrame()


def boxes_of(
    folder: Path, sequence: str, repetition: int = 0, trace: Trace = "online"
) -> dict[str, NDArray[Any]]:
    """Boxes on a sequence by label, the truth first; failed runs as far as they got.

    Labels are the trackers', and say which trace it is where a tracker revised boxes. A tracker
    whose `repetition` is not there (one that never draws) shows its first.
    """
    truth: dict[str, NDArray[Any]] = {}
    found: dict[str, tuple[str, NDArray[Any]]] = {}
    for experiment in experiment_folders(folder):
        results = Results(experiment)
        for row in ordered_rows(results, sequence=sequence, protocol="accuracy"):
            if row["repetition"] != repetition and row["tracker"] in found:
                continue
            if not truth:
                truth[TRUTH] = read_truth(experiment, sequence, row["fingerprint"]).boxes
            run = results.read(experiment / row["path"])
            said = "" if run.revised is None else f", {TRACE_WORDS[trace]}"
            found[row["tracker"]] = f"{row['tracker']}{said}", run.boxes_in(trace)
    return truth | dict(found.values())
