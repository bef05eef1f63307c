"""Export of stored runs for other toolkits: one folder per tracker, in one result format."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.exchange import format_names, load_format
from trackmark.bench.exchange.names import file_name
from trackmark.bench.exchange.result_format import ExchangeError, ResultRows
from trackmark.bench.protocols import ONE_PASS, parse_protocol
from trackmark.bench.store.data_frames import ordered_rows
from trackmark.bench.store.layout import run_key
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth
from trackmark.reports.files import write_file


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
    trace: Trace = "online",
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
    result_format, results = load_format(format_name), Results(experiment)
    rows = [
        row
        for row in ordered_rows(results)
        if row["protocol"] == parse_protocol(protocol).text
        and fnmatchcase(row["tracker"], tracker)
        and fnmatchcase(row["sequence"], sequence)
    ]
    finished = [row for row in rows if row["status"] == "finished"]
    repeats = result_format.has_repetitions and result_format.segment_writer(protocol) is None
    exported = [row for row in finished if repeats or not row["repetition"]]
    if not exported:
        raise ExchangeError(f"{experiment}: no finished run by {protocol} matches.")
    texts: dict[Path, str] = {}
    origins = _first_pixels(experiment, exported, origin)
    for row in exported:
        run = results.read(run_key(row))
        origin = origins[row["sequence"], row["fingerprint"]]
        folder = target / file_name(row["tracker"])
        files = _run_texts(run, _run_rows(run, origin, trace), format_name, folder)
        if both := texts.keys() & files.keys():
            raise ExchangeError(
                f"{min(both)}: two runs would be written to this file. Export them to two folders."
            )
        texts |= files
    _write(texts, force=force)
    numbers = " and ".join(map(str, sorted(set(origins.values()))))
    on_message(
        f"{format_name} contains {result_format.exports}; pixels are counted from {numbers}."
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
    return list(texts)


def _first_pixels(
    experiment: Path, rows: Sequence[Mapping[str, Any]], origin: int | None
) -> dict[tuple[str, str], int]:
    """Return the first pixel's number by sequence and fingerprint: `origin`, or as in its data.

    Raises `ExchangeError` if an older version stored the ground truth without this number.
    """
    origins = {}
    for key in {(row["sequence"], row["fingerprint"]) for row in rows}:
        number = read_truth(experiment, *key).first_pixel if origin is None else origin
        if number is None:
            raise ExchangeError(
                f"{experiment}: an older version of trackmark stored the ground truth of {key[0]}, "
                "without the number of the first pixel in its data set. Give it with --from."
            )
        origins[key] = number
    return origins


def _write(texts: Mapping[Path, str], *, force: bool) -> None:
    """Write texts by path; raise `ExchangeError` if a file exists, unless `force`."""
    existing = [path for path in texts if os.path.lexists(path)]
    if existing and not force:
        raise ExchangeError(
            f"{existing[0]}: the file exists ({len(existing)} of {len(texts)} files do). Choose "
            "another folder, or replace the files with --force."
        )
    for path, text in texts.items():
        write_file(path, partial(Path.write_text, data=text, encoding="utf-8"))


def _run_texts(run: Run, rows: ResultRows, format_name: str, folder: Path) -> Mapping[Path, str]:
    """Return the texts of a run; raise `ExchangeError` if the format cannot represent it."""
    result_format, key = load_format(format_name), run.identity
    if not run.segments:
        return result_format.write(folder, key.sequence, key.repetition, rows)
    write_segments = result_format.segment_writer(key.protocol)
    if write_segments is None:
        protocols = [(name, load_format(name).segment_protocols) for name in format_names()]
        expected = "; ".join(f"{name} ({texts})" for name, texts in protocols if texts)
        raise ExchangeError(
            f"{format_name}: the format cannot represent runs with the protocol {key.protocol!r}. "
            f"Expected: {expected}."
        )
    return write_segments(folder, key.sequence, _split_segments(run, rows))


def _run_rows(run: Run, origin: int, trace: Trace) -> ResultRows:
    """Return the estimates of a run with pixels counted from `origin`."""
    return ResultRows(
        run.boxes_in(trace) + [origin, origin, 0, 0],
        run.confidence if np.isfinite(run.confidence).any() else None,
        run.states,
        run.circumstances.get("ms_per_frame", nan) / 1e3,
    )


def _split_segments(run: Run, rows: ResultRows) -> list[tuple[NDArray[Any], ResultRows]]:
    """Split the rows of a run by segments."""
    segments, end = [], 0
    for frames in run.segments:
        part = slice(end, end + len(frames))
        confidence = None if rows.confidence is None else rows.confidence[part]
        segments.append((frames, replace(rows, boxes=rows.boxes[part], confidence=confidence)))
        end = part.stop
    return segments
