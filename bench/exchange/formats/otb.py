"""Format of OTB and of got10k for OTB: `SEQ.txt` with four numbers per line, x and y from 1."""

from collections.abc import Mapping
from pathlib import Path

from trackmark.bench.exchange.names import file_name
from trackmark.bench.exchange.result_format import (
    ResultFormat,
    ResultRows,
    files_by_sequence,
    first_line,
    has_boxes,
    read_boxes,
    round_to,
)


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Return the text files by sequence, without files of times and scores."""
    return files_by_sequence(folder, ".txt", "_time.txt", "_scores.txt")


def fits(file: Path) -> bool:
    """Return whether the first line has a box or polygon, not separated by tabs."""
    line = first_line(file)
    return "\t" not in line and has_boxes(line)


def write(folder: Path, sequence: str, repetition: int, rows: ResultRows) -> Mapping[Path, str]:
    """Return the text of a run."""
    lines = (",".join(f"{value:.4f}" for value in box) for box in rows.boxes.tolist())
    return {folder / f"{file_name(sequence)}.txt": "".join(f"{line}\n" for line in lines)}


FORMAT = ResultFormat(
    expects="SEQ.txt with x,y,width,height per line",
    exports="boxes to 4 decimals; no confidence, no times",
    files=files,
    fits=fits,
    read=read_boxes,
    write=write,
    missing_row="not scored",
    rounding=round_to(4),
)
