"""Import of other toolkits' results as runs, in memory or into a results folder.

Boxes are scored with the ground truth of the named sequences. The first boxes of all files of a
tracker together show whether it counts pixels from 0 or from 1; they are then replaced by the
ground truth. Times are not imported, because times of different machines are not comparable.
"""

import hashlib
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.run_record import Run, with_metadata
from trackmark.bench.exchange import FORMATS, detect_format, find_format, require_folder
from trackmark.bench.exchange.first_boxes import (
    FirstBox,
    check_first_boxes,
    find_origin,
    majority,
    shows_init_box,
)
from trackmark.bench.exchange.names import file_name, files_of_sequences, is_same_name
from trackmark.bench.exchange.result_format import (
    ExchangeError,
    ResultFormat,
    ResultRows,
    ResultSequence,
    abbreviated_list,
)
from trackmark.bench.experiments.experiment import SequenceSpec
from trackmark.bench.experiments.tracker_spec import IMPORTED, Identity
from trackmark.bench.protocols import ONE_PASS, parse_protocol
from trackmark.bench.store.database import run_key
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs
from trackmark.bench.store.truth import StoredTruth, stored_truth
from trackmark.datasets.interface import group_remarks


@dataclass(frozen=True)
class ImportedTracker:
    """Tracker whose results are imported."""

    tracker: str  # label in tables
    format: str
    folder: Path


def parse_imported_tracker(argument: str) -> ImportedTracker:
    """Parse `NAME=PATH` or `NAME=FORMAT:PATH`; raise `ExchangeError` for any other text."""
    tracker, equals, path = (part.strip() for part in argument.partition("="))
    if not (tracker and equals and path):
        raise ExchangeError(f"{argument!r}: expected NAME=PATH, a tracker's name and its folder.")
    name, colon, folder = path.partition(":")
    if colon and name in FORMATS:
        require_folder(Path(folder))
        return ImportedTracker(tracker, name, Path(folder))
    return ImportedTracker(tracker, detect_format(Path(path)), Path(path))


def open_sequences(
    sources: Sequence[SequenceSpec], on_message: Callable[[str], None]
) -> list[ResultSequence]:
    """Open the sequences of imported results.

    `on_message` is called with sentences on frames and rows that are not scored. Raises
    `SequenceError` for a sequence that cannot be opened or has no ground truth.
    """
    opened = [datasets.load(source.spec, truth=source.truth) for source in sources]
    for sequence in opened:
        sequence.check_runnable()
    for remark in group_remarks((each.name, each.remarks) for each in opened):
        on_message(remark)
    return [
        _with_paths(
            stored_truth(sequence), source.absolute().spec, str(source.absolute().truth or "")
        )
        for sequence, source in zip(opened, sources, strict=True)
    ]


def _with_paths(ground_truth: StoredTruth, source: str, truth: str) -> ResultSequence:
    return ResultSequence(**vars(ground_truth), source=source, truth=truth)


def read_runs(
    trackers: Sequence[ImportedTracker],
    sequences: Sequence[ResultSequence],
    on_message: Callable[[str], None],
) -> list[Run]:
    """Read results of other toolkits as runs.

    `on_message` is called with a sentence on each assumption and each file that is not imported.
    Raises `ExchangeError` for a sequence without results, and for files that are malformed, too
    short or too long.
    """
    return [
        with_metadata(run)
        for tracker in trackers
        for run in _with_one_protocol(list(_read_tracker(tracker, sequences, on_message)))
    ]


def import_results(
    trackers: Sequence[ImportedTracker],
    sequences: Sequence[ResultSequence],
    folder: Path,
    on_message: Callable[[str], None],
) -> int:
    """Write results as runs, with scores and ground truth, into a folder; return their number.

    Raises as `read_runs`, and `ExchangeError` for a tracker that has runs of its own there.
    """
    runs, stored_runs = read_runs(trackers, sequences, on_message), Runs.unscored(folder)
    replaced = {run_key(row): row["version"] for row in stored_runs.stored_rows}
    versions = {run_key(run.identity): run.identity.version for run in runs}
    for key in versions.keys() & replaced.keys():
        if not stored_runs.run(key).identity.imported:
            raise name_collision(folder, key[0])
    store = RunStore(folder)
    store.add_requests(versions)
    store.add_all([(run, replaced.get(run_key(run.identity), "")) for run in runs], sequences)
    return len(runs)


