"""Ground truth in a CSV file: `frame,x,y,width,height`, one row per frame.

Frames count from 0. Boxes are in pixels from the upper left corner of the image. An empty box
states that the target is absent. A frame without a row is not annotated: it is shown to trackers,
but not scored. The last row ends the sequence, unless the file has only one row, as in test sets.
There are two optional columns: `visibility` is the visible fraction in [0, 1]; `source` is `marked`
for a box that was marked by hand, or `interpolated`. Lines that start with `#` are comments.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.decoding import quote
from trackmark.datasets.interface import Array, SequenceError

COLUMNS = ["frame", "x", "y", "width", "height"]
OPTIONAL = ["visibility", "source"]
HEADER = f"{','.join(COLUMNS)} (optionally followed by {', '.join(OPTIONAL)})"
SOURCES = ["marked", "interpolated", ""]

# Names of ground-truth files in other formats: `groundtruth.txt`, `cup_gt.txt`, `boxes.json`, …
_LIKELY_NAME = re.compile(r"truth|rect|annot|bbox|boxes|(^|[^a-z])gt([^a-z]|$)")
_LIKELY_SUFFIXES = (".txt", ".csv", ".json", ".xml", ".mat", ".tsv")

# maximum number of frames, 90 hours at 30 frames/s, which limits the memory use
MAX_FRAMES = 10_000_000


_Row: TypeAlias = tuple[int, list[float], float, str]
"""Frame, box, visibility and source of a row."""


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """Ground truth of all frames of a sequence."""

    # shape (n, 4): `[x, y, width, height]` [pixels]; NaN if absent or not annotated
    boxes: Array
    # shape (n,): visible fraction in [0, 1]; NaN if unknown
    visibility: Array | None = None
    # `marked` or `interpolated` for each frame; empty if unknown
    sources: tuple[str, ...] | None = None
    # shape (n,): frames for which the file states box or absence; None for all
    annotated: NDArray[np.bool_] | None = None

    @property
    def annotated_frames(self) -> NDArray[np.bool_]:
        """Flags of the annotated frames, shape (n,)."""
        everywhere = np.ones(len(self.boxes), np.bool_)
        return everywhere if self.annotated is None else self.annotated


def read_given_or_default(
    truth: Path | None, default: Path, stem: str = ""
) -> tuple[GroundTruth | None, Path | None, str]:
    """Read the given file, or the default file if it exists; return ground truth and file.

    The third value is a sentence on a file next to a missing default file that looks like ground
    truth in another format, or has the name `stem`.
    """
    if default.is_file():
        return read(truth or default), truth or default, ""
    likely = sorted(
        file
        for file in default.parent.iterdir()
        if file.suffix.lower() in _LIKELY_SUFFIXES
        and (file.stem == stem or _LIKELY_NAME.search(file.name.lower()))
    )
    hint = ""
    if likely:
        columns = ",".join(COLUMNS)
        hint = f"The format of {likely[0]} is not read. Expected: {default.name} with {columns}."
    return None if truth is None else read(truth), truth, hint


def read(path: Path) -> GroundTruth:
    """Read a ground-truth file.

    Raises `SequenceError` naming file, line and expectation of the first mistake.
    """
    header: list[str] = []
    rows: list[_Row] = []
    for line, row_text in enumerate(read_text(path).splitlines(), 1):
        if not row_text.strip() or row_text.lstrip().startswith("#"):
            continue
        cells = [cell.strip() for cell in row_text.split(",")]
        try:
            if header:
                rows.append(_row(header, cells, after=rows[-1][0] if rows else -1))
            else:
                header = _header(cells)
        except ValueError as error:
            raise SequenceError(f"{path}: line {line}: {error}.") from None
    if not rows:
        raise SequenceError(
            f"{path}: there are no rows. Expected: the header {HEADER} and a row per frame."
        )
    n = rows[-1][0] + 1
    boxes, visibility, sources = np.full((n, 4), nan), np.full(n, nan), [""] * n
    annotated = np.zeros(n, np.bool_)
    for frame, box, visible, source in rows:
        boxes[frame], visibility[frame], sources[frame] = box, visible, source
        annotated[frame] = True
    return GroundTruth(
        boxes,
        visibility if "visibility" in header else None,
        tuple(sources) if "source" in header else None,
        None if annotated.all() else annotated,
    )


def write(path: Path, truth: GroundTruth, comments: Iterable[str] = ()) -> None:
    """Write or replace a ground-truth file; `read` returns bit-identical values.

    A frame without target has a row with an empty box, and a frame that is not annotated has no
    row. `comments` are lines before the header.
    """
    n = len(truth.boxes)
    columns: dict[str, list[str]] = {"frame": [str(frame) for frame in range(n)]}
    for name, values in zip(COLUMNS[1:], truth.boxes.T, strict=True):
        columns[name] = [_number_text(value) for value in values.tolist()]
    if truth.visibility is not None:
        columns["visibility"] = [_number_text(value) for value in truth.visibility.tolist()]
    if truth.sources is not None:
        columns["source"] = list(truth.sources)
    # Comments contain file names, which can contain line ends or bytes that are not UTF-8.
    lines = [f"# {' '.join(comment.splitlines())}".rstrip() for comment in comments]
    lines.append(",".join(columns))
    rows = zip(truth.annotated_frames, *columns.values(), strict=True)
    lines += [",".join(row) for is_annotated, *row in rows if is_annotated]
    csv_text = "\n".join(lines) + "\n"
    path.write_text(csv_text, encoding="utf-8", errors="backslashreplace", newline="\n")


def read_text(path: Path) -> str:
    """Return the text of a file, with or without byte order mark.

    Raises `SequenceError` for a file that cannot be read, or is not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise SequenceError(f"{path}: cannot be read ({error.strerror}).") from error
    except UnicodeDecodeError:
        raise SequenceError(f"{path}: not a text file in UTF-8. Save it in UTF-8.") from None


