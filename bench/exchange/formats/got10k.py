"""A folder a sequence, `SEQ/SEQ_001.txt` a repetition and `SEQ/SEQ_time.txt`: GOT-10k's."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from trackmark.bench.exchange.result_format import (
    Layout,
    Said,
    boxes_from,
    file_name,
    first_line,
    rounded,
)


def repetitions(folder: Path, suffix: str = ".txt", digits: int = 3) -> Mapping[str, list[Path]]:
    """Return the files `SEQ/SEQ_001.txt` of all sequences in a folder."""
    found = {
        path.name: sorted(path.glob(f"{path.name}_{'[0-9]' * digits}{suffix}"))
        for path in sorted(folder.iterdir())
        if path.is_dir() and not set(path.name) & set("[]*?")  # special characters of patterns
    }
    return {name: of for name, of in found.items() if of}


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Return the texts by sequence, one per repetition."""
    return repetitions(folder)


def fits(file: Path) -> bool:
    """Return whether the first line has four numbers."""
    return len(first_line(file).replace(",", " ").split()) == 4


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Return the texts of a run and of its times.

    Without times the report of the toolkit takes those of another sequence.
    """
    name = file_name(sequence)
    rows = (",".join(f"{value:.3f}" for value in box) for box in said.boxes.tolist())
    texts = {folder / name / f"{name}_{repetition + 1:03}.txt": "".join(f"{r}\n" for r in rows)}
    if repetition == 0:
        times = [np.nan] * len(said.boxes) if said.seconds is None else said.seconds
        texts[folder / name / f"{name}_time.txt"] = "".join(f"{time:.8f}\n" for time in times)
    return texts


LAYOUT = Layout(
    expects="SEQ/SEQ_001.txt with x,y,width,height a line",
    holds="boxes to 3 decimals; times of the first repetition; no confidence",
    origin=1,
    files=files,
    fits=fits,
    read=boxes_from,
    write=write,
    held=rounded(3),
    repeats=True,
)