def with_imported_runs(
    runs: Runs, trackers: Sequence[ImportedTracker], on_message: Callable[[str], None]
) -> Runs:
    """Return stored runs together with imported results on their sequences.

    Raises as `import_results`.
    """
    stored_trackers = {row["tracker"] for row in runs.rows if row["status"] != "missing"}
    if both := stored_trackers & {tracker.tracker for tracker in trackers}:
        raise name_collision(runs.folder, min(both))
    rows = {row["sequence"]: row for row in runs.evaluated_rows()}
    sequences = [
        _with_paths(runs.truths[name, row["fingerprint"]], row["source"], row["truth"])
        for name, row in rows.items()
    ]
    return runs + Runs.in_memory(read_runs(trackers, sequences, on_message), sequences)


def name_collision(folder: Path | None, tracker: str) -> ExchangeError:
    """Return the error for imported results under the name of a tracker that has runs."""
    return ExchangeError(
        f"{folder}: the experiment already has runs of {tracker}. Choose another NAME."
    )


def _with_one_protocol(runs: list[Run]) -> list[Run]:
    """Mark all runs of a tracker as supervised if it was restarted in one of them."""
    if all(run.states is None for run in runs):
        return runs
    return [
        run if run.segments else replace(run, identity=replace(run.identity, protocol="supervised"))
        for run in runs
    ]


_Notes: TypeAlias = defaultdict[str, list[str]]
"""Messages on the files of a tracker by kind; only the first of each kind is shown."""


@dataclass(frozen=True)
class _ResultFile:
    """Content of a result file, whose rows fit the frames of its sequence."""

    sequence: ResultSequence
    repetition: int
    path: Path
    version: Mapping[str, str]
    rows: ResultRows
    segments: list[NDArray[Any]]  # frames of each segment
    first_boxes: dict[int, FirstBox]  # of each segment, by row


def _read_tracker(
    tracker: ImportedTracker, sequences: Sequence[ResultSequence], on_message: Callable[[str], None]
) -> Iterator[Run]:
    """Yield the runs of a tracker on all of the sequences.

    The first pixel is decided once for all files: one file alone can mislead, because trackers
    round their first boxes or store their own first estimates.
    """
    notes: _Notes = defaultdict(list)
    files = list(_read_files(tracker, sequences, notes))
    result_format = find_format(tracker.format)
    by_data_set: dict[int, list[_ResultFile]] = {}
    for file in files:
        by_data_set.setdefault(file.sequence.first_pixel, []).append(file)
    origins = {
        first_pixel: _find_origin(result_format, group, first_pixel, tracker.folder, notes)
        for first_pixel, group in by_data_set.items()
    }
    for file in files:
        boxes = _convert_boxes(result_format, file, origins[file.sequence.first_pixel], notes)
        yield _run(tracker.tracker, file, boxes)
    for messages in notes.values():
        n = len(messages) - 1
        more_files = "1 more file" if n == 1 else f"{n} more files"
        more = f" The same holds for {more_files} in {tracker.folder}." if n else ""
        on_message(messages[0] + more)


def _read_files(
    tracker: ImportedTracker, sequences: Sequence[ResultSequence], notes: _Notes
) -> Iterator[_ResultFile]:
    """Yield the content of all files of a tracker on the sequences."""
    result_format = find_format(tracker.format)
    files = result_format.files(tracker.folder)
    names = files_of_sequences([sequence.name for sequence in sequences], files)
    for sequence in sequences:
        if sequence.name not in names:
            raise _no_results(sequence, sequences, list(files), tracker.folder, result_format)
        name = names[sequence.name]
        if name not in (sequence.name, file_name(sequence.name)):
            notes["spelling"].append(f"{name} is read as the results on {sequence.name}.")
        contents = [
            part.read_bytes() for file in files[name] for part in result_format.run_files(file)
        ]
        digest = hashlib.sha256(b"\0".join(contents)).hexdigest()[:16]
        version = {"source": IMPORTED, "layout": tracker.format, "files": digest}
        for repetition, path in enumerate(files[name]):
            rows = _fit_rows(result_format, result_format.read(path), sequence, path, notes)
            if rows.simplification:
                notes["simplification"].append(f"{path}: {rows.simplification}.")
            segments = _find_segments(result_format, rows, sequence)
            first_boxes = _first_boxes(rows, sequence, segments, path)
            yield _ResultFile(sequence, repetition, path, version, rows, segments, first_boxes)
    if unused := sorted(set(files) - set(names.values())):
        notes["unused"].append(
            f"{tracker.folder}: results on sequences that were not requested are not imported: "
            f"{abbreviated_list(unused)}.",
        )


