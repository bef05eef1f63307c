"""A folder an experiment, `EXPERIMENT/SEQ/SEQ_001.txt` with a region a line: VOT's.

A line is a rectangle, a polygon, a mask, or one number: 1 where the tracker is initialised, 2 where
it failed, 0 where there is none. Of `baseline` the tracker was begun again after failures. Beside
lie `SEQ_001_confidence.value`, and times. Polygons and masks count as the boxes around them. Files
`SEQ_001.bin`, which the toolkit writes by default, hold the same in single precision.

Runs from anchors (the toolkit's multistart experiment) have a file per anchor, `SEQ_00000050.txt`,
with the number of the anchor's frame from 0 and a row per frame from there to an end of the
sequence. These files together are one run.
"""

import re
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.exchange.formats.got10k import repetitions
from trackmark.bench.exchange.result_format import (
    ExchangeError,
    Header,
    Layout,
    On,
    Said,
    SegmentWriter,
    column_from,
    column_text,
    file_name,
    first_line,
    numbers_of,
    rounded,
    text_of,
)
from trackmark.bench.metrics.preset import State
from trackmark.bench.protocols import parse_protocol

SUPERVISED, LONG_TERM, ONE_PASS = "baseline", "longterm", "unsupervised"
EXPERIMENTS = (SUPERVISED, ONE_PASS, LONG_TERM, "realtime")
ANCHORS, ANCHOR_DIGITS = "anchors", 8
CODES = {0.0: State.SKIPPED, 1.0: State.INITIALISED, 2.0: State.FAILED}


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Return the files of an experiment: of the folder itself, or of the only one in it.

    Of one-pass and long-term files the second are taken, which have confidences.
    """
    there = [folder / name for name in EXPERIMENTS if (folder / name).is_dir()]
    if {path.name for path in there} == {ONE_PASS, LONG_TERM}:  # as `write` has it
        there = [folder / LONG_TERM]
    if len(there) > 1:
        names = ", ".join(path.name for path in there)
        raise ExchangeError(f"{folder} holds several experiments ({names}): name one, as a path.")
    place = there[0] if there else folder
    anchored = _files_of(place, ANCHOR_DIGITS)
    whole = _files_of(place)
    if both := anchored.keys() & whole.keys():
        raise ExchangeError(
            f"{place / min(both)}: results from anchors and over the whole sequence. Expected: "
            "those of one experiment. Move the others to another folder."
        )
    return whole | {name: of[:1] for name, of in anchored.items()}


def _files_of(place: Path, digits: int = 3) -> dict[str, list[Path]]:
    """Return the numbered files of each sequence, texts before binary files."""
    return {**repetitions(place, ".bin", digits), **repetitions(place, digits=digits)}


def parts(file: Path) -> Sequence[Path]:
    """Return the files of all anchors if the file is that of an anchor, else the file alone."""
    stem, anchor = _anchor_of(file)
    if anchor is None:
        return [file]
    return sorted(file.parent.glob(f"{stem}_{'[0-9]' * ANCHOR_DIGITS}{file.suffix}"))


def _anchor_of(file: Path) -> tuple[str, int | None]:
    """Return the sequence's name, and the number of the anchor that the file is named after."""
    match = re.fullmatch(rf"(.+)_([0-9]{{{ANCHOR_DIGITS}}})", file.stem)
    return (match[1], int(match[2])) if match else (file.stem, None)


def fits(file: Path) -> bool:
    """Return whether it lies in the folder of an experiment, or its first line is no rectangle."""
    known = file.parent.parent.name in EXPERIMENTS or file.suffix == ".bin"
    return known or first_line(file).count(",") != 3


def read(file: Path) -> Said:
    """Read a run: one file, or those of all anchors."""
    if _anchor_of(file)[1] is None:
        return _read_file(file)
    files = parts(file)
    segments = [_read_file(part) for part in files]
    confidences = [
        np.full(len(segment.boxes), np.nan) if segment.confidence is None else segment.confidence
        for segment in segments
    ]
    given = any(segment.confidence is not None for segment in segments)
    return Said(
        np.concatenate([segment.boxes for segment in segments]),
        np.concatenate(confidences) if given else None,
        remark=next((segment.remark for segment in segments if segment.remark), ""),
        headers=tuple(
            Header(str(part), len(segment.boxes), _anchor_of(part)[1])
            for part, segment in zip(files, segments, strict=True)
        ),
        protocol=ANCHORS,
    )


