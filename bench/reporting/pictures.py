"""Reports, plots and film strips of stored results. Only film strips open sequences."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.ground_truth import reference
from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.metrics.centre_error import centre_error
from trackmark.bench.metrics.overlap import overlap
from trackmark.bench.protocols import STORED_ONCE, TIMING
from trackmark.bench.reporting.by_attribute import Shown, open_sequence, write_plot
from trackmark.bench.reporting.by_preset import Scored, write_curves
from trackmark.bench.reporting.tables import title_of
from trackmark.bench.store.index import read_index
from trackmark.bench.store.layout import cell_of, experiment_folders
from trackmark.bench.store.loading import load_results, ordered_rows
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import StoredTruth, read_truth
from trackmark.reports.film_strip import evenly_spaced, film_strip, write_film_strip
from trackmark.reports.overlay import TRUTH
from trackmark.reports.palette import colours
from trackmark.reports.tables import Table, complete
from trackmark.reports.write import file_names, write_plots, write_tables

STRIP_FRAMES = 10

Outlines = Mapping[int, NDArray[np.float64]]
"""Polygons by frame, (points, 2) [pixels]; a row of NaN parts one from the next."""

_GAP = np.full((1, 2), np.nan)
_CORNERS = 64  # of the polygon that stands for an ellipse


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
        runs[runs["protocol"] == TIMING],
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
        boxes = frames_and_boxes(experiment, sequence=name)[1].get(name)
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
            run = results.read(cell_of(row))
            yield row, run, truth(row["sequence"], row["fingerprint"])


def frames_and_boxes(folder: Path, **only: str) -> tuple[pd.DataFrame, "dict[str, _Boxes]"]:
    """Return what plots show, and what film strips show by sequence, of one-pass runs.

    Plots show one row per evaluated frame of every finished run: `tracker`, `sequence`,
    `repetition`, `frame`, and of online boxes `overlap` in [0, 1], `centre_error` in pixels, and
    `revised`: whether the run revised some of them later.
    """
    pieces = []
    boxes: dict[str, _Boxes] = {}
    for row, run, truth in scored_runs(folder, **only):
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
    """Boxes on a sequence: its ground truth, and one repetition of each tracker in one trace."""

    def __init__(self, truth: StoredTruth, repetition: int = 0, trace: Trace = "online") -> None:
        self._truth, self._repetition, self._trace = truth.boxes, repetition, trace
        self._labelled: dict[str, tuple[str, NDArray[Any]]] = {}  # by tracker

    def add(self, row: Mapping[str, Any], run: Run) -> str:
        """Add a run and return its label; '' for another repetition of a tracker.

        A tracker without the repetition (a deterministic one) shows its first.
        """
        from trackmark.reports.plots import TRACE_WORDS  # imports Matplotlib

        tracker = row["tracker"]
        if row["repetition"] != self._repetition and tracker in self._labelled:
            return ""
        suffix = "" if run.revised is None else f", {TRACE_WORDS[self._trace]}"
        self._labelled[tracker] = f"{tracker}{suffix}", run.boxes_in(self._trace)
        return f"{tracker}{suffix}"

    def labelled(self, trackers: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
        """Return boxes of some trackers, all by default, by label, the ground truth first."""
        chosen = self._labelled if trackers is None else set(trackers)
        boxes = [labelled for tracker, labelled in self._labelled.items() if tracker in chosen]
        return {TRUTH: self._truth} | dict(boxes)

    def shades(self, trackers: Collection[str]) -> dict[str, str]:
        """Return colours by label, as in plots of these trackers."""
        by_tracker = colours(list(dict.fromkeys([*trackers, *self._labelled])))
        return {label: by_tracker[tracker] for tracker, (label, _) in self._labelled.items()}


def said_on(
    folder: Path, sequence: str, repetition: int = 0, trace: Trace = "online"
) -> tuple[dict[str, NDArray[Any]], dict[str, Outlines]]:
    """Return boxes, the ground truth first, and outlines on a sequence by label.

    Labels are the trackers', with the trace if a tracker revised boxes. Outlines are of online
    estimates only. Failed runs are included as far as they got.
    """
    boxes, outlines = None, dict[str, Outlines]()
    for experiment in experiment_folders(folder):
        for row, run, truth in scored_runs(experiment, sequence=sequence):
            boxes = boxes or _Boxes(truth, repetition, trace)
            label = boxes.add(row, run)
            if label and (trace == "online" or run.revised is None):
                outlines[label] = outlines_of_run(run)
    return (boxes.labelled(), outlines) if boxes else ({}, {})


def is_round(run: Run) -> bool:
    """Return whether the target is the ellipse in the box, of which the run has half axes."""
    return {"half_width", "half_height"} <= run.details.keys()


def mask_outlines(mask: NDArray[Any]) -> list[NDArray[np.float64]]:
    """Return outlines of a mask's parts and holes, (points, 2); pixel centres lie at halves."""
    whole = np.ascontiguousarray(mask, np.uint8)
    found, _ = cv2.findContours(whole, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    return [np.asarray(outline[:, 0] + 0.5, np.float64) for outline in found]


def outlines_of_run(run: Run) -> Outlines:
    """Return the stored contours or masks of a run, or else ellipses if the target is round."""
    outlines = {}
    for frame, arrays in run.arrays.items():
        lines = [np.asarray(arrays["contour"], np.float64)] if "contour" in arrays else []
        if not lines and "mask" in arrays:
            lines = mask_outlines(arrays["mask"])
        if lines:
            outlines[frame] = _parted(lines)
    if not outlines and is_round(run):
        angles = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
        unit = np.column_stack([np.cos(angles), np.sin(angles)])
        for frame in np.flatnonzero(np.isfinite(run.boxes).all(axis=1)).tolist():
            box = run.boxes[frame]
            outlines[frame] = box[:2] + box[2:] / 2 * (1 + unit)
    return outlines


def outlines_on(
    sequence: datasets.Sequence, said: Mapping[str, Outlines]
) -> Callable[[int], dict[str, NDArray[np.float64]]]:
    """Return a function of the frame that returns outlines by label, the true mask first."""

    def on(frame: int) -> dict[str, NDArray[np.float64]]:
        here = {label: outlines[frame] for label, outlines in said.items() if frame in outlines}
        mask = sequence.mask(frame)
        lines = [] if mask is None else mask_outlines(mask)
        return {TRUTH: _parted(lines), **here} if lines else here

    return on


def _parted(lines: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.vstack([part for line in lines for part in (line, _GAP)])