def _no_results(
    sequence: ResultSequence,
    sequences: Sequence[ResultSequence],
    files: Sequence[str],
    folder: Path,
    result_format: ResultFormat,
) -> ExchangeError:
    """Return the error for a sequence without results, or with several possible files."""
    similar = sorted(name for name in files if is_same_name(sequence.name, name))
    rivals = [
        other.name
        for other in sequences
        if other is not sequence and any(is_same_name(other.name, name) for name in similar)
    ]
    spellings = ", ".join([*similar, *rivals])
    remedy = f" These names differ in spelling only: {spellings}. Rename the files."
    return ExchangeError(
        f"{folder}: no results on {sequence.name}. Expected: {result_format.expects}. Results "
        f"exist on {abbreviated_list(sorted(files))}.{remedy if spellings else ''}"
    )


def _run(tracker: str, file: _ResultFile, boxes: NDArray[np.float64]) -> Run:
    """Return the run of a file with its boxes in pixels from 0."""
    rows, sequence = file.rows, file.sequence
    protocol = _stored_protocol(rows, file.segments, sequence)
    key = (sequence.name, sequence.fingerprint)
    run = Run(
        Identity(tracker, tracker, "", {}, file.version, *key, file.repetition, protocol),
        boxes,
        np.asarray(np.isfinite(boxes).all(axis=1)),
        np.full(len(boxes), np.nan) if rows.confidence is None else rows.confidence,
        states=rows.states,
        segments=tuple(file.segments) if rows.protocol else (),
        metadata={
            "source": sequence.source,
            "truth": sequence.truth,
            "file": str(file.path.resolve()),
            **({"unscored_frames": rows.n_unscored} if rows.n_unscored else {}),
        },
    )
    return _with_whole_segments(run, sequence)


def _fit_rows(
    result_format: ResultFormat,
    rows: ResultRows,
    sequence: ResultSequence,
    file: Path,
    notes: _Notes,
) -> ResultRows:
    """Return one row per frame of a one-pass run, as the toolkits that read the format do.

    They cut additional rows. A row that is missing at the end is a miss or is not scored.
    """
    n, m = len(rows.boxes), len(sequence.boxes)
    if rows.protocol or n == m:
        return rows
    problem = f"{file}: {n} rows for the {m} frames of {sequence.name}"
    row = result_format.row
    if not (result_format.missing_row and n >= m - 1):
        reason = f"ends after {row} {n}" if n < m else f"{row} {m + 1} is too many"
        raise ExchangeError(f"{problem}: {reason}.")
    first = int(_present(sequence).argmax())
    start = FirstBox(str(file), sequence.boxes[first], rows.boxes[min(first, n - 1)])
    if not shows_init_box(start, result_format.round_boxes):
        raise ExchangeError(
            f"{problem}, and {row} {first + 1} is not the box at initialisation: the other rows "
            "can belong to other frames. Expected: one row per frame. Supply all rows."
        )
    if n < m:
        notes["short"].append(
            f"{problem}: {row} {m} is missing; as in the toolkits, it is "
            f"{result_format.missing_row}.",
        )
    else:
        notes["long"].append(f"{problem}: the rows after {row} {m} are not used.")
    confidence = rows.confidence
    return replace(
        rows,
        n_unscored=int(n < m and result_format.missing_row == "not scored"),
        boxes=np.vstack([rows.boxes, np.full((1, 4), np.nan)])[:m],
        confidence=None if confidence is None else np.append(confidence, np.nan)[:m],
        headers=tuple(replace(header, n_rows=m, end=None) for header in rows.headers),
    )


