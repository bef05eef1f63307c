"""Export of stored runs for other toolkits: a folder a tracker, in a layout."""

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.evaluation.run_record import Run, Trace
from trackmark.bench.exchange import is_layout_of, layout, names
from trackmark.bench.exchange.result_format import ExchangeError, Said, file_name, some
from trackmark.bench.protocols import ONE_PASS, TIMING, parse_protocol
from trackmark.bench.store.index import read_index
from trackmark.bench.store.layout import cell_of
from trackmark.bench.store.results import Results
from trackmark.reports.files import write_file


def export_results(
    experiment: Path,
    kind: str,
    target: Path,
    tell: Callable[[str], None],
    *,
    tracker: str = "*",
    sequence: str = "*",
    origin: int | None = None,
    force: bool = False,
    trace: Trace = "online",
    protocol: str = ONE_PASS,
) -> list[Path]:
    """Write the finished runs of an experiment in a layout, and return the files.

    `target` gets a folder per tracker. `tell`: called with sentences on the content of the layout
    and on omitted runs. `kind`: name of the layout. `tracker`, `sequence`: patterns. `origin`:
    number of the first pixel, if it is not the layout's. `force`: replace existing files; otherwise
    nothing is written if there is one.

    Raises `ExchangeError` or `ProtocolError` if nothing matches, two runs would be one file, a file
    exists, the layout has no room for the runs, or the protocol is unknown; `ResultsError` or
    `OSError` if a file cannot be read or written.
    """
    form, results = layout(kind), Results(experiment)
    start = form.origin if origin is None else origin
    rows = [
        row
        for row in read_index(results)
        if row["protocol"] == parse_protocol(protocol).text
        and fnmatchcase(row["tracker"], tracker)
        and fnmatchcase(row["sequence"], sequence)
    ]
    finished = [row for row in rows if row["status"] == "finished"]
    repeats = form.repeats and form.segments(protocol) is None
    exported = [row for row in finished if repeats or not row["repetition"]]
    if not exported:
        raise ExchangeError(f"{experiment}: no finished run by {protocol} matches.")
    texts: dict[Path, str] = {}
    for row in exported:
        run = results.read(cell_of(row))
        content = _content_of(run, results, start, trace)
        folder = target / file_name(row["tracker"])
        _check_layout(folder, kind)
        files = _files_of(run, content, kind, folder)
        if both := texts.keys() & files.keys():
            raise ExchangeError(f"{min(both)} would hold two runs: export them into two folders.")
        texts |= files
    _write(texts, force=force)
    tell(f"{kind} keeps {form.holds}; pixels count from {start}.")
    if failed := len(rows) - len(finished):
        tell(f"{failed} runs failed and are left out.")
    if further := len(finished) - len(exported):
        tell(f"{further} runs are left out: {kind} has room for one repetition.")
    written = {(row["tracker"], row["sequence"]) for row in exported}
    if missing := sorted({(row["tracker"], row["sequence"]) for row in rows} - written):
        pairs = some([f"{name} on {on}" for name, on in missing])
        runs = "all its runs" if repeats else "its first repetition"
        tell(f"nothing is written for {pairs}: {runs} failed.")
    return list(texts)


def _check_layout(folder: Path, kind: str) -> None:
    """Refuse a tracker's folder with results of another layout: readers would mix the two."""
    if folder.is_dir() and layout(kind).fits:  # files of other layouts cannot be told apart
        for name in names():
            if name != kind and is_layout_of(name, folder):
                raise ExchangeError(
                    f"{folder}: the folder holds results in the layout {name!r}. Readers would mix "
                    f"them with those in the layout {kind!r}. Choose another folder."
                )


def _write(texts: Mapping[Path, str], *, force: bool) -> None:
    """Write texts by path; without `force` write nothing if one of the files exists."""
    existing = [path for path in texts if os.path.lexists(path)]
    if existing and not force:
        raise ExchangeError(
            f"{existing[0]}: the file exists ({len(existing)} of {len(texts)} files do). Choose "
            "another folder, or replace the files with --force."
        )
    for path, text in texts.items():
        write_file(path, partial(Path.write_text, data=text, encoding="utf-8"))


def _files_of(run: Run, content: Said, kind: str, folder: Path) -> Mapping[Path, str]:
    """Return the texts of a run in a layout; raise `ExchangeError` if it has no room for them."""
    form, key = layout(kind), run.identity
    if not run.segments:
        return form.write(folder, key.sequence, key.repetition, content)
    write_segments = form.segments(key.protocol)
    if write_segments is None:
        others = [(name, layout(name).holds_segments) for name in names()]
        rooms = "; ".join(f"{name} ({protocols})" for name, protocols in others if protocols)
        raise ExchangeError(f"{kind} has no room for runs by {key.protocol!r}. Expected: {rooms}.")
    return write_segments(folder, key.sequence, _segments(run, content))


def _content_of(run: Run, results: Results, origin: int, trace: Trace) -> Said:
    """Return a run in a layout's numbers."""
    return Said(
        run.boxes_in(trace) + [origin, origin, 0, 0],
        run.confidence if np.isfinite(run.confidence).any() else None,
        run.states,
        None if run.segments else _seconds(run, results),
    )


def _segments(run: Run, content: Said) -> list[tuple[NDArray[Any], Said]]:
    """Split the rows of a run by its segments; times are the median update of the run."""
    segments, end = [], 0
    for frames in run.segments:
        rows = slice(end, end + len(frames))
        confidence = None if content.confidence is None else content.confidence[rows]
        part = Said(content.boxes[rows], confidence)
        segments.append((frames, replace(part, seconds=_median_update(run, part.boxes))))
        end = rows.stop
    return segments


def _seconds(run: Run, results: Results) -> NDArray[np.float64] | None:
    """Return the times by frame: those of the timing run, else the run's own median update.

    Without a timing run the time of the initialisation is unknown, as kernels may have been
    compiled meanwhile. None if a run was stored without the time of an update.
    """
    first = int(np.isfinite(run.boxes).all(axis=1).argmax())
    key = run.identity
    timed = key.tracker, key.sequence, key.repetition, TIMING
    if timed in results.cells():
        other = results.read(timed)
        times, identity = other.times, other.identity
        same = identity.fingerprint, identity.tracker_version
        if times is not None and same == (key.fingerprint, key.tracker_version):
            seconds = np.array(times.wall, np.float64)
            seconds[first] = times.initialisation_wall
            return seconds
    return _median_update(run, run.boxes)


def _median_update(run: Run, boxes: NDArray[Any]) -> NDArray[np.float64] | None:
    """Return the run's median update as the time of each frame after initialisation."""
    update = run.circumstances.get("update_seconds")
    if update is None:
        return None
    seconds = np.full(len(boxes), np.nan)
    seconds[int(np.isfinite(boxes).all(axis=1).argmax()) + 1 :] = update
    return seconds
