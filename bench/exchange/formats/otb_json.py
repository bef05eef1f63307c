"""JSON a sequence, `SEQ.json`, with the boxes as `res`, x and y from 1: OTB's Python toolkit.

A file holds a list of records, or one record alone. Evaluation in one pass (`evalType` OPE) has one
record. Spatial robustness (SRE) has one per shift of the first box, named by `shiftType`; temporal
robustness (TRE) has one per start. `startFrame` and `endFrame` are numbers of image files.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.exchange.result_format import (
    ExchangeError,
    Header,
    Layout,
    On,
    Said,
    SegmentWriter,
    by_sequence,
    file_name,
    letters,
    text_of,
)
from trackmark.bench.protocols import parse_protocol
from trackmark.datasets.decoding import quote
from trackmark.datasets.readers.otb import SPANS

PROTOCOLS = {"OPE": "", "SRE": "sre", "TRE": "tre"}
"""Names of our protocols by `evalType`."""

SHIFTS = (
    *("left", "right", "up", "down", "topLeft", "topRight", "bottomLeft", "bottomRight"),
    *("scale_8", "scale_9", "scale_11", "scale_12"),
)
"""Values of `shiftType` in the order of the segments of `sre`; all shift or scale by 10 %."""


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Return the files by sequence."""
    return by_sequence(folder, "*.json")


def read(file: Path) -> Said:
    """Read the records of a run, given as rectangles; those of SRE in the order of `SHIFTS`."""
    try:
        content: Any = json.loads(text_of(file))
    except ValueError as error:  # a whole number of thousands of digits, too
        line = getattr(error, "lineno", 1)
        raise ExchangeError(f"{file}, line {line}: this is no JSON ({error}).") from error
    except RecursionError as error:
        raise ExchangeError(f"{file}: this is nested too deeply.") from error
    if isinstance(content, dict) and isinstance(content.get("results"), list):
        content = content["results"]
    records: Sequence[Any] = content if isinstance(content, list) and content else [content]
    if not all(
        isinstance(record, dict) and isinstance(record.get("res"), list) for record in records
    ):
        raise ExchangeError(
            f"{file}: expected is an object with boxes as `res`, or a list of such."
        )
    protocol = _protocol(file, records)
    records = _sorted_by_shift(file, records) if protocol == "sre" else records
    places = [
        str(file) if len(records) == 1 else f"{file}, record {n}"
        for n in range(1, len(records) + 1)
    ]
    boxes = [_boxes(record["res"], place) for record, place in zip(records, places, strict=True)]
    headers = tuple(
        Header(
            place,
            len(rows),
            _whole_number(record, "startFrame", place),
            _whole_number(record, "endFrame", place),
            str(record.get("seqName") or ""),
        )
        for record, place, rows in zip(records, places, boxes, strict=True)
    )
    return Said(np.concatenate(boxes), headers=headers, protocol=protocol)


def _protocol(file: Path, records: Sequence[Mapping[str, Any]]) -> str:
    """Return the name of the protocol that all records state; empty for one pass."""
    kinds = [
        (record.get("resType") or "rect", record.get("evalType") or "OPE") for record in records
    ]
    for result, evaluation in kinds:
        known = result == "rect" and isinstance(evaluation, str) and evaluation in PROTOCOLS
        if not known or evaluation != kinds[0][1]:
            raise ExchangeError(
                f"{file}: {quote(f'{result} of {evaluation}')}; read are rect of "
                f"{', '.join(PROTOCOLS)}, one of these in a file."
            )
    protocol = PROTOCOLS[kinds[0][1]]
    if not protocol and len(records) > 1:
        raise ExchangeError(
            f"{file}: {len(records)} records of OPE. Expected: one. Keep the one that you mean."
        )
    return protocol


def _sorted_by_shift(
    file: Path, records: Sequence[Mapping[str, Any]]
) -> Sequence[Mapping[str, Any]]:
    """Return the records in the order of `SHIFTS`, which they have if none names its shift."""
    shifts = [record.get("shiftType") for record in records]
    if len(shifts) == len(SHIFTS) and not any(shifts):
        return records
    by_shift = {str(shift): record for shift, record in zip(shifts, records, strict=True)}
    if len(records) != len(SHIFTS) or set(by_shift) != set(SHIFTS):
        raise ExchangeError(
            f"{file}: {len(records)} records of SRE with shiftType "
            f"{quote(', '.join(map(str, shifts)))}. Expected: each of {', '.join(SHIFTS)} once."
        )
    return [by_shift[shift] for shift in SHIFTS]


