"""A text a sequence, `SEQ.txt`, whole numbers between tabs: pytracking's.

`SEQ_object_presence_scores.txt` beside it holds a confidence a frame.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.exchange.result_format import (
    Layout,
    Said,
    boxes_from,
    by_sequence,
    column_from,
    column_text,
    file_name,
    first_line,
)

SCORES = "_object_presence_scores.txt"


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Return the texts by sequence, without those of times and confidences."""
    return by_sequence(folder, "*.txt", besides=("_time.txt", SCORES))


def read(file: Path) -> Said:
    """Read boxes, and confidences from the file next to it."""
    said = boxes_from(file)
    beside = file.with_name(f"{file.stem}{SCORES}")
    return replace(said, confidence=column_from(beside, len(said.boxes)))


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Return the texts of a run and of its confidences."""
    name = file_name(sequence)
    rows = ("\t".join(f"{value:.0f}" for value in box) for box in held(said.boxes).tolist())
    texts = {folder / f"{name}.txt": "".join(f"{row}\n" for row in rows)}
    if said.confidence is not None:
        texts[folder / f"{name}{SCORES}"] = column_text(said.confidence)
    return texts


def held(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Truncate boxes to whole numbers."""
    return np.trunc(np.nan_to_num(boxes)) + 0.0


LAYOUT = Layout(
    expects="SEQ.txt with x, y, width, height between tabs",
    holds="boxes cut off to whole pixels (zeros where there is none); confidence; no times",
    origin=1,
    files=files,
    fits=lambda file: "\t" in first_line(file),
    read=read,
    write=write,
    held=held,
)