def _header(cells: list[str]) -> list[str]:
    extra = cells[len(COLUMNS) :]
    if cells[: len(COLUMNS)] != COLUMNS or extra not in ([], *([x] for x in OPTIONAL), OPTIONAL):
        raise ValueError(f"{quote(','.join(cells))} is not the header. Expected: {HEADER}")
    return cells


def _row(header: list[str], cells: list[str], after: int) -> _Row:
    if len(cells) != len(header):
        raise ValueError(f"{len(cells)} values for the {len(header)} columns {','.join(header)}")
    values: Mapping[str, str] = dict(zip(header, cells, strict=True))
    frame_text = values["frame"]
    if not (frame_text.isdecimal() and len(frame_text) < 20 and int(frame_text) < MAX_FRAMES):
        raise ValueError(f"{quote(frame_text)} is not a frame number. Frames count from 0")
    frame = int(frame_text)
    if frame <= after:
        raise ValueError(f"frame {frame} follows frame {after}. Expected: increasing numbers")
    values_of_box = [values[column] for column in COLUMNS[1:]]
    box = [_finite_number(value) for value in values_of_box] if any(values_of_box) else [nan] * 4
    if box[2] <= 0.0 or box[3] <= 0.0:
        raise ValueError(f"the box of frame {frame} has no size. An absent target has an empty box")
    visibility = _finite_number(values["visibility"]) if values.get("visibility") else nan
    if visibility < 0.0 or visibility > 1.0:
        raise ValueError(f"visibility {visibility} of frame {frame} is not in [0, 1]")
    source = values.get("source", "")
    if source not in SOURCES:
        raise ValueError(
            f"source {quote(source)} of frame {frame}. Expected: marked or interpolated"
        )
    return frame, box, visibility, source


def _finite_number(value: str) -> float:
    try:
        number = float(value) if "_" not in value else nan  # `float` would accept 1_0 as ten
    except ValueError:
        number = nan
    if not isfinite(number):
        raise ValueError(f"{quote(value)} is not a number")
    return number


def _number_text(value: float) -> str:
    return "" if value != value else repr(value).removesuffix(".0")