def frames(headers: Sequence[Header], on: On) -> list[NDArray[Any]]:
    """Return the frames from each anchor to that end of the sequence which the rows reach."""
    n = len(on.boxes)
    segments = []
    for header in headers:
        anchor = header.start or 0
        forwards, backwards = header.rows == n - anchor, header.rows == anchor + 1
        if not forwards and not backwards:
            raise ExchangeError(
                f"{header.place}: {header.rows} rows from anchor {anchor}. Expected: "
                f"{max(n - anchor, 0)} to the end of {on.name} ({n} frames), or {anchor + 1} to "
                "its beginning."
            )
        if forwards and backwards:
            forwards = _goes_forwards(anchor, on)
        segments.append(np.arange(anchor, n) if forwards else np.arange(anchor, -1, -1))
    return segments


def _goes_forwards(anchor: int, on: On) -> bool:
    """Return whether an anchor in the middle goes forwards: as the data state, else the protocol.

    Raises `SequenceError` if the sequence cannot be opened.
    """
    values = datasets.load(on.source, truth=on.truth or None).values.get("anchor")
    return values is None or bool(values[anchor] >= 0)


def _read_file(file: Path) -> Said:
    """Read boxes, states of a supervised run, and confidences from the file next to it."""
    regions = list(_binary(file) if file.suffix == ".bin" else _text(file))
    boxes, states = np.full((len(regions), 4), np.nan), np.full(len(regions), int(State.TRACKED))
    around = 0
    for number, (place, is_mask, numbers) in enumerate(regions):
        if is_mask:
            boxes[number] = _around_mask(numbers, place)
            around += 1
        elif len(numbers) == 1:
            if numbers[0] not in CODES:
                raise ExchangeError(f"{place}: {numbers[0]:g}; a region, 0, 1 or 2 is expected.")
            states[number] = CODES[numbers[0]]
        elif len(numbers) == 4:
            boxes[number] = numbers
        elif len(numbers) >= 6 and len(numbers) % 2 == 0:
            points = np.array(numbers).reshape(-1, 2)
            boxes[number] = *points.min(axis=0), *np.ptp(points, axis=0)
            around += 1
        else:
            raise ExchangeError(f"{place}: {len(numbers)} numbers are no region.")
    again = bool((states == State.FAILED).any()) or file.parent.parent.name == SUPERVISED
    again = again and _anchor_of(file)[1] is None
    return Said(
        boxes,
        column_from(file.with_name(f"{file.stem}_confidence.value"), len(regions)),
        states if again else None,
        remark=f"{around} polygons or masks count as the boxes around them" if around else "",
    )


def _text(file: Path) -> Iterator[tuple[str, bool, list[float]]]:
    """Yield the place of each line, whether it is a mask, and its numbers."""
    for number, line in enumerate(text_of(file).rstrip().splitlines(), 1):
        place = f"{file}, line {number}"
        yield place, line.startswith("m"), numbers_of(line.removeprefix("m"), place)


def _binary(file: Path) -> Iterator[tuple[str, bool, list[float]]]:
    """Yield the same for a binary file: version and length, then kind and numbers by region."""
    try:
        data = file.read_bytes()
    except OSError as error:
        raise ExchangeError(f"{file}: this can't be read ({error.strerror}).") from error
    at = 0

    def read(form: str, place: str) -> tuple[float, ...]:
        nonlocal at
        try:
            values = struct.unpack_from(f"<{form}", data, at)
        except struct.error:
            raise ExchangeError(
                f"{place}: unexpected end of file. Download the file again."
            ) from None
        at += struct.calcsize(f"<{form}")
        return values

    version, length = read("hI", f"{file}, its head")
    if version != 1:
        raise ExchangeError(f"{file}: this is of version {version}; version 1 is read.")
    for number in range(1, int(length) + 1):
        place = f"{file}, region {number}"
        (kind,) = read("B", place)
        if kind == 0:
            yield place, False, list(read("I", place))
        elif kind == 1:
            yield place, False, list(read("4f", place))
        elif kind == 2:
            (points,) = read("H", place)
            yield place, False, list(read(f"{2 * int(points)}f", place))
        elif kind == 3:
            *part, runs = read("hhHHH", place)
            yield place, True, [*part, *read(f"{int(runs)}H", place)]
        else:
            raise ExchangeError(
                f"{place}: there is no kind {kind} of regions. Download the file again."
            )
    if behind := len(data) - at:
        raise ExchangeError(f"{file}: there are {behind} bytes behind its {length} regions.")


