"""Import of other toolkits' results as runs, into a new folder or a copy of an experiment.

Boxes are scored with the ground truth of the named sequences. The first box shows whether a file
counts pixels from 0 or from 1; it is then replaced by the ground truth. Times are not imported,
because times of different machines are not comparable.
"""

import hashlib
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.exchange import detect_format, format_names, load_format, require_folder
from trackmark.bench.exchange.first_boxes import FirstBox, check_first_boxes, find_origin
from trackmark.bench.exchange.result_format import (
    ExchangeError,
    ResultFormat,
    ResultRows,
    ResultSequence,
    abbreviated_list,
    normalized_name,
)
from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.experiments.tracker_spec import IMPORTED, Identity
from trackmark.bench.protocols import STORED_ONE_PASS, parse_protocol
from trackmark.bench.store.database import open_database
from trackmark.bench.store.layout import RunKey, run_key
from trackmark.bench.store.manifest import Manifest
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import list_runs
from trackmark.bench.store.truth import read_truth, write_truth
from trackmark.reports.temporary_paths import temporary_folder


@dataclass(frozen=True)
class ImportedTracker:
    """Tracker whose results are imported."""

    tracker: str  # label in tables
    format: str
    folder: Path


def parse_imported_tracker(text: str) -> ImportedTracker:
    """Parse `NAME=PATH` or `NAME=FORMAT:PATH`; raise `ExchangeError` for any other text."""
    tracker, equals, path = (part.strip() for part in text.partition("="))
    if not (tracker and equals and path):
        raise ExchangeError(f"{text!r}: expected NAME=PATH, a tracker's name and its folder.")
    name, colon, folder = path.partition(":")
    if colon and name in format_names():
        require_folder(Path(folder))
        return ImportedTracker(tracker, name, Path(folder))
    return ImportedTracker(tracker, detect_format(Path(path)), Path(path))


def open_sequences(sources: Sequence[SequenceSource], folder: Path) -> list[ResultSequence]:
    """Open sequences and write their ground truth into the folder of an experiment.

    Raises `SequenceError` for a sequence that cannot be opened or has no ground truth.
    """
    opened = []
    for source in sources:
        sequence = datasets.load(source.text, truth=source.truth)
        sequence.check_runnable()
        write_truth(folder, sequence)
        absolute = source.absolute()
        fields = sequence.name, sequence.fingerprint, sequence.boxes
        opened.append(ResultSequence(*fields, absolute.text, str(absolute.truth or "")))
    return opened


def import_results(
    trackers: Sequence[ImportedTracker],
    sequences: Sequence[ResultSequence],
    folder: Path,
    on_message: Callable[[str], None],
) -> int:
    """Write results as runs into a folder that contains the ground truth; return their number.

    `on_message`: called with a sentence on each assumption and each file that is not imported.
    Raises `ExchangeError` for a sequence without results, and for files that are malformed, too
    short or too long.
    """
    results = Results(folder)
    runs = [
        run
        for tracker in trackers
        for run in _with_one_protocol(list(_read_runs(tracker, sequences, on_message)))
    ]
    versions: dict[RunKey, str] = {run_key(run.identity): run.identity.version for run in runs}
    results.prepare(Manifest("", versions))
    stored_cells = set(results.list_keys())
    for run in runs:
        cell = run_key(run.identity)
        stored = results.read(cell).identity if cell in stored_cells else None
        if stored is not None and not stored.imported:
            raise _name_collision(folder, stored.tracker)
        results.write(run, stored.version if stored else "")
    return len(runs)


def _name_collision(folder: Path, tracker: str) -> ExchangeError:
    return ExchangeError(
        f"{folder}: the experiment already has runs of {tracker}. Choose another NAME."
    )