def _boxes(rows: Sequence[Any], place: str) -> NDArray[np.float64]:
    for number, box in enumerate(rows, 1):
        if not (
            isinstance(box, list)
            and len(box) == 4
            and all(type(value) in (int, float) and not abs(value) > 1e300 for value in box)
        ):
            text = json.dumps(box)[:60]
            raise ExchangeError(f"{place}, box {number}: {text} are not x, y, width, height.")
    return np.array(rows, np.float64).reshape(-1, 4)


def _whole_number(record: Mapping[str, Any], key: str, place: str) -> int | None:
    """Return the number of a frame in a header; None if the header does not state it."""
    value = record.get(key)
    if value is None:
        return None
    if type(value) not in (int, float) or not abs(value) < 1e9 or value != int(value):
        raise ExchangeError(f"{place}: {key} is {quote(str(value))}. Expected: a whole number.")
    return int(value)


def frames(headers: Sequence[Header], on: On) -> list[NDArray[Any]]:
    """Return the frames from each start to the end of the sequence."""
    n, first = len(on.boxes), {0, 1, SPANS.get(on.name.lower(), (1, None))[0]}
    segments, offsets = [], set()
    for header in headers:
        if header.sequence and letters(header.sequence) != letters(on.name):
            raise ExchangeError(
                f"{header.place}: seqName is {quote(header.sequence)}. Expected: "
                f"{on.name!r}. Import the file for the sequence that it names, or correct seqName."
            )
        start = n - header.rows
        if not 0 <= start < n:
            raise ExchangeError(
                f"{header.place}: {header.rows} rows. Expected: 1 to {n}, the frames of {on.name}."
            )
        stated = header.start
        if stated is None and header.end is not None:
            stated = header.end - header.rows + 1
        if stated is not None and stated - start not in first:
            raise ExchangeError(
                f"{header.place}: startFrame is {stated}. Expected: {start + max(first)}, as the "
                f"{header.rows} rows reach the end of {on.name} ({n} frames). Import the file for "
                "the frames that it names, or correct startFrame and endFrame."
            )
        last = None if stated is None else stated + header.rows - 1
        if header.end not in (None, last):
            raise ExchangeError(
                f"{header.place}: startFrame {stated} and endFrame {header.end} for {header.rows} "
                f"rows. Expected: endFrame {last}. Correct the header, or supply all rows."
            )
        offsets |= set() if stated is None else {stated - start}
        segments.append(np.arange(start, n))
    if len(offsets) > 1:
        raise ExchangeError(
            f"{headers[0].place}: the records count frames from {min(offsets)} and from "
            f"{max(offsets)}. Expected: one numbering. Correct startFrame and endFrame."
        )
    return segments


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Return the JSON text of a run."""
    record = _record(folder, sequence, said, "OPE", 1, None)
    return {folder / f"{file_name(sequence)}.json": json.dumps([record]) + "\n"}


def segments(protocol: str) -> SegmentWriter | None:
    """Return the writer of runs by TRE, or by SRE with the shifts that the toolkit has names for.

    `protocol`: its text.
    """
    evaluation = {"tre": "TRE", "sre": "SRE"}.get(parse_protocol(protocol).name)
    if evaluation is None or (evaluation == "SRE" and parse_protocol(protocol).text != "sre"):
        return None

    def write_segments(
        folder: Path, sequence: str, segments: Sequence[tuple[NDArray[Any], Said]]
    ) -> Mapping[Path, str]:
        shifts = SHIFTS if evaluation == "SRE" else [None] * len(segments)
        records = [
            _record(folder, sequence, said, evaluation, int(numbers[0]) + 1, shift)
            for (numbers, said), shift in zip(segments, shifts, strict=True)
        ]
        return {folder / f"{file_name(sequence)}.json": json.dumps(records) + "\n"}

    return write_segments


def _record(
    folder: Path, sequence: str, said: Said, evaluation: str, start: int, shift: str | None
) -> dict[str, Any]:
    first = int(np.isfinite(said.boxes).all(axis=1).argmax())
    times = np.empty(0) if said.seconds is None else said.seconds[first + 1 :]  # of updates
    times = times[np.isfinite(times)]
    return {
        "tracker": folder.name,
        "seqName": sequence,
        "startFrame": start,
        "endFrame": start + len(said.boxes) - 1,
        "evalType": evaluation,
        "fps": 1 / float(times.mean()) if times.sum() else None,
        "shiftType": shift,
        "resType": "rect",
        "tmplsize": None,
        "res": np.nan_to_num(said.boxes).tolist(),
    }


LAYOUT = Layout(
    expects='SEQ.json with "res": [[x, y, width, height], …]',
    holds="boxes to the last digit (zeros where there is none); no confidence",
    origin=1,
    files=files,
    fits=lambda file: file.suffix == ".json",
    read=read,
    write=write,
    held=np.nan_to_num,
    row="box",
    frames=frames,
    segments=segments,
    holds_segments="tre, sre with its default shift and scale",
)
