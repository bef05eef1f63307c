"""A text a sequence, `SEQ.txt`, four numbers a line, x and y from 1: OTB's, and got10k's for it."""

from collections.abc import Mapping
from pathlib import Path

from trackmark.bench.exchange.result_format import (
    Layout,
    Said,
    boxes_from,
    by_sequence,
    file_name,
    first_line,
    rounded,
)


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Return the texts by sequence, without those of times and scores."""
    return by_sequence(folder, "*.txt", besides=("_time.txt", "_scores.txt"))


def fits(file: Path) -> bool:
    """Return whether the first line has four numbers, not separated by tabs."""
    line = first_line(file)
    return "\t" not in line and len(line.replace(",", " ").split()) == 4


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Return the text of a run."""
    rows = (",".join(f"{value:.4f}" for value in box) for box in said.boxes.tolist())
    return {folder / f"{file_name(sequence)}.txt": "".join(f"{row}\n" for row in rows)}


LAYOUT = Layout(
    expects="SEQ.txt with x,y,width,height a line",
    holds="boxes to 4 decimals; no confidence, no times",
    origin=1,
    files=files,
    fits=fits,
    read=boxes_from,
    write=write,
    held=rounded(4),
)
