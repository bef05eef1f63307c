"""Ground truth in a CSV file: `frame,x,y,width,height`, one row a frame.

Frames count from 0, boxes are in pixels from the image's left top corner. A frame without
a row, or whose box is empty, has no target in it; the last row ends the sequence. Two more
columns may follow: `visibility`, the visible fraction in [0, 1], and `source`, which says
whether a box was `marked` by somebody or `interpolated`. Lines beginning with `#` are
comments.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.decoding import quote
from trackmark.datasets.interface import SequenceError

COLUMNS = ["frame", "x", "y", "width", "height"]
OPTIONAL = ["visibility", "source"]
HEADER = f"{','.join(COLUMNS)} (then {', '.join(OPTIONAL)} where wanted)"
SOURCES = ["marked", "interpolated", ""]

# What truth files of other formats are called: `groundtruth.txt`, `cup_gt.txt`, `boxes.json`, …
_LIKELY = re.compile(r"truth|rect|annot|bbox|boxes|(^|[^a-z])gt([^a-z]|$)")
_LIKELY_SUFFIXES = (".txt", ".csv", ".json", ".xml", ".mat", ".tsv")

# 90 hours at 30 frames a second: a greater number is no frame's, and would fill the memory.
MOST_FRAMES = 10_000_000


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """What is true of the target in every frame."""

    # `[x, y, width, height]` in pixels; a NaN row where the target is absent; shape (n, 4)
    boxes: NDArray[np.float64]
    # visible fraction in [0, 1]; NaN where unknown; shape (n,), or None
    visibility: NDArray[np.float64] | None = None
    # `marked` or `interpolated` for every frame; empty where that is not said
    sources: tuple[str, ...] | None = None


def given_or_own(given: Path | None, own: Path) -> tuple[GroundTruth | None, Path | None]:
    """GroundTruth and its file: the given one, else the data's own where it exists."""
    path = given or (own if own.is_file() else None)
    return (None, None) if path is None else (read(path), path)


def missing(own: Path, stem: str = "") -> str:
    """A sentence on a file beside, of a name such as truth has, that isn't read.

    `own`: The truth file that would be read. `stem`: Files of this name count, too, whatever their
    suffix among those of truths.
    """
    if own.is_file():
        return ""
    likely = sorted(
        file
        for file in own.parent.iterdir()
        if file.suffix.lower() in _LIKELY_SUFFIXES
        and (file.stem == stem or _LIKELY.search(file.name.lower()))
    )
    if not likely:
        return ""
    columns = ",".join(COLUMNS)
    return f"{likely[0]} is of a format that isn't read; expected is {own.name} with {columns}."


def read(path: Path) -> GroundTruth:
    """Read a truth file.

    Raises `SequenceError` naming file and line of the first thing that is wrong, and what is
    expected there.
    """
    header: list[str] = []
    rows: list[_Row] = []
    for line, text in enumerate(read_text(path).splitlines(), 1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        cells = [cell.strip() for cell in text.split(",")]
        try:
            if header:
                rows.append(_row(header, cells, after=rows[-1].frame if rows else -1))
            else:
                header = _header(cells)
        except ValueError as error:
            raise SequenceError(f"{path}: line {line}: {error}.") from None
    if not rows:
        raise SequenceError(
            f"{path}: there are no rows; expected are the header {HEADER} and rows."
        )
    n = rows[-1].frame + 1
    boxes, visibility, sources = np.full((n, 4), nan), np.full(n, nan), [""] * n
    for frame, box, visible, source in rows:
        boxes[frame], visibility[frame], sources[frame] = box, visible, source
    return GroundTruth(
        boxes,
        visibility if "visibility" in header else None,
        tuple(sources) if "source" in header else None,
    )


def write(path: Path, truth: GroundTruth, comments: Iterable[str] = ()) -> None:
    """Write a truth file; `read` gives the same values back, to the bit.

    `path`: Is replaced where it exists. `truth`: A frame without target gets a row with an empty
    box. `comments`: Lines put before the header.
    """
    n = len(truth.boxes)
    columns: dict[str, list[str]] = {"frame": [str(frame) for frame in range(n)]}
    for name, values in zip(COLUMNS[1:], truth.boxes.T, strict=True):
        columns[name] = [_text(value) for value in values.tolist()]
    if truth.visibility is not None:
        columns["visibility"] = [_text(value) for value in truth.visibility.tolist()]
    if truth.sources is not None:
        columns["source"] = list(truth.sources)
    # Names of files stand in them, which may hold ends of lines, or bytes that are no text.
    lines = [f"# {' '.join(comment.splitlines())}".rstrip() for comment in comments]
    lines.append(",".join(columns))
    lines += [",".join(row) for row in zip(*columns.values(), strict=True)]
    text = "\n".join(lines) + "\n"
    path.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def read_text(path: Path) -> str:
    """Text of a file of truth or attributes, whatever byte order mark and line ends it has.

    Raises `SequenceError` for a file that can't be read or holds no text.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise SequenceError(f"{path}: this can't be read ({error.strerror}).") from error
    except UnicodeDecodeError:
        raise SequenceError(f"{path}: this is no text in UTF-8. Save it as such.") from None


class _Row(NamedTuple):
    frame: int
    box: list[float]
    visibility: float
    source: str


def _header(cells: list[str]) -> list[str]:
    extra = cells[len(COLUMNS) :]
    if cells[: len(COLUMNS)] != COLUMNS or extra not in ([], *([x] for x in OPTIONAL), OPTIONAL):
        raise ValueError(f"{quote(','.join(cells))} is not the header; expected is {HEADER}")
    return cells


def _row(header: list[str], cells: list[str], after: int) -> _Row:
    if len(cells) != len(header):
        raise ValueError(f"{len(cells)} values for the {len(header)} columns {','.join(header)}")
    values: Mapping[str, str] = dict(zip(header, cells, strict=True))
    number = values["frame"]
    if not (number.isdecimal() and len(number) < 20 and int(number) < MOST_FRAMES):
        raise ValueError(f"{quote(number)} is not a frame number; they count from 0")
    frame = int(number)
    if frame <= after:
        raise ValueError(f"frame {frame} follows frame {after}; each stands once, in rising order")
    texts = [values[column] for column in COLUMNS[1:]]
    box = [_number(text) for text in texts] if any(texts) else [nan] * 4
    if box[2] <= 0.0 or box[3] <= 0.0:
        raise ValueError(f"the box of frame {frame} has no size; leave it empty if it is absent")
    visibility = _number(values["visibility"]) if values.get("visibility") else nan
    if visibility < 0.0 or visibility > 1.0:
        raise ValueError(f"visibility {visibility} of frame {frame} is not in [0, 1]")
    source = values.get("source", "")
    if source not in SOURCES:
        raise ValueError(f"source {quote(source)} of frame {frame} is not marked or interpolated")
    return _Row(frame, box, visibility, source)


def _number(text: str) -> float:
    try:
        number = float(text) if "_" not in text else nan  # Python takes 1_0 for ten
    except ValueError:
        number = nan
    if not isfinite(number):
        raise ValueError(f"{quote(text)} is not a number")
    return number


def _text(value: float) -> str:
    return "" if value != value else repr(value).removesuffix(".0")