def _around_mask(numbers: list[float], place: str) -> NDArray[np.float64]:
    """Return the box around a mask: left, top, width, height, then run lengths off, on, off, …."""
    whole = np.array(numbers)
    if len(whole) < 4 or not (whole == np.floor(whole)).all() or (whole[2:] < 0).any():
        raise ExchangeError(f"{place}: this is no mask.")
    left, top, width, height = whole[:4].tolist()
    ends = np.cumsum(whole[4:])
    if not np.isfinite(whole).all() or (len(ends) and ends[-1] > width * height):
        raise ExchangeError(f"{place}: the mask has more pixels than {width:g}x{height:g}.")
    first, last = ends[0::2][: len(ends) // 2], ends[1::2] - 1
    first, last = first[last >= first], last[last >= first]
    if not len(first):
        return np.full(4, np.nan)
    rows = first // width, last // width
    across = bool((rows[0] != rows[1]).any())
    x = 0.0 if across else (first % width).min()
    right = width - 1 if across else (last % width).max()
    y, bottom = rows[0].min(), rows[1].max()
    return np.array([left + x, top + y, right - x + 1, bottom - y + 1])


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Return the texts of a run; a one-pass run with confidences is in two experiments.

    So one experiment holds all trackers, those with confidences and those without.
    """
    if said.states is not None:
        return written(folder / SUPERVISED, sequence, repetition, said)
    made = dict(written(folder / ONE_PASS, sequence, repetition, said))
    if said.confidence is not None:
        made |= written(folder / LONG_TERM, sequence, repetition, said)
    return made


def written(place: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Return the texts of a run, in the folder of an experiment."""
    name = file_name(sequence)
    return _texts(place / name / f"{name}_{repetition + 1:03}.txt", said)


def write_anchors(
    folder: Path, sequence: str, segments: Sequence[tuple[NDArray[Any], Said]]
) -> Mapping[Path, str]:
    """Return the texts of a run from anchors, in the folder of the toolkit's experiment.

    Boxes are written to the last digit, so that scores stay equal.
    """
    name = file_name(sequence)
    texts: dict[Path, str] = {}
    for numbers, said in segments:
        # A segment over the whole sequence begins with the first frame that has a target.
        first = int(np.isfinite(said.boxes).all(axis=1).argmax())
        rows = slice(first, None)
        confidence = None if said.confidence is None else said.confidence[rows]
        path = folder / SUPERVISED / name / f"{name}_{int(numbers[first]):0{ANCHOR_DIGITS}}.txt"
        part = replace(said, boxes=said.boxes[rows], confidence=confidence)
        texts |= _texts(path, part, repr)
    return texts


def segments(protocol: str) -> SegmentWriter | None:
    """Return the writer of runs from anchors."""
    return write_anchors if parse_protocol(protocol).name == ANCHORS else None


def _texts(
    path: Path, said: Said, text_of_number: Callable[[float], str] = "{:.4f}".format
) -> dict[Path, str]:
    """Return the text of rows with a region a line, and that of their confidences."""
    present = np.isfinite(said.boxes).all(axis=1)
    states = np.where(present, State.TRACKED, State.SKIPPED)
    states[present.argmax()] = State.INITIALISED
    if said.states is not None:
        states = said.states
    codes = {state: f"{code:.0f}" for code, state in CODES.items()}
    rows = [
        codes.get(State(state), ",".join(map(text_of_number, box)))
        for state, box in zip(states.tolist(), said.boxes.tolist(), strict=True)
    ]
    texts = {path: "".join(f"{row}\n" for row in rows)}
    if said.confidence is not None and np.isfinite(said.confidence).any():
        texts[path.with_name(f"{path.stem}_confidence.value")] = column_text(said.confidence)
    return texts


LAYOUT = Layout(
    expects="SEQ/SEQ_001.txt with a region a line, in baseline, unsupervised, longterm or realtime",
    holds="boxes to 4 decimals (anchors: all) but for the first, the truth's; confidence; no times",
    origin=0,
    files=files,
    fits=fits,
    read=read,
    write=write,
    held=rounded(4),
    repeats=True,
    parts=parts,
    frames=frames,
    segments=segments,
    holds_segments="anchors",
)
