"""Film strips of stored results, and the boxes of all trackers on a sequence."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.reporting.outlines import Outlines, outlines_of_run
from trackmark.bench.reporting.stored_runs import StoredRun, one_pass_runs, open_sequence
from trackmark.bench.store.layout import experiment_folders
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import list_scored_runs
from trackmark.reports.film_strip import evenly_spaced, film_strip, write_film_strip
from trackmark.reports.overlay import TRUTH
from trackmark.reports.palette import colours
from trackmark.reports.write import file_names

STRIP_FRAMES = 10

TRACE_WORDS: Mapping[Trace, str] = {
    "online": "said at once (online)",
    "revised": "said in the end (revised)",
}
"""Words in pictures for boxes of trackers that revise some of them later."""


def write_strips(
    experiment: Path,
    folder: Path,
    tell: Callable[[str], None],
    trackers: Collection[str],
    chosen: Mapping[str, Collection[str]] | None = None,
) -> list[Path]:
    """Draw film strips of sequences with trackers' boxes; return the files.

    `trackers`: in the order of their colours. `chosen`: trackers by sequence; all on all sequences
    by default. `tell` receives a message on every sequence that cannot be drawn.
    """
    rows = {str(row["sequence"]): row for row in list_scored_runs(Results(experiment))}
    selected = [{}] if chosen is None else [{"sequence": name} for name in chosen]
    stored = [
        (row, replace(run, arrays={}), truth)  # masks of all runs may not fit into memory
        for only in selected
        for row, run, truth in one_pass_runs(experiment, **only)
    ]
    shades = colours(list(dict.fromkeys([*trackers, *(row["tracker"] for row, *_ in stored)])))
    files, paths = file_names(rows), list[Path]()
    for name in sorted(rows) if chosen is None else chosen:
        sequence = open_sequence(rows[name])
        if isinstance(sequence, str):
            tell(f"{name}: no film strip: it is not at {rows[name]['source']} as it was.")
            continue
        here = [one for one in stored if one[0]["sequence"] == name]
        boxes, named = {TRUTH: here[0][2].boxes} if here else {}, {}
        for tracker, run in _one_each(here, 0).items():
            if chosen is None or tracker in chosen[name]:
                label = _label(tracker, run, "online")
                boxes[label], named[label] = run.boxes, shades[tracker]
        numbers = evenly_spaced(sequence.first_frame, len(sequence) - 1, STRIP_FRAMES)
        strip = film_strip(sequence.__getitem__, numbers, boxes, name, shades=named)
        paths.append(write_film_strip(folder / f"strip-{files[name]}.png", strip))
    return paths


def boxes_on(
    folder: Path, sequence: str, repetition: int = 0, trace: Trace = "online"
) -> tuple[dict[str, NDArray[np.float64]], dict[str, Outlines]]:
    """Return boxes, the ground truth first, and outlines on a sequence by label.

    Labels are the trackers', with the trace if a tracker revised boxes. Outlines are of online
    estimates only. Failed runs are included as far as they got.
    """
    experiments = experiment_folders(folder)
    stored = [one for path in experiments for one in one_pass_runs(path, sequence=sequence)]
    boxes = {TRUTH: stored[0][2].boxes} if stored else {}
    outlines = dict[str, Outlines]()
    for tracker, run in _one_each(stored, repetition).items():
        label = _label(tracker, run, trace)
        boxes[label] = run.boxes_in(trace)
        if trace == "online" or run.revised is None:
            outlines[label] = outlines_of_run(run)
    return boxes, outlines


def _one_each(stored: Iterable[StoredRun], repetition: int) -> dict[str, Run]:
    """Return one repetition of each tracker; the first run of a tracker that lacks it."""
    runs: dict[str, Run] = {}
    for row, run, _ in stored:
        if row["repetition"] == repetition or row["tracker"] not in runs:
            runs[row["tracker"]] = run
    return runs


def _label(tracker: str, run: Run, trace: Trace) -> str:
    return tracker if run.revised is None else f"{tracker}, {TRACE_WORDS[trace]}"
