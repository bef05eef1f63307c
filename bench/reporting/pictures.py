"""Reports, plots and film strips of stored results. Only film strips open sequences."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.evaluation.record import Run, Trace
from bench.evaluation.reference import reference
from bench.metrics.centre_error import centre_error
from bench.metrics.overlap import overlap
from bench.protocols import STORED_ONCE, TIMING
from bench.reporting.by_attribute import Shown, open_sequence, write_plot
from bench.reporting.by_preset import Scored, write_curves
from bench.reporting.outlines import Outlines, outlines_of_run
from bench.reporting.tables import timing_runs, title_of
from bench.store.index import read_index
from bench.store.layout import experiment_folders
from bench.store.loading import load_results, ordered_rows
from bench.store.results import Results
from bench.store.truth import StoredTruth, read_truth
from reports.film_strip import evenly_spaced, film_strip, write_film_strip
from reports.overlay import TRUTH
from reports.palette import colours
from reports.tables import Table, complete
from reports.write import file_names, write_plots, write_tables

STRIP_FRAMES = 10


def write_report(
    experiment: Path,
    folder: Path,
    tell: Callable[[str], None],
    tables: Sequence[Table],
    title: str = "",
    pictures: str | None = "png",
    scored: Sequence[Scored] = (),
    by_attribute: Sequence[Shown] = (),
) -> list[Path]:
    """Write tables and pictures of an experiment into a folder; return the files.

    `title`: of plots; the experiment's own by default. `pictures`: format of plots (`png`, `svg`,
    `pdf`), or None for no pictures; film strips are PNG. `tell` receives a message on every
    sequence and preset that cannot be drawn. `scored` and `by_attribute`: scores of presets whose
    curves are drawn. Raises `ResultsError` if results cannot be read, `OSError` if a file cannot be
    written.
    """
    paths = write_tables(folder, tables)
    if pictures is not None:
        suffix, title = f".{pictures}", title or title_of(experiment)
        paths += write_pictures(experiment, folder, tell, title, scored, suffix)
        for table, measure, curves in by_attribute:
            paths += write_plot(folder / f"{table.name}{suffix}", curves, measure, title)
    return paths


def write_pictures(
    experiment: Path,
    folder: Path,
    tell: Callable[[str], None],
    title: str,
    by_preset: Collection[Scored],
    suffix: str,
) -> list[Path]:
    """Draw the plots and film strips of `write_report`. Each run is read once."""
    runs = load_results(experiment)
    scored = complete(runs[runs["protocol"] == "accuracy"])
    frames, boxes = frames_and_boxes(experiment)
    trackers = [str(name) for name in runs[runs["protocol"] != "timing"]["tracker"].unique()]
    paths = write_plots(
        folder,
        frames,
        timing_runs(runs),
        title,
        trackers=trackers,
        incomplete=set(scored[scored["status"] != "finished"]["tracker"]),
        suffix=suffix,
    )
    paths += write_curves(folder, by_preset, trackers, tell, suffix)
    for name, row, path in _strip_files(experiment, folder):
        paths += _write_strip(row, boxes.get(name), trackers, path, tell)
    return paths


def write_strips(
    experiment: Path,
    folder: Path,
    tell: Callable[[str], None],
    chosen: Mapping[str, Collection[str]],
    trackers: Collection[str],
) -> list[Path]:
    """Draw film strips of some sequences with some trackers' boxes; return the files.

    `chosen`: trackers by sequence. `trackers`: all trackers, in the order of their colours. `tell`
    receives a message on every sequence that cannot be drawn.
    """
    files = {name: (row, path) for name, row, path in _strip_files(experiment, folder)}
    paths: list[Path] = []
    for name, shown in chosen.items():
        row, path = files[name]
        boxes = _boxes_of([experiment], name)
        paths += _write_strip(row, boxes, trackers, path, tell, shown)
    return paths


def _strip_files(experiment: Path, folder: Path) -> list[tuple[str, dict[str, Any], Path]]:
    """Return every sequence with a row of the index and the file of its film strip."""
    rows = {str(row["sequence"]): row for row in read_index(Results(experiment))}
    names = file_names(rows)
    return [(name, row, folder / f"strip-{names[name]}.png") for name, row in sorted(rows.items())]


def _write_strip(
    row: Mapping[str, Any],
    boxes: "_Boxes | None",
    trackers: Collection[str],
    path: Path,
    tell: Callable[[str], None],
    shown: Collection[str] | None = None,
) -> list[Path]:
    """Draw the boxes of `shown`, all by default, in their colours among the `trackers`."""
    name = str(row["sequence"])
    sequence = open_sequence(row)
    if isinstance(sequence, str):
        tell(f"{name}: no film strip: it is not at {row['source']} as it was.")
        return []
    numbers = evenly_spaced(sequence.first_frame, len(sequence) - 1, STRIP_FRAMES)
    placed = boxes.labelled(shown) if boxes else {}
    shades = boxes.shades(trackers) if boxes else {}
    strip = film_strip(sequence.__getitem__, numbers, placed, name, shades=shades)
    return [write_film_strip(path, strip)]


def scored_runs(folder: Path, **only: str) -> Iterator[tuple[Mapping[str, Any], Run, StoredTruth]]:
    """Return one-pass runs with their rows of the index and their ground truth; read each once."""
    return judged_runs(folder, protocol=STORED_ONCE, **only)


def judged_runs(folder: Path, **only: str) -> Iterator[tuple[Mapping[str, Any], Run, StoredTruth]]:
    """Return the same of runs by all protocols except timing."""
    results = Results(folder)
    truth = cache(partial(read_truth, folder))
    for row in ordered_rows(results, **only):
        if row["protocol"] != TIMING:
            run = results.read(folder / row["path"])
            yield row, run, truth(row["sequence"], row["fingerprint"])


def frames_and_boxes(folder: Path) -> tuple[pd.DataFrame, "dict[str, _Boxes]"]:
    """Return what plots show, and what film strips show by sequence.

    Plots show one row per evaluated frame of every finished run: `tracker`, `sequence`,
    `repetition`, `frame`, and of online boxes `overlap` in [0, 1], `centre_error` in pixels, and
    `revised`: whether the run revised some of them later.
    """
    pieces = []
    boxes: dict[str, _Boxes] = {}
    for row, run, truth in scored_runs(folder):
        if row["status"] == "finished":
            pieces.append(_frames(row, run, truth))
        boxes.setdefault(row["sequence"], _Boxes(truth)).add(row, run)
    return pd.concat(pieces, ignore_index=True) if pieces else pd.DataFrame(), boxes


def _frames(row: Mapping[str, Any], run: Run, stored: StoredTruth) -> pd.DataFrame:
    truth = reference(stored, run.identity.init, row["sequence"]).boxes
    evaluated = np.flatnonzero(np.isfinite(truth).all(axis=1))[1:]
    return pd.DataFrame(
        {
            "tracker": row["tracker"],
            "sequence": row["sequence"],
            "repetition": row["repetition"],
            "frame": evaluated,
            "overlap": overlap(truth[evaluated], run.boxes[evaluated]),
            "centre_error": centre_error(truth[evaluated], run.boxes[evaluated]),
            "revised": run.revised is not None,
        }
    )


class _Boxes:
    """Boxes on a sequence: its truth, and of each tracker one repetition in one trace."""

    def __init__(
        self,
        truth: StoredTruth,
        repetition: int = 0,
        trace: Trace = "online",
        *,
        outlined: bool = False,
    ) -> None:
        self._truth, self._repetition, self._trace = truth.boxes, repetition, trace
        self._outlined = outlined
        self._found: dict[str, tuple[str, NDArray[Any]]] = {}
        self.outlines: dict[str, Outlines] = {}  # by label, of what was said at once

    def add(self, row: Mapping[str, Any], run: Run) -> None:
        """Add a run; of a tracker whose repetition is not there (it never draws) the first."""
        from reports.plots import TRACE_WORDS  # imports Matplotlib

        tracker = row["tracker"]
        if row["repetition"] == self._repetition or tracker not in self._found:
            said = "" if run.revised is None else f", {TRACE_WORDS[self._trace]}"
            label = f"{tracker}{said}"
            self._found[tracker] = label, run.boxes_in(self._trace)
            if self._outlined and (self._trace == "online" or run.revised is None):
                self.outlines[label] = outlines_of_run(run)

    def labelled(self, trackers: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
        """Boxes of some trackers, all by default, by label, the truth first."""
        chosen = self._found if trackers is None else set(trackers)
        found = [boxes for tracker, boxes in self._found.items() if tracker in chosen]
        return {TRUTH: self._truth} | dict(found)

    def shades(self, trackers: Collection[str]) -> dict[str, str]:
        """Colours by label, as plots of these trackers have them."""
        by_tracker = colours(list(dict.fromkeys([*trackers, *self._found])))
        return {label: by_tracker[tracker] for tracker, (label, _) in self._found.items()}


def said_on(
    folder: Path, sequence: str, repetition: int = 0, trace: Trace = "online"
) -> tuple[dict[str, NDArray[Any]], dict[str, Outlines]]:
    """Boxes and outlines on a sequence by label; failed runs as far as they got.

    Boxes have the truth first. Outlines are of what was said at once, and not of revised boxes.

    Labels are the trackers', and say which trace it is where a tracker revised boxes. A tracker
    whose `repetition` is not there (one that never draws) shows its first.
    """
    boxes = _boxes_of(experiment_folders(folder), sequence, repetition, trace, outlined=True)
    return (boxes.labelled(), boxes.outlines) if boxes else ({}, {})


def _boxes_of(
    experiments: Iterable[Path],
    sequence: str,
    repetition: int = 0,
    trace: Trace = "online",
    *,
    outlined: bool = False,
) -> _Boxes | None:
    boxes = None
    for experiment in experiments:
        for row, run, truth in scored_runs(experiment, sequence=sequence):
            boxes = boxes or _Boxes(truth, repetition, trace, outlined=outlined)
            boxes.add(row, run)
    return boxes
