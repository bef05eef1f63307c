"""Format of OTB's Python toolkit: `SEQ.json` with the boxes as `res`, x and y from 1.

A file contains a list of records or a single record. One-pass evaluation (`evalType` OPE) has one
record. Spatial robustness evaluation (SRE) has one per perturbed init box, named by `shiftType`.
Temporal robustness evaluation (TRE) has one per start. `startFrame` and `endFrame` are the numbers
of image files.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.exchange.names import file_name, is_same_name
from trackmark.bench.exchange.result_format import (
    ExchangeError,
    Header,
    ResultFormat,
    ResultRows,
    ResultSequence,
    SegmentWriter,
    files_by_sequence,
    read_text_file,
)
from trackmark.bench.protocols import parse_protocol
from trackmark.datasets.decoding import quote
from trackmark.datasets.readers.otb import SPANS

PROTOCOLS = {"OPE": "", "SRE": "sre", "TRE": "tre"}
"""Protocol by `evalType`; empty for one-pass evaluation."""

SHIFTS = (
    *("left", "right", "up", "down", "topLeft", "topRight", "bottomLeft", "bottomRight"),
    *("scale_8", "scale_9", "scale_11", "scale_12"),
)
"""Values of `shiftType` in the order of the segments of `sre`; each shifts or scales by 10 %."""


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Return the files by sequence."""
    return files_by_sequence(folder, ".json")


def read(file: Path) -> ResultRows:
    """Read the records of a run with rectangles; sort records of SRE in the order of `SHIFTS`."""
    try:
        content: Any = json.loads(read_text_file(file))
    except ValueError as error:  # also raised by integers of thousands of digits
        line = getattr(error, "lineno", 1)
        raise ExchangeError(f"{file}, line {line}: invalid JSON ({error}).") from error
    except RecursionError as error:
        raise ExchangeError(
            f"{file}: the JSON is nested too deeply. Expected: records with boxes as `res`."
        ) from error
    if isinstance(content, dict) and isinstance(content.get("results"), list):
        content = content["results"]
    records: Sequence[Any] = content if isinstance(content, list) and content else [content]
    if not all(
        isinstance(record, dict) and isinstance(record.get("res"), list) for record in records
    ):
        raise ExchangeError(
            f"{file}: no boxes. Expected: an object with boxes as `res`, or a list of objects."
        )
    protocol = _protocol(file, records)
    records = _sorted_by_shift(file, records) if protocol == "sre" else records
    places = [
        str(file) if len(records) == 1 else f"{file}, record {n}"
        for n in range(1, len(records) + 1)
    ]
    boxes = [
        _parse_boxes(record["res"], place) for record, place in zip(records, places, strict=True)
    ]
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
    return ResultRows(np.concatenate(boxes), headers=headers, protocol=protocol)


def _protocol(file: Path, records: Sequence[Mapping[str, Any]]) -> str:
    """Return the protocol of the records; empty for one-pass evaluation."""
    kinds = [
        (record.get("resType") or "rect", record.get("evalType") or "OPE") for record in records
    ]
    for result, evaluation in kinds:
        is_supported = result == "rect" and isinstance(evaluation, str) and evaluation in PROTOCOLS
        if not is_supported or evaluation != kinds[0][1]:
            raise ExchangeError(
                f"{file}: resType, evalType: {quote(f'{result}, {evaluation}')}. Expected: rect, "
                f"one of {', '.join(PROTOCOLS)}, the same in all records of a file."
            )
    protocol = PROTOCOLS[kinds[0][1]]
    if not protocol and len(records) > 1:
        raise ExchangeError(
            f"{file}: {len(records)} records of OPE. Expected: one. Delete the others."
        )
    return protocol


def _sorted_by_shift(
    file: Path, records: Sequence[Mapping[str, Any]]
) -> Sequence[Mapping[str, Any]]:
    """Return the records in the order of `SHIFTS`; unnamed shifts are already in this order."""
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


def _parse_boxes(rows: Sequence[Any], place: str) -> NDArray[np.float64]:
    for number, box in enumerate(rows, 1):
        if not (
            isinstance(box, list)
            and len(box) == 4
            and all(type(value) in (int, float) and not abs(value) > 1e300 for value in box)
        ):
            text = json.dumps(box)[:60]
            raise ExchangeError(f"{place}, box {number}: {text}. Expected: x, y, width, height.")
    return np.array(rows, np.float64).reshape(-1, 4)


