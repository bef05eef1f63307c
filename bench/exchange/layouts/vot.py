"""A folder an experiment, `EXPERIMENT/SEQ/SEQ_001.txt` with a region a line: VOT's.

A line is a rectangle, a polygon, a mask, or one number: 1 where the tracker is initialised, 2 where
it failed, 0 where there is none. Of `baseline` the tracker was begun again after failures. Beside
lie `SEQ_001_confidence.value`, and times. Polygons and masks count as the boxes around them. Files
`SEQ_001.bin`, which the toolkit writes by default, hold the same in single precision.
"""

import struct
from collections.abc import Iterator, Mapping
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

SUPERVISED, LONG_TERM, ONE_PASS = "baseline", "longterm", "unsupervised"
EXPERIMENTS = (SUPERVISED, ONE_PASS, LONG_TERM, "realtime")
CODES = {0.0: State.SKIPPED, 1.0: State.INITIALISED, 2.0: State.FAILED}


def files(folder: Path) -> Mapping[str, list[Path]]:
    """Files of an experiment: of the folder itself, or of the only one in it.

    Of one pass and long-term those of the second, which have confidences.
    """
    there = [folder / name for name in EXPERIMENTS if (folder / name).is_dir()]
    if {path.name for path in there} == {ONE_PASS, LONG_TERM}:  # as `write` has it
        there = [folder / LONG_TERM]
    if len(there) > 1:
        names = ", ".join(path.name for path in there)
        raise ExchangeError(f"{folder} holds several experiments ({names}): name one, as a path.")
    place = there[0] if there else folder
    found = {**repetitions(place, ".bin"), **repetitions(place)}
    others = (file.suffix for file in place.glob("*/*_[0-9]*"))
    if there and not found and any(suffix in (".txt", ".bin") for suffix in others):
        raise ExchangeError(f"{place}: results from many anchors, which are not read.")
    return found


def fits(file: Path) -> bool:
    """Whether it lies in an experiment's folder, or its first line is no rectangle."""
    known = file.parent.parent.name in EXPERIMENTS or file.suffix == ".bin"
    return known or first_line(file).count(",") != 3


def read(file: Path) -> Said:
    """Boxes, states of a supervised run, and confidences where they lie beside."""
    regions = list(_binary(file) if file.suffix == ".bin" else _text(file))
    boxes, states = np.full((len(regions), 4), np.nan), np.full(len(regions), int(State.TRACKED))
    around = 0
    for number, (place, is_mask, numbers) in enumerate(regions):
        if is_mask:
            boxes[number] = _around_mask(numbers, place)
            around += 1
        elif len(numbers) == 1:
            if numbers[0] not in CODES:
                raise ExchangeError(f"{place}: {numbers[0]:g}; a region, 0, 1 or 2 is expected.")
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
        column_from(file.with_name(f"{file.stem}_confidence.value"), len(regions)),
        states if again else None,
        remark=f"{around} polygons or masks count as the boxes around them" if around else "",
    )


def _text(file: Path) -> Iterator[tuple[str, bool, list[float]]]:
    """By line where it stands, whether it is a mask, and its numbers."""
    for number, line in enumerate(text_of(file).rstrip().splitlines(), 1):
        place = f"{file}, line {number}"
        yield place, line.startswith("m"), numbers_of(line.removeprefix("m"), place)


def _binary(file: Path) -> Iterator[tuple[str, bool, list[float]]]:
    """The same of a file of the toolkit's: version and length, and by region a kind and numbers."""
    try:
        data = file.read_bytes()
    except OSError as error:
        raise ExchangeError(f"{file}: this can't be read ({error.strerror}).") from error
    at = 0

    def read(form: str, place: str) -> tuple[float, ...]:
        nonlocal at
        try:
            values = struct.unpack_from(f"<{form}", data, at)
        except struct.error:
            raise ExchangeError(f"{place}: the file ends in it. Get it anew.") from None
        at += struct.calcsize(f"<{form}")
        return values

    version, length = read("hI", f"{file}, its head")
    if version != 1:
        raise ExchangeError(f"{file}: this is of version {version}; version 1 is read.")
    for number in range(1, int(length) + 1):
        place = f"{file}, region {number}"
        (kind,) = read("B", place)
        if kind == 0:
            yield place, False, list(read("I", place))
        elif kind == 1:
            yield place, False, list(read("4f", place))
        elif kind == 2:
            (points,) = read("H", place)
            yield place, False, list(read(f"{2 * int(points)}f", place))
        elif kind == 3:
            *part, runs = read("hhHHH", place)
            yield place, True, [*part, *read(f"{int(runs)}H", place)]
        else:
            raise ExchangeError(f"{place}: there is no kind {kind} of regions. Get the file anew.")
    if behind := len(data) - at:
        raise ExchangeError(f"{file}: there are {behind} bytes behind its {length} regions.")


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
    """Files of a run; one in one pass with confidences is in two experiments.

    So one of them holds all trackers: those that gave confidences, and those that gave none.
    """
    if said.states is not None:
        return written(folder / SUPERVISED, sequence, repetition, said)
    made = dict(written(folder / ONE_PASS, sequence, repetition, said))
    if said.confidence is not None and np.isfinite(said.confidence).any():
        made |= written(folder / LONG_TERM, sequence, repetition, said)
    return made


def written(place: Path, sequence: str, repetition: int, said: Said) -> Mapping[Path, str]:
    """Text of a run with a region a line, and its confidences, in the folder of an experiment."""
    confident = said.confidence is not None and bool(np.isfinite(said.confidence).any())
    name = file_name(sequence)
    path = place / name / f"{name}_{repetition + 1:03}.txt"
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
