"""Film strips of stored results, and the boxes of all trackers on a sequence."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.reporting.outlines import Outlines, outlines_of_run
from trackmark.bench.reporting.stored_runs import one_pass_runs, open_sequence
from trackmark.bench.store.index import read_index
from trackmark.bench.store.layout import experiment_folders
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import StoredTruth
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
    rows = {str(row["sequence"]): row for row in read_index(Results(experiment))}
    boxes: dict[str, _Boxes] = {}
    for only in [{}] if chosen is None else [{"sequence": name} for name in chosen]:
        for row, run, truth in one_pass_runs(experiment, **only):
            boxes.setdefault(row["sequence"], _Boxes(truth)).add(row, run)
    files, paths = file_names(rows), list[Path]()
    for name in sorted(rows) if chosen is None else chosen:
        sequence = open_sequence(rows[name])
        if isinstance(sequence, str):
            tell(f"{name}: no film strip: it is not at {rows[name]['source']} as it was.")
            continue
        numbers = evenly_spaced(sequence.first_frame, len(sequence) - 1, STRIP_FRAMES)
        shown, shades = dict[str, NDArray[np.float64]](), dict[str, str]()
        if name in boxes:
            shown = boxes[name].labelled(None if chosen is None else chosen[name])
            shades = boxes[name].shades(trackers)
        strip = film_strip(sequence.__getitem__, numbers, shown, name, shades=shades)
        paths.append(write_film_strip(folder / f"strip-{files[name]}.png", strip))
    return paths


class _Boxes:
    """Boxes on a sequence: its ground truth, and one repetition of each tracker in one trace."""

    def __init__(self, truth: StoredTruth, repetition: int = 0, trace: Trace = "online") -> None:
        self._truth, self._repetition, self._trace = truth.boxes, repetition, trace
        self._labelled: dict[str, tuple[str, NDArray[Any]]] = {}  # by tracker

    def add(self, row: Mapping[str, Any], run: Run) -> str:
        """Add a run and return its label; '' for another repetition of a tracker.

        A tracker without the repetition (a deterministic one) shows its first.
        """
        tracker = row["tracker"]
        if row["repetition"] != self._repetition and tracker in self._labelled:
            return ""
        suffix = "" if run.revised is None else f", {TRACE_WORDS[self._trace]}"
        self._labelled[tracker] = f"{tracker}{suffix}", run.boxes_in(self._trace)
        return f"{tracker}{suffix}"

    def labelled(self, trackers: Collection[str] | None = None) -> dict[str, NDArray[np.float64]]:
        """Return boxes of some trackers, all by default, by label, the ground truth first."""
        chosen = self._labelled if trackers is None else set(trackers)
        boxes = [labelled for tracker, labelled in self._labelled.items() if tracker in chosen]
        return {TRUTH: self._truth} | dict(boxes)

    def shades(self, trackers: Collection[str]) -> dict[str, str]:
        """Return colours by label, as in plots of these trackers."""
        by_tracker = colours(list(dict.fromkeys([*trackers, *self._labelled])))
        return {label: by_tracker[tracker] for tracker, (label, _) in self._labelled.items()}


def boxes_on(
    folder: Path, sequence: str, repetition: int = 0, trace: Trace = "online"
) -> tuple[dict[str, NDArray[np.float64]], dict[str, Outlines]]:
    """Return boxes, the ground truth first, and outlines on a sequence by label.

    Labels are the trackers', with the trace if a tracker revised boxes. Outlines are of online
    estimates only. Failed runs are included as far as they got.
    """
    boxes, outlines = None, dict[str, Outlines]()
    for experiment in experiment_folders(folder):
        for row, run, truth in one_pass_runs(experiment, sequence=sequence):
            boxes = boxes or _Boxes(truth, repetition, trace)
            label = boxes.add(row, run)
            if label and (trace == "online" or run.revised is None):
                outlines[label] = outlines_of_run(run)
    return (boxes.labelled(), outlines) if boxes else ({}, {})
