"""Film strips of stored results, and the boxes of all trackers on a sequence."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.analysis.outlines import Outlines, outlines_of_run
from trackmark.bench.evaluation.run_record import Run, Trajectory
from trackmark.bench.output_files import file_names, write_file
from trackmark.bench.protocols import ONE_PASS
from trackmark.bench.store.runs import Runs, RunWithTruth, reopen_sequence
from trackmark.reports.overlay import TRUTH, evenly_spaced, film_strip, save_png
from trackmark.reports.palette import colours

N_STRIP_FRAMES = 10

MAX_STRIPS = 100
"""Maximum number of film strips of a report; each has about a megabyte."""

_MAX_PENDING = 4  # film strips in memory

TRAJECTORY_LABELS: Mapping[Trajectory, str] = {"online": "online boxes", "revised": "revised boxes"}
"""Labels in pictures for the boxes of trackers that revise boxes later."""


def write_strips(
    runs: Runs, folder: Path, on_message: Callable[[str], None], trackers: Sequence[str]
) -> list[Path]:
    """Draw a film strip of each sequence with the boxes of trackers; return the files.

    If there are more than `MAX_STRIPS` sequences, the first ones in alphabetical order are drawn.
    Trackers are coloured in the order of `trackers`. `on_message` gets a message on each sequence
    that cannot be drawn.
    """
    rows: dict[str, list[Mapping[str, Any]]] = {}
    for row in runs.evaluated_rows():
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
            try:
                sequence = reopen_sequence(rows[name][-1])
            except datasets.SequenceError as error:
                on_message(f"no film strip: {error}")
                continue
            strip = _draw_strip(runs, rows[name], sequence, shades)
            path = folder / f"strip-{files[name]}.png"
            written.append(executor.submit(write_file, path, partial(save_png, image=strip)))
            if len(written) > _MAX_PENDING:  # limits the memory
                paths.append(written.popleft().result())
        return paths + [future.result() for future in written]


def _draw_strip(
    runs: Runs,
    rows: Iterable[Mapping[str, Any]],
    sequence: datasets.Sequence,
    shades: Mapping[str, str],
) -> NDArray[np.uint8]:
    """Return the film strip of a sequence with the one-pass runs among `rows`."""
    one_pass = [row for row in rows if row["protocol"] == ONE_PASS]
    one_pass_runs = list(runs.read(one_pass))
    boxes, named = {TRUTH: one_pass_runs[0].truth.boxes} if one_pass_runs else {}, {}
    for tracker, run in _select_repetition(one_pass_runs, 0).items():
        label = _label(tracker, run, "online")
        boxes[label], named[label] = run.boxes, shades[tracker]
    frames = evenly_spaced(sequence.first_frame, len(sequence) - 1, N_STRIP_FRAMES)
    return film_strip(sequence.__getitem__, frames, boxes, sequence.name, shades=named)


def boxes_on(
    experiments: Iterable[Runs],
    sequence: str,
    repetition: int = 0,
    trajectory: Trajectory = "online",
) -> tuple[dict[str, NDArray[np.float64]], dict[str, Outlines]]:
    """Return boxes, with the ground truth first, and outlines on a sequence by label.

    A label is the name of a tracker. If the tracker revised boxes, it ends with the trajectory,
    online or revised. Outlines exist for online estimates only. Failed runs are included up to
    their failure.
    """
    runs_of_sequence = [
        run
        for runs in experiments
        for run in runs.read(runs.evaluated_rows(protocol=ONE_PASS, sequence=sequence))
    ]
    boxes = {TRUTH: runs_of_sequence[0].truth.boxes} if runs_of_sequence else {}
    outlines = dict[str, Outlines]()
    for tracker, run in _select_repetition(runs_of_sequence, repetition).items():
        label = _label(tracker, run, trajectory)
        boxes[label] = run.boxes_in(trajectory)
        if trajectory == "online" or run.revised is None:
            outlines[label] = outlines_of_run(run)
    return boxes, outlines


def _select_repetition(runs: Iterable[RunWithTruth], repetition: int) -> dict[str, Run]:
    """Return a repetition of each tracker, or the first run of a tracker without it."""
    selected: dict[str, Run] = {}
    for row, run, _ in runs:
        if row["repetition"] == repetition or row["tracker"] not in selected:
            selected[row["tracker"]] = run
    return selected


def _label(tracker: str, run: Run, trajectory: Trajectory) -> str:
    return tracker if run.revised is None else f"{tracker}, {TRAJECTORY_LABELS[trajectory]}"