def _whole_number(record: Mapping[str, Any], key: str, place: str) -> int | None:
    """Return a frame number of a record; None if the record has none."""
    value = record.get(key)
    if value is None:
        return None
    if type(value) not in (int, float) or not abs(value) < 1e9 or value != int(value):
        raise ExchangeError(f"{place}: {key} is {quote(str(value))}. Expected: a whole number.")
    return int(value)


def frames(headers: Sequence[Header], sequence: ResultSequence) -> list[NDArray[Any]]:
    """Return the frames from each start to the end of the sequence."""
    n, first_numbers = len(sequence.boxes), {0, 1, SPANS.get(sequence.name.lower(), (1, None))[0]}
    segments, used_numbers = [], set()
    for header in headers:
        if header.sequence and not is_same_name(sequence.name, header.sequence):
            raise ExchangeError(
                f"{header.place}: seqName is {quote(header.sequence)}. Expected: "
                f"{sequence.name!r}. Import the file for the sequence that it names, or correct "
                "seqName."
            )
        start = n - header.n_rows
        if not 0 <= start < n:
            raise ExchangeError(
                f"{header.place}: {header.n_rows} rows. Expected: 1 to {n}, the frames of "
                f"{sequence.name}."
            )
        stated = header.start
        if stated is None and header.end is not None:
            stated = header.end - header.n_rows + 1
        if stated is not None and stated - start not in first_numbers:
            raise ExchangeError(
                f"{header.place}: startFrame is {stated}. Expected: {start + max(first_numbers)}, "
                f"as the {header.n_rows} rows reach the end of {sequence.name} ({n} frames). "
                "Import the file for the frames that it names, or correct startFrame and endFrame."
            )
        last = None if stated is None else stated + header.n_rows - 1
        if header.end not in (None, last):
            raise ExchangeError(
                f"{header.place}: startFrame {stated} and endFrame {header.end} for "
                f"{header.n_rows} rows. Expected: endFrame {last}. Correct the header, or supply "
                "all rows."
            )
        used_numbers |= set() if stated is None else {stated - start}
        segments.append(np.arange(start, n))
    if len(used_numbers) > 1:
        raise ExchangeError(
            f"{headers[0].place}: the records count frames from {min(used_numbers)} and from "
            f"{max(used_numbers)}. Expected: one numbering. Correct startFrame and endFrame."
        )
    return segments


def write(folder: Path, sequence: str, repetition: int, rows: ResultRows) -> Mapping[Path, str]:
    """Return the JSON text of a run."""
    record = _record(folder, sequence, rows, "OPE", 1, None)
    return {folder / f"{file_name(sequence)}.json": json.dumps([record]) + "\n"}


def segment_writer(protocol: str) -> SegmentWriter | None:
    """Return the writer of runs by TRE, or by SRE with the default shifts."""
    evaluation = {"tre": "TRE", "sre": "SRE"}.get(parse_protocol(protocol).name)
    if evaluation is None or (evaluation == "SRE" and parse_protocol(protocol).text != "sre"):
        return None

    def write_segments(
        folder: Path, sequence: str, segments: Sequence[tuple[NDArray[Any], ResultRows]]
    ) -> Mapping[Path, str]:
        shifts = SHIFTS if evaluation == "SRE" else [None] * len(segments)
        records = [
            _record(folder, sequence, rows, evaluation, int(frames[0]) + 1, shift)
            for (frames, rows), shift in zip(segments, shifts, strict=True)
        ]
        return {folder / f"{file_name(sequence)}.json": json.dumps(records) + "\n"}

    return write_segments


def _record(
    folder: Path, sequence: str, rows: ResultRows, evaluation: str, start: int, shift: str | None
) -> dict[str, Any]:
    return {
        "tracker": folder.name,
        "seqName": sequence,
        "startFrame": start,
        "endFrame": start + len(rows.boxes) - 1,
        "evalType": evaluation,
        "fps": 1 / rows.update_seconds if rows.update_seconds > 0 else None,
        "shiftType": shift,
        "resType": "rect",
        "tmplsize": None,
        "res": np.nan_to_num(rows.boxes).tolist(),
    }


FORMAT = ResultFormat(
    expects='SEQ.json with "res": [[x, y, width, height], …]',
    exports="boxes to the last digit (zeros if missing); no confidence",
    files=files,
    fits=lambda file: file.suffix == ".json",
    read=read,
    write=write,
    missing_row="not scored",
    rounding=np.nan_to_num,
    row="box",
    frames=frames,
    segment_writer=segment_writer,
    segment_protocols="tre, sre with its default shift and scale",
)
