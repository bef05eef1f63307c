"""Format of the VOT toolkit: `EXPERIMENT/SEQ/SEQ_001.txt` with one region per line.

A line is a rectangle, a polygon, a mask or one number: 1 if the tracker is initialised, 2 if it
failed, 0 if there is no region. In the experiment `baseline`, trackers are restarted after
failures. `SEQ_001_confidence.value` contains confidences. Polygons and masks are read as their
bounding boxes. Files `SEQ_001.bin`, the default of the toolkit, have the same content in single
precision.

Runs from anchors (the toolkit's multistart experiment) have one file per anchor. The name
`SEQ_00000050.txt` contains the frame of the anchor, counted from 0. The file has one row per frame
from the anchor to the end or to the beginning of the sequence. These files together are one run.
"""

import re
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from glob import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.exchange.names import file_name
from trackmark.bench.exchange.result_format import (
    ExchangeError,
    Header,
    ResultFormat,
    ResultRows,
    ResultSequence,
    SegmentRows,
    check_decimals,
    column_text,
    first_line,
    numbered_files,
    parse_numbers,
    read_column,
    read_text_file,
)
from trackmark.bench.metrics.interface import FrameState
from trackmark.bench.protocols import parse_protocol

SUPERVISED, LONG_TERM, ONE_PASS = "baseline", "longterm", "unsupervised"
EXPERIMENTS = (SUPERVISED, ONE_PASS, LONG_TERM, "realtime")
ANCHORS, ANCHOR_DIGITS = "anchors", 8
CODES = {0.0: FrameState.SKIPPED, 1.0: FrameState.INITIALISED, 2.0: FrameState.FAILED}


