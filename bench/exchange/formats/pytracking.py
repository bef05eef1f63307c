"""Format of pytracking: `SEQ.txt` with whole numbers between tabs.

`SEQ_object_presence_scores.txt` contains one confidence per frame.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.exchange.names import file_name
from trackmark.bench.exchange.result_format import (
    ResultFormat,
    ResultRows,
    column_text,
    files_by_sequence,
    first_line,
    read_boxes,
    read_column,
)

CONFIDENCE_SUFFIX = "_object_presence_scores.txt"


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Return the text files by sequence, without files of times and confidences."""
    return files_by_sequence(folder, ".txt", "_time.txt", CONFIDENCE_SUFFIX)


def read(file: Path) -> ResultRows:
    """Read boxes, and confidences from the file next to it."""
    rows = read_boxes(file)
    confidences = file.with_name(f"{file.stem}{CONFIDENCE_SUFFIX}")
    return replace(rows, confidence=read_column(confidences, len(rows.boxes)))


def write(folder: Path, sequence: str, repetition: int, rows: ResultRows) -> Mapping[Path, str]:
    """Return the texts of a run and of its confidences."""
    name = file_name(sequence)
    lines = ("\t".join(f"{value:.0f}" for value in box) for box in truncate(rows.boxes).tolist())
    texts = {folder / f"{name}.txt": "".join(f"{line}\n" for line in lines)}
    if rows.confidence is not None:
        texts[folder / f"{name}{CONFIDENCE_SUFFIX}"] = column_text(rows.confidence)
    return texts


def truncate(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Truncate boxes to whole numbers."""
    return np.trunc(np.nan_to_num(boxes)) + 0.0


FORMAT = ResultFormat(
    expects="SEQ.txt with x, y, width, height between tabs",
    exports="boxes truncated to whole pixels (zeros if missing); confidence; no times",
    files=files,
    fits=lambda file: "\t" in first_line(file),
    read=read,
    write=write,
    missing_row="a miss",
    rounding=truncate,
)
