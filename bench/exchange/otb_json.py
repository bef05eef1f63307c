"""Format of OTB's Python toolkit: `SEQ.json` with the boxes as `res`, x and y from 1.

A file contains a list of records or a single record. One-pass evaluation (`evalType` OPE) has one
record. Spatial robustness evaluation (SRE) has one per perturbed init box, named by `shiftType`.
Temporal robustness evaluation (TRE) has one per start. `startFrame` and `endFrame` are the numbers
of image files.
"""

import json
from collections.abc import Collection, Mapping, Sequence
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
    SegmentRows,
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


class OtbJsonFormat(ResultFormat):
    """Format of OTB's Python toolkit."""

    expects = 'SEQ.json with "res": [[x, y, width, height], …]'
    exports = "boxes to the last digit (zeros if missing); no confidence"
    row = "box"
    missing_row = "not scored"
    segment_protocols = "tre, sre with its default shift and scale"

    def files(self, folder: Path) -> Mapping[str, list[Path]]:
        """See `ResultFormat.files`."""
        return files_by_sequence(folder, ".json")

    def recognises(self, file: Path) -> bool:
        """See `ResultFormat.recognises`."""
        return True

    def read(self, file: Path) -> ResultRows:
        """Read records with rectangles; records of SRE are sorted in the order of `SHIFTS`."""
        records = _read_records(file)
        protocol = _protocol(file, records)
        records = _sorted_by_shift(file, records) if protocol == "sre" else records
        boxes, headers = [], []
        for record_number, record in enumerate(records, 1):
            location = str(file) if len(records) == 1 else f"{file}, record {record_number}"
            rows = _parse_boxes(record["res"], location)
            start, end = (
                _whole_number(record, key, location) for key in ("startFrame", "endFrame")
            )
            name = str(record.get("seqName") or "")
            boxes.append(rows)
            headers.append(Header(location, len(rows), start, end, name))
        return ResultRows(np.concatenate(boxes), headers=tuple(headers), protocol=protocol)

    def round_boxes(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Replace NaN by zero."""
        return np.nan_to_num(boxes)

    def segments(self, headers: Sequence[Header], sequence: ResultSequence) -> list[NDArray[Any]]:
        """Return the frames from each start to the end of the sequence."""
        n = len(sequence.boxes)
        first_image = SPANS.get(sequence.name.lower(), (1, None))[0]
        # Files count frames from 0, from 1, or from the number of the first image file.
        stated = [_first_number(header, sequence, {0, 1, first_image}) for header in headers]
        first_numbers = {number for number in stated if number is not None}
        if len(first_numbers) > 1:
            raise ExchangeError(
                f"{headers[0].location}: the records count frames from "
                f"{' and from '.join(map(str, sorted(first_numbers)))}. Expected: one numbering. "
                "Correct startFrame and endFrame."
            )
        return [np.arange(n - header.n_rows, n) for header in headers]

    def write(
        self, folder: Path, sequence: str, repetition: int, rows: ResultRows
    ) -> Mapping[Path, str]:
        """See `ResultFormat.write`."""
        return _file_texts(folder, sequence, [_record(folder, sequence, rows, "OPE", 1, None)])

    def can_write_segments(self, protocol: str) -> bool:
        """Return whether the protocol is TRE, or SRE with the default shifts."""
        return parse_protocol(protocol).name == "tre" or parse_protocol(protocol).key == "sre"

    def write_segments(
        self, folder: Path, sequence: str, protocol: str, segments: SegmentRows
    ) -> Mapping[Path, str]:
        """See `ResultFormat.write_segments`."""
        evaluation = parse_protocol(protocol).name.upper()
        shifts = SHIFTS if evaluation == "SRE" else [None] * len(segments)
        records = [
            _record(folder, sequence, rows, evaluation, int(frames[0]) + 1, shift)
            for (frames, rows), shift in zip(segments, shifts, strict=True)
        ]
        return _file_texts(folder, sequence, records)


def _read_records(file: Path) -> Sequence[Mapping[str, Any]]:
    try:
        parsed: Any = json.loads(read_text_file(file))
    except ValueError as error:  # also raised by integers of thousands of digits
        line = getattr(error, "lineno", 1)
        raise ExchangeError(f"{file}, line {line}: invalid JSON ({error}).") from error
    except RecursionError as error:
        raise ExchangeError(
            f"{file}: the JSON is nested too deeply. Expected: records with boxes as `res`."
        ) from error
    if isinstance(parsed, dict) and isinstance(parsed.get("results"), list):
        parsed = parsed["results"]
    records: Sequence[Any] = parsed if isinstance(parsed, list) and parsed else [parsed]
    if not all(
        isinstance(record, dict) and isinstance(record.get("res"), list) for record in records
    ):
        raise ExchangeError(
            f"{file}: no boxes. Expected: an object with boxes as `res`, or a list of objects."
        )
    return records


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


def _parse_boxes(rows: Sequence[Any], location: str) -> NDArray[np.float64]:
    for box_number, box in enumerate(rows, 1):
        if not (
            isinstance(box, list)
            and len(box) == 4
            and all(type(value) in (int, float) and not abs(value) > 1e300 for value in box)
        ):
            raise ExchangeError(
                f"{location}, box {box_number}: {json.dumps(box)[:60]}. Expected: x, y, width, "
                "height."
            )
    return np.array(rows, np.float64).reshape(-1, 4)


def _whole_number(record: Mapping[str, Any], key: str, location: str) -> int | None:
    """Return a frame number of a record; None if the record has none."""
    value = record.get(key)
    if value is None:
        return None
    if type(value) not in (int, float) or not abs(value) < 1e9 or value != int(value):
        raise ExchangeError(f"{location}: {key} is {quote(str(value))}. Expected: a whole number.")
    return int(value)


def _first_number(header: Header, sequence: ResultSequence, valid: Collection[int]) -> int | None:
    """Return the number of the sequence's first frame in a record; None if it states no frame.

    Raises `ExchangeError` if the record is of another sequence or of other frames.
    """
    n, location = len(sequence.boxes), header.location
    if header.sequence and not is_same_name(sequence.name, header.sequence):
        raise ExchangeError(
            f"{location}: seqName is {quote(header.sequence)}. Expected: {sequence.name!r}. Import "
            "the file for the sequence that it names, or correct seqName."
        )
    start = n - header.n_rows
    if not 0 <= start < n:
        raise ExchangeError(
            f"{location}: {header.n_rows} rows. Expected: 1 to {n}, the frames of {sequence.name}."
        )
    stated = header.start
    if stated is None and header.end is not None:
        stated = header.end - header.n_rows + 1
    if stated is None:
        return None
    if stated - start not in valid:
        raise ExchangeError(
            f"{location}: startFrame is {stated}. Expected: {start + max(valid)}, as the "
            f"{header.n_rows} rows reach the end of {sequence.name} ({n} frames). Import the file "
            "for the frames that it names, or correct startFrame and endFrame."
        )
    last = stated + header.n_rows - 1
    if header.end not in (None, last):
        raise ExchangeError(
            f"{location}: startFrame {stated} and endFrame {header.end} for {header.n_rows} rows. "
            f"Expected: endFrame {last}. Correct the header, or supply all rows."
        )
    return stated - start


def _file_texts(
    folder: Path, sequence: str, records: Sequence[Mapping[str, Any]]
) -> dict[Path, str]:
    return {folder / f"{file_name(sequence)}.json": json.dumps(records) + "\n"}


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