@contextmanager
def copy_with_imports(
    experiment: Path,
    trackers: Sequence[ImportedTracker],
    on_message: Callable[[str], None],
    sequences: Collection[str] | None = None,
) -> Iterator[Path]:
    """Provide a temporary copy of an experiment's folder, extended by imported results.

    `sequences`: sequences of the experiment for which results are imported; all by default.
    Raises as `import_results`.
    """
    stored = list_runs(Results(experiment))
    if both := {row["tracker"] for row in stored} & {tracker.tracker for tracker in trackers}:
        raise _name_collision(experiment, min(both))
    rows = {row["sequence"]: row for row in stored}.values()
    with temporary_folder() as temporary:
        folder = temporary / experiment.resolve().name
        folder.mkdir()
        with open_database(experiment) as database:
            database.copy(folder)
        selected = []
        for row in rows:
            if sequences is None or row["sequence"] in sequences:
                key = row["sequence"], row["fingerprint"]
                boxes = read_truth(experiment, *key).boxes
                selected.append(ResultSequence(*key, boxes, row["source"], row["truth"]))
        import_results(trackers, selected, folder, on_message)
        yield folder


def _with_one_protocol(runs: list[Run]) -> list[Run]:
    """Mark all runs of a tracker as supervised if it was restarted in one of them."""
    if all(run.states is None for run in runs):
        return runs
    return [
        run if run.segments else replace(run, identity=replace(run.identity, protocol="supervised"))
        for run in runs
    ]


def _read_runs(
    tracker: ImportedTracker, sequences: Sequence[ResultSequence], on_message: Callable[[str], None]
) -> Iterator[Run]:
    """Yield the runs of a tracker on all of the sequences."""
    result_format = load_format(tracker.format)
    files = result_format.files(tracker.folder)
    names: dict[str, list[str]] = {}
    for name in files:
        names.setdefault(normalized_name(name), []).append(name)
    used = set()
    for sequence in sequences:
        matches = names.get(normalized_name(sequence.name), [])
        if sequence.name not in files and len(matches) != 1:
            raise ExchangeError(
                f"{tracker.folder}: no results on {sequence.name}. Expected: "
                f"{result_format.expects}. Results exist on {abbreviated_list(sorted(files))}."
            )
        name = sequence.name if sequence.name in files else matches[0]
        used.add(name)
        yield from _read_runs_on(tracker, result_format, sequence, files[name], on_message)
    if unused := sorted(set(files) - used):
        on_message(
            f"{tracker.folder}: results on sequences that were not requested are not imported: "
            f"{abbreviated_list(unused)}."
        )


def _read_runs_on(
    tracker: ImportedTracker,
    result_format: ResultFormat,
    sequence: ResultSequence,
    files: Sequence[Path],
    on_message: Callable[[str], None],
) -> Iterator[Run]:
    """Yield the runs of a tracker on a sequence, one per file."""
    contents = [part.read_bytes() for file in files for part in result_format.parts(file)]
    digest = hashlib.sha256(b"\0".join(contents)).hexdigest()[:16]
    version = {"source": IMPORTED, "layout": tracker.format, "files": digest}
    for repetition, file in enumerate(files):
        rows = result_format.read(file)
        segments = _find_segments(result_format, rows, sequence, file)
        boxes = _convert_boxes(result_format, rows, sequence, segments, file, on_message)
        if rows.simplification:
            on_message(f"{file}: {rows.simplification}.")
        protocol = _stored_protocol(rows, segments, sequence)
        name, key = tracker.tracker, (sequence.name, sequence.fingerprint)
        identity = Identity(name, name, "", {}, version, *key, repetition, protocol)
        run = Run(
            identity,
            boxes,
            np.asarray(np.isfinite(boxes).all(axis=1)),
            np.full(len(boxes), np.nan) if rows.confidence is None else rows.confidence,
            states=rows.states,
            segments=tuple(segments) if rows.protocol else (),
            circumstances={
                "source": sequence.source,
                "truth": sequence.truth,
                "file": str(file.resolve()),
            },
        )
        yield _with_whole_segments(run, sequence)