def _find_segments(
    result_format: ResultFormat, rows: ResultRows, sequence: ResultSequence
) -> list[NDArray[Any]]:
    """Return the frames of each segment of a file; a one-pass run has one segment."""
    m = len(sequence.boxes)
    if not rows.headers:
        return [np.arange(m)]
    segments = result_format.segments(rows.headers, sequence)
    present = _present(sequence)
    for header, frames in zip(rows.headers, segments, strict=False):
        if rows.protocol == "sre" and present[: frames[0]].any():
            raise ExchangeError(
                f"{header.location}: {header.n_rows} rows. Expected: {m}, the frames of "
                f"{sequence.name}, as in every segment of SRE. Supply all rows."
            )
        if not present[frames].any():
            raise ExchangeError(
                f"{header.location}: the ground truth of {sequence.name} has no target from frame "
                f"{frames[0]} on. Expected: a segment with a target. Remove this segment."
            )
    return segments


def _first_boxes(
    rows: ResultRows, sequence: ResultSequence, segments: Sequence[NDArray[Any]], file: Path
) -> dict[int, FirstBox]:
    """Return the first box with a target in each segment, by row."""
    present = _present(sequence)
    is_perturbed = rows.protocol == "sre"
    perturbed = parse_protocol("sre").segments(present, {}) if is_perturbed else []
    first_boxes, start = {}, 0
    for index, frames in enumerate(segments):
        first = int(present[frames].argmax())
        expected = sequence.boxes[frames[first]]
        expected = perturbed[index].perturbed_box(expected) if is_perturbed else expected
        location = rows.headers[index].location if rows.headers else str(file)
        row = start + first
        first_boxes[row] = FirstBox(location, expected, rows.boxes[row])
        start += len(frames)
    return first_boxes


def _find_origin(
    result_format: ResultFormat,
    files: Sequence[_ResultFile],
    first_pixel: int,
    folder: Path,
    notes: _Notes,
) -> int:
    """Return the number of the first pixel in the files of a tracker on one data set.

    This is the number that most files show. If there is no majority, it is that of the data set.
    """
    votes = [find_origin(file.first_boxes.values(), result_format.round_boxes) for file in files]
    decided = majority(votes)
    origin = first_pixel if decided is None else decided
    n = len(files)
    if decided not in (None, first_pixel):
        notes["origin"].append(
            f"{folder}: pixels are counted from {origin}, as the first boxes of "
            f"{votes.count(origin)} of {n} files show. The files of the data set count from "
            f"{first_pixel}.",
        )
    other_files = [file for file, vote in zip(files, votes, strict=True) if vote == 1 - origin]
    if other_files:
        notes["other origin"].append(
            f"{other_files[0].path}: the first box shows pixels from {1 - origin} "
            f"({len(other_files)} of {n} files). All files of the tracker are read from {origin}.",
        )
    has_boxes = any(
        np.isfinite(box.from_file).all() for file in files for box in file.first_boxes.values()
    )
    if decided is None and not other_files and has_boxes:
        notes["origin"].append(
            f"{folder}: the first boxes do not show whether pixels are counted from 0 or from 1. "
            f"Assumed: from {origin}, as in the files of the data set.",
        )
    return origin


def _convert_boxes(
    result_format: ResultFormat, file: _ResultFile, origin: int, notes: _Notes
) -> NDArray[np.float64]:
    """Return boxes with pixels counted from 0; each segment starts with its init box."""
    rows = file.rows
    message = check_first_boxes(
        file.first_boxes, rows.boxes, result_format.round_boxes, file.sequence.image_size
    )
    if message:
        notes["first box"].append(message)
    boxes = rows.boxes - [origin, origin, 0, 0]
    starts = np.cumsum([0, *map(len, file.segments)])
    for start, (row, box) in zip(starts, file.first_boxes.items(), strict=False):
        boxes[start:row] = np.nan
        # Perturbed init boxes of a toolkit can be rounded: use the boxes that the tracker received.
        if rows.protocol != "sre" or not np.isfinite(boxes[row]).all():
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
        return rows.protocol or ONE_PASS
    present = _present(sequence)
    starts = [int(present.argmax()) if frames[0] == 0 else int(frames[0]) for frames in segments]
    for protocol in ("tre", f"tre:starts={len(segments)}"):
        expected = parse_protocol(protocol).segments(present, {})
        if [segment.start or int(present.argmax()) for segment in expected] == starts:
            return protocol
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
