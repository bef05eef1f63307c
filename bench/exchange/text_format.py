"""Formats of text files with one box per line, as most toolkits use them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.exchange.names import file_name
from trackmark.bench.exchange.result_format import (
    BOX,
    POLYGON,
    ResultFormat,
    ResultRows,
    column_text,
    files_by_sequence,
    first_line,
    numbered_files,
    read_boxes,
    read_column,
)
from trackmark.bench.exchange.vot import LONG_TERM, VotFormat, experiment_texts


@dataclass(frozen=True)
class TextFormat(ResultFormat):
    """Format with one text file per run, `SEQ.txt`, or `SEQ/SEQ_001.txt` per repetition."""

    expects: str
    exports: str
    separator: str = ","
    decimals: int = 4  # 0: boxes are truncated to whole pixels, and zeros if missing
    has_repetitions: bool = False
    missing_row: Literal["not scored", "a miss"] | None = None
    confidence_suffix: str = ""  # end of the name of the file with confidences; empty for none
    has_times: bool = False  # True if the time of each frame is in a file `SEQ_time.txt`
    # Format of supervised runs and of confidences. Such a format is not detected, because each of
    # its files is also a file of another format.
    vot: VotFormat | None = None

    def files(self, folder: Path) -> Mapping[str, Sequence[Path]]:
        """See `ResultFormat.files`."""
        if self.vot and (files := self.vot.whole_files(folder)):
            return files
        if self.has_repetitions:
            return numbered_files(folder)
        return files_by_sequence(folder, ".txt", "_time.txt", "_scores.txt")

    def recognises(self, file: Path) -> bool:
        """Return whether the first line has a box, or a polygon in a file without repetitions."""
        if self.vot:
            return False
        line = first_line(file)
        n_numbers = len(line.replace(",", " ").split())
        if self.has_repetitions:
            return n_numbers == BOX
        return n_numbers in (BOX, POLYGON) and ("\t" in line) == (self.separator == "\t")

    def read(self, file: Path) -> ResultRows:
        """See `ResultFormat.read`. Confidences are in a file of their own."""
        if self.vot and self.vot.is_in_experiment(file):
            return self.vot.read(file)
        rows = read_boxes(file)
        if not self.confidence_suffix:
            return rows
        confidences = file.with_name(f"{file.stem}{self.confidence_suffix}")
        return replace(rows, confidence=read_column(confidences, len(rows.boxes)))

    def write(
        self, folder: Path, sequence: str, repetition: int, rows: ResultRows
    ) -> Mapping[Path, str]:
        """See `ResultFormat.write`. Unknown times, as of the initialisation, are NaN.

        Without a file of times, GOT-10k's toolkit would report those of another sequence.
        """
        if self.vot and rows.states is not None:
            return self.vot.write(folder, sequence, repetition, rows)
        name = file_name(sequence)
        stem = f"{name}/{name}_{repetition + 1:03}" if self.has_repetitions else name
        boxes = rows.boxes if self.decimals else self.round_boxes(rows.boxes)
        lines = (
            self.separator.join(f"{value:.{self.decimals}f}" for value in box)
            for box in boxes.tolist()
        )
        file_texts = {folder / f"{stem}.txt": "".join(f"{line}\n" for line in lines)}
        if self.has_times and repetition == 0:
            times = np.full(len(boxes), np.nan)
            times[int(np.isfinite(boxes).all(axis=1).argmax()) + 1 :] = rows.update_seconds
            times_file = folder / name / f"{name}_time.txt"
            file_texts[times_file] = "".join(f"{time:.8f}\n" for time in times)
        if rows.confidence is not None and self.confidence_suffix:
            file_texts[folder / f"{name}{self.confidence_suffix}"] = column_text(rows.confidence)
        if rows.confidence is not None and self.vot:
            file_texts |= experiment_texts(folder / LONG_TERM, sequence, repetition, rows)
        return file_texts

    def round_boxes(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `ResultFormat.round_boxes`."""
        if self.decimals:
            return np.round(boxes, self.decimals)
        return np.trunc(np.nan_to_num(boxes)) + 0.0
