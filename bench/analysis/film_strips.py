"""Film strips of stored results, and the boxes of all trackers on a sequence."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.analysis.outlines import Outlines, outlines_of_run
from trackmark.bench.analysis.stored_runs import (
    StoredRun,
    is_judged,
    one_pass_runs,
    open_sequence,
    read_runs,
)
from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.protocols import STORED_ONE_PASS
from trackmark.bench.store.data_frames import ordered_rows
from trackmark.bench.store.layout import experiment_folders
from trackmark.bench.store.results import Results
from trackmark.reports.overlay import TRUTH, evenly_spaced, film_strip, write_film_strip
from trackmark.reports.palette import colours
from trackmark.reports.write import file_names

N_STRIP_FRAMES = 10

MAX_STRIPS = 100
"""Maximum number of film strips of a report; each has about a megabyte."""

_MAX_PENDING = 4  # film strips in memory

TRACE_WORDS: Mapping[Trace, str] = {"online": "online boxes", "revised": "revised boxes"}
"""Labels in pictures for the boxes of trackers that revise boxes later."""


def write_strips(
    experiment: Path, folder: Path, on_message: Callable[[str], None], trackers: Sequence[str]
) -> list[Path]:
    """Draw a film strip of each sequence with the boxes of trackers; return the files.

    If there are more than `MAX_STRIPS` sequences, the first ones in alphabetical order are drawn.
    `trackers`: all trackers in the order of their colours. `on_message`: called with a message on
    each sequence that cannot be drawn.
    """
    rows: dict[str, list[Mapping[str, Any]]] = {}
    for row in filter(is_judged, ordered_rows(Results(experiment))):  # read once: they can be many
        rows.setdefault(str(row["sequence"]), []).append(row)
    shades, files = colours(trackers), file_names(rows)
    # Encoding takes longer than drawing. It releases the lock of the interpreter.
    with ThreadPoolExecutor(1) as executor:
        paths, written = list[Path](), deque[Future[Path]]()
        if len(rows) > MAX_STRIPS:
            on_message(
                f"film strips: of the first {MAX_STRIPS} of {len(rows)} sequences. `trackmark "
                "show` draws others."
            )
        for name in sorted(rows)[:MAX_STRIPS]:
            sequence = open_sequence(rows[name][-1])
            if isinstance(sequence, str):
                on_message(f"no film strip: {sequence}")
                continue
            strip = _draw_strip(experiment, rows[name], sequence, shades)
            path = folder / f"strip-{files[name]}.png"
            written.append(executor.submit(write_film_strip, path, strip))
            if len(written) > _MAX_PENDING:  # limits the memory
                paths.append(written.popleft().result())
        return paths + [future.result() for future in written]


def _draw_strip(
    experiment: Path,
    rows: Iterable[Mapping[str, Any]],
    sequence: datasets.Sequence,
    shades: Mapping[str, str],
) -> NDArray[np.uint8]:
    """Return the film strip of a sequence with the one-pass runs among `rows`."""
    one_pass = [row for row in rows if row["protocol"] == STORED_ONE_PASS]
    runs = list(read_runs(experiment, one_pass))
    boxes, named = {TRUTH: runs[0][2].boxes} if runs else {}, {}
    for tracker, run in _select_repetition(runs, 0).items():
        label = _label(tracker, run, "online")
        boxes[label], named[label] = run.boxes, shades[tracker]
    numbers = evenly_spaced(sequence.first_frame, len(sequence) - 1, N_STRIP_FRAMES)
    return film_strip(sequence.__getitem__, numbers, boxes, sequence.name, shades=named)


def boxes_on(
    folder: Path, sequence: str, repetition: int = 0, trace: Trace = "online"
) -> tuple[dict[str, NDArray[np.float64]], dict[str, Outlines]]:
    """Return boxes, with the ground truth first, and outlines on a sequence by label.

    A label is the name of a tracker. If the tracker revised boxes, it ends with the trace, online
    or revised. Outlines exist for online estimates only. Failed runs are included up to their
    failure.
    """
    experiments = experiment_folders(folder)
    stored = [run for path in experiments for run in one_pass_runs(path, sequence=sequence)]
    boxes = {TRUTH: stored[0][2].boxes} if stored else {}
    outlines = dict[str, Outlines]()
    for tracker, run in _select_repetition(stored, repetition).items():
        label = _label(tracker, run, trace)
        boxes[label] = run.boxes_in(trace)
        if trace == "online" or run.revised is None:
            outlines[label] = outlines_of_run(run)
    return boxes, outlines


def _select_repetition(stored: Iterable[StoredRun], repetition: int) -> dict[str, Run]:
    """Return a repetition of each tracker, or the first run of a tracker without it."""
    runs: dict[str, Run] = {}
    for row, run, _ in stored:
        if row["repetition"] == repetition or row["tracker"] not in runs:
            runs[row["tracker"]] = run
    return runs


def _label(tracker: str, run: Run, trace: Trace) -> str:
    return tracker if run.revised is None else f"{tracker}, {TRACE_WORDS[trace]}"