class VotFormat(ResultFormat):
    """Format of the VOT toolkit."""

    expects = (
        "SEQ/SEQ_001.txt with a region per line, in baseline, unsupervised, longterm or realtime"
    )
    exports = (
        "boxes to 4 decimals (exact in runs from anchors) except the init box; confidence; no times"
    )
    has_repetitions = True
    segment_protocols = "anchors"

    def files(self, folder: Path) -> dict[str, list[Path]]:
        """Return the files of an experiment by sequence: the folder itself, or its only subfolder.

        Of a run from anchors, only the file of the first anchor is returned; see `run_files`.
        """
        unanchored, experiment = self.whole_files(folder), _experiment_folder(folder)
        anchored = _text_or_binary_files(experiment, ANCHOR_DIGITS)
        if both := anchored.keys() & unanchored.keys():
            raise ExchangeError(
                f"{experiment / min(both)}: results from anchors and over the whole sequence. "
                "Expected: results of one experiment. Move the others to another folder."
            )
        return unanchored | {name: paths[:1] for name, paths in anchored.items()}

    def whole_files(self, folder: Path) -> dict[str, list[Path]]:
        """Return the files of runs over whole sequences, as `files` does."""
        return _text_or_binary_files(_experiment_folder(folder))

    def is_in_experiment(self, file: Path) -> bool:
        """Return whether a file is in the folder of an experiment."""
        return file.parent.parent.name in EXPERIMENTS

    def recognises(self, file: Path) -> bool:
        """Return whether a file is in an experiment, is binary or does not begin with a box."""
        is_marked = self.is_in_experiment(file) or file.suffix == ".bin"
        return is_marked or first_line(file).count(",") != 3

    def run_files(self, file: Path) -> Sequence[Path]:
        """Return the files of all anchors of the run if `file` is that of one anchor."""
        stem, anchor = _anchor_of(file)
        if anchor is None:
            return [file]
        return sorted(file.parent.glob(f"{escape(stem)}_{'[0-9]' * ANCHOR_DIGITS}{file.suffix}"))

    def read(self, file: Path) -> ResultRows:
        """Read a run: one file, or the files of all anchors."""
        if _anchor_of(file)[1] is None:
            return _read_file(file)
        files = self.run_files(file)
        segments = [_read_file(part) for part in files]
        confidences = [segment.confidence for segment in segments]
        return ResultRows(
            np.concatenate([segment.boxes for segment in segments]),
            None
            if all(confidence is None for confidence in confidences)
            else np.concatenate(
                [
                    np.full(len(segment.boxes), np.nan) if confidence is None else confidence
                    for segment, confidence in zip(segments, confidences, strict=True)
                ]
            ),
            simplification=next(filter(None, (segment.simplification for segment in segments)), ""),
            headers=tuple(
                Header(str(part), len(segment.boxes), _anchor_of(part)[1])
                for part, segment in zip(files, segments, strict=True)
            ),
            protocol=ANCHORS,
        )

    def round_boxes(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `ResultFormat.round_boxes`."""
        return np.round(boxes, 4)

    def segments(self, headers: Sequence[Header], sequence: ResultSequence) -> list[NDArray[Any]]:
        """Return the frames of each anchor: to the end or to the beginning of the sequence."""
        n = len(sequence.boxes)
        segments = []
        for header in headers:
            anchor = header.start or 0
            forwards, backwards = header.n_rows == n - anchor, header.n_rows == anchor + 1
            if not forwards and not backwards:
                raise ExchangeError(
                    f"{header.location}: {header.n_rows} rows from anchor {anchor}. Expected: "
                    f"{max(n - anchor, 0)} to the end of {sequence.name} ({n} frames), or "
                    f"{anchor + 1} to its beginning."
                )
            if forwards and backwards:
                forwards = _goes_forwards(anchor, sequence)
            segments.append(np.arange(anchor, n) if forwards else np.arange(anchor, -1, -1))
        return segments

    def write(
        self, folder: Path, sequence: str, repetition: int, rows: ResultRows
    ) -> Mapping[Path, str]:
        """Return the texts of a run; a one-pass run with confidences is written to two experiments.

        The experiment for one-pass runs thus contains all trackers, with and without confidences.
        """
        if rows.states is not None:
            return experiment_texts(folder / SUPERVISED, sequence, repetition, rows)
        file_texts = experiment_texts(folder / ONE_PASS, sequence, repetition, rows)
        if rows.confidence is not None:
            file_texts |= experiment_texts(folder / LONG_TERM, sequence, repetition, rows)
        return file_texts

    def can_write_segments(self, protocol: str) -> bool:
        """Return whether the runs start from anchors."""
        return parse_protocol(protocol).name == ANCHORS

    def write_segments(
        self, folder: Path, sequence: str, protocol: str, segments: SegmentRows
    ) -> Mapping[Path, str]:
        """Return the texts of a run from anchors, with exact boxes so that scores stay equal."""
        name = file_name(sequence)
        file_texts: dict[Path, str] = {}
        for frames, rows in segments:
            # A segment over the whole sequence begins with the first frame that has a target.
            first = int(np.isfinite(rows.boxes).all(axis=1).argmax())
            confidence = None if rows.confidence is None else rows.confidence[first:]
            path = folder / SUPERVISED / name / f"{name}_{int(frames[first]):0{ANCHOR_DIGITS}}.txt"
            segment = replace(rows, boxes=rows.boxes[first:], confidence=confidence)
            file_texts |= _region_texts(path, segment, repr)
        return file_texts


def experiment_texts(
    folder: Path, sequence: str, repetition: int, rows: ResultRows
) -> dict[Path, str]:
    """Return the texts of a run in the folder of an experiment."""
    name = file_name(sequence)
    return _region_texts(folder / name / f"{name}_{repetition + 1:03}.txt", rows)


def _experiment_folder(folder: Path) -> Path:
    """Return the only experiment in a tracker's folder, or the folder itself if there is none."""
    experiments = [folder / name for name in EXPERIMENTS if (folder / name).is_dir()]
    if {path.name for path in experiments} == {ONE_PASS, LONG_TERM}:
        # `write` creates both experiments; only the long-term one has confidences.
        return folder / LONG_TERM
    if len(experiments) > 1:
        names = ", ".join(path.name for path in experiments)
        raise ExchangeError(
            f"{folder}: several experiments ({names}). Expected: one. Add its name to the path."
        )
    return experiments[0] if experiments else folder


def _text_or_binary_files(folder: Path, n_digits: int = 3) -> dict[str, list[Path]]:
    """Return the numbered files by sequence; text files replace binary ones."""
    return numbered_files(folder, ".bin", n_digits) | numbered_files(folder, n_digits=n_digits)


def _anchor_of(file: Path) -> tuple[str, int | None]:
    """Split a file name into the sequence and the frame of the anchor; None without an anchor."""
    match = re.fullmatch(rf"(.+)_([0-9]{{{ANCHOR_DIGITS}}})", file.stem)
    return (match[1], int(match[2])) if match else (file.stem, None)


def _goes_forwards(anchor: int, sequence: ResultSequence) -> bool:
    """Return whether the tracker runs forwards from an anchor in the middle of the sequence.

    The ground truth states the direction; forwards is the default. Raises `SequenceError` if the
    sequence cannot be opened.
    """
    values = datasets.load(sequence.source, truth=sequence.truth or None).frame_values.get("anchor")
    return values is None or bool(values[anchor] >= 0)


def _read_file(file: Path) -> ResultRows:
    """Read boxes, states of a supervised run, and confidences from their separate file."""
    regions = list(_binary_regions(file) if file.suffix == ".bin" else _text_regions(file))
    boxes = np.full((len(regions), 4), np.nan)
    states = np.full(len(regions), int(FrameState.TRACKED))
    n_simplified = 0
    for frame, (location, is_mask, values) in enumerate(regions):
        if is_mask:
            boxes[frame] = _mask_bounding_box(values, location)
            n_simplified += 1
        elif len(values) == 1:
            if values[0] not in CODES:
                raise ExchangeError(f"{location}: {values[0]:g}. Expected: a region, 0, 1 or 2.")
            states[frame] = CODES[values[0]]
        elif len(values) == 4:
            boxes[frame] = values
        elif len(values) >= 6 and len(values) % 2 == 0:
            points = np.array(values).reshape(-1, 2)
            boxes[frame] = *points.min(axis=0), *np.ptp(points, axis=0)
            n_simplified += 1
        else:
            raise ExchangeError(f"{location}: {len(values)} numbers. Expected: a region.")
    has_restarts = (
        bool((states == FrameState.FAILED).any()) or file.parent.parent.name == SUPERVISED
    )
    if file.suffix != ".bin":
        check_decimals(file)
    is_supervised = has_restarts and _anchor_of(file)[1] is None
    return ResultRows(
        boxes,
        read_column(file.with_name(f"{file.stem}_confidence.value"), len(regions)),
        states if is_supervised else None,
        simplification=f"{n_simplified} polygons or masks are read as their bounding boxes"
        if n_simplified
        else "",
    )


def _text_regions(file: Path) -> Iterator[tuple[str, bool, list[float]]]:
    """Yield the location of each region for messages, whether it is a mask, and its numbers."""
    for number, line in enumerate(read_text_file(file).rstrip().splitlines(), 1):
        location = f"{file}, line {number}"
        yield location, line.startswith("m"), parse_numbers(line.removeprefix("m"), location)


def _binary_regions(file: Path) -> Iterator[tuple[str, bool, list[float]]]:
    """Yield the regions of a binary file as `_text_regions` does."""
    try:
        encoded = file.read_bytes()
    except OSError as error:
        raise ExchangeError(f"{file}: cannot be read ({error.strerror}).") from error
    offset = 0

    def read(form: str, location: str) -> tuple[float, ...]:
        nonlocal offset
        try:
            values = struct.unpack_from(f"<{form}", encoded, offset)
        except struct.error:
            raise ExchangeError(
                f"{location}: unexpected end of file. Download the file again."
            ) from None
        offset += struct.calcsize(f"<{form}")
        return values

    version, length = read("hI", f"{file}, header")
    if version != 1:
        raise ExchangeError(f"{file}: version {version} of the binary format. Expected: version 1.")
    for region_number in range(1, int(length) + 1):
        location = f"{file}, region {region_number}"
        (region_type,) = read("B", location)
        if region_type == 0:
            yield location, False, list(read("I", location))
        elif region_type == 1:
            yield location, False, list(read("4f", location))
        elif region_type == 2:
            (points,) = read("H", location)
            yield location, False, list(read(f"{2 * int(points)}f", location))
        elif region_type == 3:
            *rectangle, runs = read("hhHHH", location)
            yield location, True, [*rectangle, *read(f"{int(runs)}H", location)]
        else:
            raise ExchangeError(
                f"{location}: unknown kind of region {region_type}. Expected: 0 to 3. Download the "
                "file again."
            )
    if rest := len(encoded) - offset:
        raise ExchangeError(
            f"{file}: {rest} bytes after the last of {length} regions. Download the file again."
        )


def _mask_bounding_box(mask: list[float], location: str) -> NDArray[np.float64]:
    """Return the bounding box of a mask: left, top, width, height, run lengths off, on, off, …."""
    values = np.array(mask)
    if len(values) < 4 or not (values == np.floor(values)).all() or (values[2:] < 0).any():
        raise ExchangeError(
            f"{location}: not a mask. Expected: the letter m, then x, y, width, height and run "
            "lengths as whole numbers."
        )
    left, top, width, height = values[:4].tolist()
    ends = np.cumsum(values[4:])
    if not np.isfinite(values).all() or (len(ends) and ends[-1] > width * height):
        raise ExchangeError(f"{location}: the mask has more pixels than {width:g}x{height:g}.")
    first, last = ends[0::2][: len(ends) // 2], ends[1::2] - 1
    first, last = first[last >= first], last[last >= first]
    if not len(first):
        return np.full(4, np.nan)
    rows = first // width, last // width
    # A run over several rows reaches the left and the right side of the mask.
    spans_rows = bool((rows[0] != rows[1]).any())
    x = 0.0 if spans_rows else (first % width).min()
    right = width - 1 if spans_rows else (last % width).max()
    y, bottom = rows[0].min(), rows[1].max()
    return np.array([left + x, top + y, right - x + 1, bottom - y + 1])


def _region_texts(
    path: Path, rows: ResultRows, text_of_number: Callable[[float], str] = "{:.4f}".format
) -> dict[Path, str]:
    """Return the text with one region per line, and the text of the confidences."""
    present = np.isfinite(rows.boxes).all(axis=1)
    states = np.where(present, FrameState.TRACKED, FrameState.SKIPPED)
    states[present.argmax()] = FrameState.INITIALISED
    if rows.states is not None:
        states = rows.states
    codes = {state: f"{code:.0f}" for code, state in CODES.items()}
    lines = [
        codes.get(FrameState(state), ",".join(map(text_of_number, box)))
        for state, box in zip(states.tolist(), rows.boxes.tolist(), strict=True)
    ]
    file_texts = {path: "".join(f"{line}\n" for line in lines)}
    if rows.confidence is not None and np.isfinite(rows.confidence).any():
        file_texts[path.with_name(f"{path.stem}_confidence.value")] = column_text(rows.confidence)
    return file_texts
