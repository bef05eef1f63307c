"""Export of stored runs for other toolkits: one folder per tracker, in one result format."""

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from math import nan
from pathlib import Path

import numpy as np

from trackmark.bench.evaluation.run_record import Run, Trajectory
from trackmark.bench.exchange import FORMATS, find_format
from trackmark.bench.exchange.names import file_name
from trackmark.bench.exchange.result_format import ExchangeError, ResultRows, SegmentRows
from trackmark.bench.output_files import write_file
from trackmark.bench.protocols import ONE_PASS, parse_protocol
from trackmark.bench.store.runs import Runs


def export_results(
    experiment: Path,
    format_name: str,
    target: Path,
    on_message: Callable[[str], None],
    *,
    tracker: str = "*",
    sequence: str = "*",
    origin: int | None = None,
    force: bool = False,
    trajectory: Trajectory = "online",
    protocol: str = ONE_PASS,
) -> list[Path]:
    """Write the finished runs of an experiment in a result format, and return the files.

    `target`: folder for one subfolder per tracker. `on_message`: called with sentences on the
    content of the format and on omitted runs. `tracker`, `sequence`: patterns. `origin`: number of
    the first pixel, by default that of each data set. `force`: replace existing files; by default
    nothing is written if a file exists.

    Raises `ExchangeError` or `ProtocolError` if no run matches, two runs would share a file, a file
    exists, the format cannot represent the runs or the protocol is unknown. Raises `ResultsError`
    or `OSError` if a file cannot be read or written.
    """
    result_format, runs = find_format(format_name), Runs.open(experiment)
    rows = [
        row
        for row in runs.rows
        if row["protocol"] == parse_protocol(protocol).key
        and fnmatchcase(row["tracker"], tracker)
        and fnmatchcase(row["sequence"], sequence)
    ]
    finished = [row for row in rows if row["status"] == "finished"]
    repeats = result_format.has_repetitions and not result_format.can_write_segments(protocol)
    exported = [row for row in finished if repeats or not row["repetition"]]
    if not exported:
        raise ExchangeError(f"{experiment}: no finished run by {protocol} matches.")
    file_texts: dict[Path, str] = {}
    first_pixels = set()
    for row, run, truth in runs.read(exported):
        first_pixel = truth.first_pixel if origin is None else origin
        first_pixels.add(first_pixel)
        folder = target / file_name(row["tracker"])
        files = _run_texts(run, _run_rows(run, first_pixel, trajectory), format_name, folder)
        if both := file_texts.keys() & files.keys():
            raise ExchangeError(
                f"{min(both)}: two runs would be written to this file. Export them to two folders."
            )
        file_texts |= files
    existing = [path for path in file_texts if os.path.lexists(path)]
    if existing and not force:
        raise ExchangeError(
            f"{existing[0]}: the file exists ({len(existing)} of {len(file_texts)} files do). "
            "Choose another folder, or replace the files with --force."
        )
    for path, file_text in file_texts.items():
        write_file(path, file_text)
    origins = " and ".join(map(str, sorted(first_pixels)))
    on_message(
        f"{format_name} contains {result_format.exports}; pixels are counted from {origins}."
    )
    for row in [row for row in rows if row["status"] == "stale"]:
        on_message(
            f"{row['tracker']} on {row['sequence']}, repetition {row['repetition']}: not exported, "
            "because the run is of another version of the tracker or the sequence. Run it again."
        )
    if failed := sum(row["status"] == "failed" for row in rows):
        on_message(f"{failed} failed runs are not exported.")
    if omitted := len(finished) - len(exported):
        on_message(f"{omitted} runs are not exported: {format_name} stores one repetition only.")
    return list(file_texts)


def _run_texts(run: Run, rows: ResultRows, format_name: str, folder: Path) -> Mapping[Path, str]:
    """Return the texts of a run; raise `ExchangeError` if the format cannot represent it."""
    result_format, key = find_format(format_name), run.identity
    if not run.segments:
        return result_format.write(folder, key.sequence, key.repetition, rows)
    if not result_format.can_write_segments(key.protocol):
        expected = "; ".join(
            f"{name} ({candidate.segment_protocols})"
            for name, candidate in FORMATS.items()
            if candidate.segment_protocols
        )
        raise ExchangeError(
            f"{format_name}: the format cannot represent runs with the protocol {key.protocol!r}. "
            f"Expected: {expected}."
        )
    segments = _split_segments(run, rows)
    return result_format.write_segments(folder, key.sequence, key.protocol, segments)


def _run_rows(run: Run, origin: int, trajectory: Trajectory) -> ResultRows:
    """Return the estimates of a run with pixels counted from `origin`."""
    return ResultRows(
        run.boxes_in(trajectory) + [origin, origin, 0, 0],
        run.confidence if np.isfinite(run.confidence).any() else None,
        run.states,
        run.metadata.get("ms_per_frame", nan) / 1e3,
    )


def _split_segments(run: Run, rows: ResultRows) -> SegmentRows:
    """Split the rows of a run by segments."""
    segments, end = [], 0
    for frames in run.segments:
        start, end = end, end + len(frames)
        confidence = None if rows.confidence is None else rows.confidence[start:end]
        segment = replace(rows, boxes=rows.boxes[start:end], confidence=confidence)
        segments.append((frames, segment))
    return segments
