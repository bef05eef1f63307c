"""Format of the GOT-10k toolkit: `SEQ/SEQ_001.txt` for each repetition, and `SEQ/SEQ_time.txt`."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from trackmark.bench.exchange.names import file_name
from trackmark.bench.exchange.result_format import (
    ResultFormat,
    ResultRows,
    first_line,
    read_boxes,
    round_to,
)


def repetitions(folder: Path, suffix: str = ".txt", digits: int = 3) -> Mapping[str, list[Path]]:
    """Return the files `SEQ/SEQ_001.txt` of each sequence in a folder."""
    repetitions_of = {
        path.name: sorted(path.glob(f"{path.name}_{'[0-9]' * digits}{suffix}"))
        for path in sorted(folder.iterdir())
        # The name becomes part of a pattern: escape its special characters.
        if path.is_dir() and not set(path.name) & set("[]*?")
    }
    return {name: paths for name, paths in repetitions_of.items() if paths}


def fits(file: Path) -> bool:
    """Return whether the first line has four numbers."""
    return len(first_line(file).replace(",", " ").split()) == 4


def write(folder: Path, sequence: str, repetition: int, rows: ResultRows) -> Mapping[Path, str]:
    """Return the texts of a run and of its times.

    Unknown times, as of the initialisation, are written as NaN: without a time file the toolkit
    reports another sequence's times.
    """
    name = file_name(sequence)
    lines = (",".join(f"{value:.3f}" for value in box) for box in rows.boxes.tolist())
    texts = {
        folder / name / f"{name}_{repetition + 1:03}.txt": "".join(f"{line}\n" for line in lines)
    }
    if repetition == 0:
        times = np.full(len(rows.boxes), np.nan)
        times[int(np.isfinite(rows.boxes).all(axis=1).argmax()) + 1 :] = rows.update_seconds
        texts[folder / name / f"{name}_time.txt"] = "".join(f"{time:.8f}\n" for time in times)
    return texts


FORMAT = ResultFormat(
    expects="SEQ/SEQ_001.txt with x,y,width,height per line",
    exports="boxes to 3 decimals; times of the first repetition; no confidence",
    files=repetitions,
    fits=fits,
    read=read_boxes,
    write=write,
    rounding=round_to(3),
    has_repetitions=True,
)
