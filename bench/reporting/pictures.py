"""Plots and film strips of stored results; film strips alone open sequences, for their pixels."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Trace
from bench.evaluation.reference import reference
from bench.metrics.centre_error import centre_error
from bench.metrics.overlap import overlap
from bench.reporting.tables import tables, timing_runs, title_of
from bench.store.files import ResultsError
from bench.store.index import read_index
from bench.store.layout import experiment_folders
from bench.store.loading import load_results, ordered_rows
from bench.store.results import Results
from bench.store.truth import read_truth
from datasets import Sequence
from reports.film_strip import evenly_spaced, film_strip, write_film_strip
from reports.overlay import TRUTH
from reports.plots import TRACE_WORDS
from reports.tables import complete
from reports.write import file_name, write_plots, write_tables

__all__ = ["boxes_of", "frame_table", "write_report"]


def write_report(
    experiment: Path, folder: Path, tell: Callable[[str], None], *, pictures: bool = True
) -> list[Path]:
    """Write a report of one experiment and give the files.

    Parameters
    ----------
    experiment : Path
        Its results.
    folder : Path
        Where the files go.
    tell : callable
        Given a sentence on every sequence that can't be drawn.
    pictures : bool
        Whether plots and film strips are drawn beside the tables.

    Raises
    ------
    ResultsError
        Where results can't be read or the report can't be written.
    """
    try:
        paths = write_tables(folder, tables(experiment))
        if pictures:
            runs = load_results(experiment)
            scored = complete(runs[runs["protocol"] == "accuracy"])
            paths += write_plots(
                folder,
                frame_table(experiment),
                timing_runs(runs),
                title_of(experiment),
                trackers=list(scored["tracker"].unique()),
                incomplete=set(scored[scored["status"] != "finished"]["tracker"]),
            )
            paths += _film_strips(experiment, folder, tell)
    except OSError as error:
        raise ResultsError(str(error.strerror or error)) from error
    return paths


def _film_strips(experiment: Path, folder: Path, tell: Callable[[str], None]) -> list[Path]:
    """A strip of every sequence whose pixels can be had here as they were."""
    paths = []
    rows = {str(row["sequence"]): row for row in read_index(Results(experiment))}
    for name, row in sorted(rows.items()):
        sequence = _opened(row)
        if sequence is None:
            tell(f"{name}: no film strip: it is not at {row['source']} as it was.")
            continue
        numbers = evenly_spaced(sequence.first_frame, len(sequence) - 1, 10)
        strip = film_strip(sequence.__getitem__, numbers, boxes_of(experiment, name), name)
        paths.append(write_film_strip(folder / f"strip-{file_name(name)}.png", strip))
    return paths


def _opened(row: dict[str, Any]) -> Sequence | None:
    """The sequence of a run, where it is still there and the same."""
    try:
        sequence = datasets.load(row["source"], truth=row["truth"] or None)
    except datasets.SequenceError:
        return None
    return sequence if sequence.fingerprint == row["fingerprint"] else None


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