def _find_segments(
    result_format: ResultFormat, rows: ResultRows, sequence: ResultSequence, file: Path
) -> list[NDArray[Any]]:
    """Return the frames of each segment of a file; a one-pass run has one segment."""
    n, m = len(rows.boxes), len(sequence.boxes)
    if not rows.protocol and n != m:
        row = result_format.row
        reason = f"ends after {row} {n}" if n < m else f"{row} {m + 1} is too many"
        raise ExchangeError(f"{file}: {n} rows for the {m} frames of {sequence.name}: {reason}.")
    segments = [np.arange(m)]
    if rows.headers and result_format.frames:
        segments = result_format.frames(rows.headers, sequence)
    present = _present(sequence)
    for header, frames in zip(rows.headers, segments, strict=False):
        if rows.protocol == "sre" and present[: frames[0]].any():
            raise ExchangeError(
                f"{header.place}: {header.n_rows} rows. Expected: {m}, the frames of "
                f"{sequence.name}, as in every segment of SRE. Supply all rows."
            )
        if not present[frames].any():
            raise ExchangeError(
                f"{header.place}: the ground truth of {sequence.name} has no target from frame "
                f"{frames[0]} on. Expected: a segment with a target. Remove this segment."
            )
    return segments


def _convert_boxes(
    result_format: ResultFormat,
    rows: ResultRows,
    sequence: ResultSequence,
    segments: Sequence[NDArray[Any]],
    file: Path,
    on_message: Callable[[str], None],
) -> NDArray[np.float64]:
    """Return boxes with pixels counted from 0; each segment starts with its init box."""
    boxes, present = rows.boxes.copy(), _present(sequence)
    is_perturbed = rows.protocol == "sre"
    perturbed = parse_protocol("sre").segments(present, {}) if is_perturbed else []
    init_rows, first_boxes, end = [], [], 0
    for index, frames in enumerate(segments):
        first = int(present[frames].argmax())
        row, start, end = end + first, end, end + len(frames)
        expected = sequence.boxes[frames[first]]
        expected = perturbed[index].perturbed_box(expected) if is_perturbed else expected
        place = rows.headers[index].place if rows.headers else str(file)
        first_boxes.append(FirstBox(place, expected, rows.boxes[row]))
        boxes[start:row] = np.nan
        init_rows.append(row)
    message = check_first_boxes(first_boxes, rows.boxes, result_format.rounding)
    origin = find_origin(first_boxes, result_format.rounding)
    if origin is None and any(np.isfinite(box.stored).all() for box in first_boxes):
        message += message and " "
        message += (
            f"{file}: the first box does not show whether pixels are counted from 0 or "
            f"from 1. Assumed: they are counted from {result_format.origin}."
        )
    if message:
        on_message(message)
    boxes[:, :2] -= result_format.origin if origin is None else origin
    for row, box in zip(init_rows, first_boxes, strict=True):
        # Perturbed init boxes of a toolkit can be rounded: use the boxes that the tracker received.
        if not is_perturbed or not np.isfinite(boxes[row]).all():
            boxes[row] = box.expected
    return boxes


def _present(sequence: ResultSequence) -> NDArray[np.bool_]:
    """Return for each frame whether the target is present."""
    return np.asarray(np.isfinite(sequence.boxes).all(axis=1))


def _stored_protocol(
    rows: ResultRows, segments: Sequence[NDArray[Any]], sequence: ResultSequence
) -> str:
    """Return the protocol of a run; `tre` without options if the start frames differ from ours."""
    if rows.protocol != "tre":
        return rows.protocol or STORED_ONE_PASS
    present = _present(sequence)
    starts = [int(present.argmax()) if frames[0] == 0 else int(frames[0]) for frames in segments]
    for text in ("tre", f"tre:starts={len(segments)}"):
        expected = parse_protocol(text).segments(present, {})
        if [segment.start or int(present.argmax()) for segment in expected] == starts:
            return text
    return "tre"


def _with_whole_segments(run: Run, sequence: ResultSequence) -> Run:
    """Extend some segments to all frames of the sequence, as in stored runs.

    These are the segments that start at the first frame with a target and end at the last frame.
    """
    first = int(_present(sequence).argmax())
    n = len(sequence.boxes)
    segments, inserted, row = [], [], 0
    for frames in run.segments:
        is_whole = first > 0 and frames[0] == first and len(frames) == n - first
        segments.append(np.arange(n) if is_whole else frames)
        inserted += [row] * (first if is_whole else 0)
        row += len(frames)
    if not inserted:
        return run
    return replace(
        run,
        boxes=np.insert(run.boxes, inserted, np.nan, axis=0),
        visible=np.insert(run.visible, inserted, values=False),
        confidence=np.insert(run.confidence, inserted, np.nan),
        segments=tuple(segments),
    )
