"""A folder an experiment, `EXPERIMENT/SEQ/SEQ_001.txt` with a region a line: VOT's.

A line is a rectangle, a polygon, a mask, or one number: 1 where the tracker is initialised, 2 where
it failed, 0 where there is none. Of `baseline` the tracker was begun again after failures. Beside
lie `SEQ_001_confidence.value`, and times. Polygons and masks count as the boxes around them.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.exchange.layout import (
    ExchangeError,
    Layout,
    Said,
    column_from,
    file_name,
    first_line,
    numbers_of,
    rounded,
    text_of,
)
from bench.exchange.layouts.got10k import repetitions
from bench.metrics.preset import State

__all__ = ["LAYOUT"]

SUPERVISED = "baseline"
EXPERIMENTS = (SUPERVISED, "unsupervised", "longterm", "realtime")
CODES = {0.0: State.SKIPPED, 1.0: State.INITIALISED, 2.0: State.FAILED}


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Files of an experiment: of the folder itself, or of the only one in it."""
    there = [folder / name for name in EXPERIMENTS if (folder / name).is_dir()]
    if len(there) > 1:
        names = ", ".join(path.name for path in there)
        raise ExchangeError(f"{folder} holds several experiments ({names}): name one, as a path.")
    found = repetitions(there[0] if there else folder)
    if there and not found and any(there[0].glob("*/*_[0-9]*.txt")):
        raise ExchangeError(f"{there[0]}: results from many anchors, which are not read.")
    return found


def fits(file: Path) -> bool:
    """Whether it lies in an experiment's folder, or its first line is no rectangle."""
    return file.parent.parent.name in EXPERIMENTS or first_line(file).count(",") != 3


def read(file: Path) -> Said:
    """Boxes, states of a supervised run, and confidences where they lie beside."""
    lines = text_of(file).rstrip().splitlines()
    boxes, states = np.full((len(lines), 4), np.nan), np.full(len(lines), int(State.TRACKED))
    around = 0
    for number, line in enumerate(lines):
        place = f"{file}, line {number + 1}"
        if line.startswith("m"):
            boxes[number] = _around_mask(numbers_of(line[1:], place), place)
            around += 1
            continue
        numbers = numbers_of(line, place)
        if len(numbers) == 1:
            if numbers[0] not in CODES:
                raise ExchangeError(f"{place}: {line.strip()}; a region, 0, 1 or 2 is expected.")
            states[number] = CODES[numbers[0]]
        elif len(numbers) == 4:
            boxes[number] = numbers
        elif len(numbers) >= 6 and len(numbers) % 2 == 0:
            points = np.array(numbers).reshape(-1, 2)
            boxes[number] = *points.min(axis=0), *np.ptp(points, axis=0)
            around += 1
        else:
            raise ExchangeError(f"{place}: {len(numbers)} numbers are no region.")
    again = bool((states == State.FAILED).any()) or file.parent.parent.name == SUPERVISED
    return Said(
        boxes,
        column_from(file.with_name(f"{file.stem}_confidence.value"), len(lines)),
        states if again else None,
        remark=f"{around} polygons or masks count as the boxes around them" if around else "",
    )


def _around_mask(numbers: list[float], place: str) -> NDArray[np.float64]:
    """Box around a mask: left, top, width, height, then how many pixels are off, on, off, … ."""
    whole = np.array(numbers)
    if len(whole) < 4 or not (whole == np.floor(whole)).all() or (whole[2:] < 0).any():
        raise ExchangeError(f"{place}: this is no mask.")
    left, top, width, height = whole[:4].tolist()
    ends = np.cumsum(whole[4:])
    if not np.isfinite(whole).all() or (len(ends) and ends[-1] > width * height):
        raise ExchangeError(f"{place}: the mask has more pixels than {width:g}x{height:g}.")
    first, last = ends[0::2][: len(ends) // 2], ends[1::2] - 1
    first, last = first[last >= first], last[last >= first]
    if not len(first):
        return np.full(4, np.nan)
    rows = first // width, last // width
    across = bool((rows[0] != rows[1]).any())
    x = 0.0 if across else (first % width).min()
    right = width - 1 if across else (last % width).max()
    y, bottom = rows[0].min(), rows[1].max()
    return np.array([left + x, top + y, right - x + 1, bottom - y + 1])


def write(folder: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Text of a run with a region a line, and its confidences."""
    confident = said.confidence is not None and bool(np.isfinite(said.confidence).any())
    kind = SUPERVISED if said.states is not None else "longterm" if confident else "unsupervised"
    name = file_name(sequence)
    path = folder / kind / name / f"{name}_{repetition + 1:03}.txt"
    present = np.isfinite(said.boxes).all(axis=1)
    states = np.where(present, State.TRACKED, State.SKIPPED)
    states[present.argmax()] = State.INITIALISED
    if said.states is not None:
        states = said.states
    codes = {state: f"{code:.0f}" for code, state in CODES.items()}
    rows = [
        codes.get(State(state), ",".join(f"{value:.4f}" for value in box))
        for state, box in zip(states.tolist(), said.boxes.tolist(), strict=True)
    ]
    texts = {path: "".join(f"{row}\n" for row in rows)}
    if said.confidence is not None and confident:
        values = ("" if value != value else repr(value) for value in said.confidence.tolist())
        texts[path.with_name(f"{path.stem}_confidence.value")] = "".join(f"{v}\n" for v in values)
    return texts


LAYOUT = Layout(
    expects="SEQ/SEQ_001.txt with a region a line, in baseline, unsupervised, longterm or realtime",
    holds="boxes to 4 decimals but for the first, which is the truth's; confidence; no times",
    origin=0,
    files=files,
    fits=fits,
    read=read,
    write=write,
    held=rounded(4),
    repeats=True,
)
