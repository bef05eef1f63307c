"""Reader of the layouts that `datasets/layouts.toml` describes completely."""

import json
import re
from collections.abc import Callable, Iterator, Mapping
from fnmatch import fnmatchcase
from functools import lru_cache
from glob import escape
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets import truth_file
from trackmark.datasets.decoding import quote
from trackmark.datasets.file_digest import file_stamp
from trackmark.datasets.image_files import (
    check_frame_numbers,
    digits_of_name,
    image_files,
    numbered_images,
    size_of_first,
)
from trackmark.datasets.interface import Array, Sequence, SequenceError
from trackmark.datasets.layouts import BOX, CORNERS, Layout
from trackmark.datasets.number_files import (
    POLYGON,
    Fields,
    as_boxes,
    box_of_region,
    check_line,
    check_row_count,
    enclosing_boxes,
    frames_with_values,
    parse_numbers,
    read_flags,
    read_integers,
    read_lines,
    read_rows,
    split_line,
)
from trackmark.datasets.recorded import Choice, recorded
from trackmark.datasets.spec_string import natural_order
from trackmark.datasets.truth_file import MAX_FRAMES, GroundTruth

_POINTS = tuple(f"{axis}{number}" for number in range(1, 100) for axis in "xy")
# Other columns are flags. Those that mean neither presence nor absence are attributes.
_NUMBERS, _TEXTS = {*BOX, *CORNERS, *_POINTS, "frame", "last"}, ("-", "name")
_NO_ATTRIBUTES = {*_NUMBERS, "absent", "present", "flag"}
_FLAG_WORDS = {"0": 0.0, "1": 1.0, "absent": 0.0, "present": 1.0}

_Line = tuple[int, str]  # number of the line, and its text


class _Location(NamedTuple):
    """Files of a sequence."""

    root: Path  # folder of the data set
    name: str
    value: str  # of the layout's option
    images: Path  # folder or video; the root if a JSON file names the images
    truth: Path


class _Rows(NamedTuple):
    """Rows of a file of ground truth."""

    boxes: Array  # shape (n, 4): x, y, width and height as in the file
    columns: Mapping[str, Array]  # other columns by name, each of shape (n,)
    lines: list[int]  # number of the line of each row


class RowsReader:
    """Reader of one layout; see `readers.Reader`."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        # one file with the ground truth of all sequences
        self._is_shared = not any("NAME" in path for path in layout.truth)

    def recognises(self, path: Path) -> bool:
        """Return whether a path without symbolic links belongs to a sequence of this layout."""
        return bool(self._locate(path))

    def choice(self, path: Path) -> Choice:
        """Return the option of the layout."""
        if not self.layout.option:
            return Choice()
        values = list(self._locate(path.resolve()))
        unit = " [frames/s]" if self.layout.fps == "option" else ""
        return Choice(self.layout.option, values, values[0], unit, is_target=False)

    def list_members(self, folder: Path) -> list[Path]:
        """Return the sequences of a set whose sequences are not its folders.

        Images without ground truth are omitted if several sequences can share a folder.
        """
        layout, names = self.layout, set[str]()
        parents = [folder / re.split("NAME|FOLDER", path)[0] for path in layout.images]
        if folder in parents or not all(parent.is_dir() for parent in parents):
            return []
        for pattern in layout.truth:
            for file in [] if names else folder.glob(self._filled(pattern, folder, "*")):
                match = (name for _, name in _match(pattern, file.absolute()))
                names.update(self._raw_truth(file) if self._is_shared else match)
        for pattern in layout.images:
            if "FOLDER" not in pattern and (folder / layout.truth[0]).parent.is_dir():
                names |= {path.name for path in folder.glob(self._filled(pattern, folder, "*"))}
        is_folder = bool(layout.images) and layout.images[0].endswith("/NAME")
        path = layout.images[0] if is_folder else "NAME"
        return [folder / path.replace("NAME", n) for n in sorted(names, key=natural_order)]

    def read(self, path: Path, truth: Path | None, value: str) -> Sequence:
        """Open the sequence; its flags are attributes."""
        layout, locations = self.layout, self._locate(path.resolve())
        value = value or next(iter(locations))
        location = locations[value]
        name = location.name
        if layout.option and value != layout.values[0]:
            name = f"{name}:{layout.option}={value}"
        fields = Fields(self._file(location, layout.fields))
        fps = float(value) if layout.fps == "option" else fields.fps(layout.fps)
        if truth is not None:
            images = self._images(location, None)
            return recorded(name, images, truth_file.read(truth), truth, fps=fps)
        rows = self._json_rows(location) if layout.json_keys else self._text_rows(location)
        images = self._images(location, rows)
        ground_truth, attributes = self._ground_truth(location, rows, images)
        return recorded(
            name,
            images,
            ground_truth,
            location.truth,
            fps=fps,
            attributes=attributes,
            description=self._description(location, fields),
        )

    def _description(self, location: _Location, fields: Mapping[str, str]) -> str:
        keys = self.layout.description
        if self.layout.fields:
            return ", ".join(filter(None, (fields.get(key, "") for key in keys.split())))
        file = self._file(location, keys)
        return " ".join(truth_file.read_text(file).split()) if keys and file.is_file() else ""

    def _locate(self, full: Path) -> dict[str, _Location]:
        """Return the files of a sequence by value of the option; none for another layout.

        `full` is the path without symbolic links.
        """
        layout, locations = self.layout, dict[str, _Location]()
        pairs = list(product(layout.images or (".",), layout.truth))
        for value, (images, truth) in product(layout.values or ("",), pairs):
            for root, name in _candidates(full, images, truth, value):
                source = self._existing(root, truth, name, value)
                folder = source and self._existing(root, images, name, value)
                if not (folder and source and source.is_file() and self._is_marked(root, name)):
                    continue
                # The reader of image folders opens a folder with a `truth.csv`.
                is_other = (folder / "truth.csv").is_file()
                is_empty = len(layout.images) > 1 and folder.is_dir() and not image_files(folder)
                is_listed = not self._is_shared or name in self._raw_truth(source)
                if is_listed and not (is_other or is_empty):
                    locations.setdefault(value, _Location(root, name, value, folder, source))
        return locations

    def _existing(self, root: Path, pattern: str, name: str, value: str) -> Path | None:
        """Return the only path of a pattern, or None."""
        filled = self._filled(pattern, root, name, value)
        paths = [*root.glob(filled)] if "*" in pattern else [root / filled]
        return paths[0] if len(paths) == 1 and paths[0].exists() else None

    def _is_marked(self, root: Path, name: str) -> bool:
        """Return whether a sequence has one of the files that mark the layout."""
        marks = (root / self._filled(mark, root, name) for mark in self.layout.marks)
        is_named = fnmatchcase(name, self.layout.marked_names)
        return not self.layout.marks or is_named or any(mark.is_file() for mark in marks)

    def _filled(self, pattern: str, root: Path, name: str, value: str = "*") -> str:
        """Return a pattern with names instead of its words in capitals."""
        if "*" in pattern and name != "*":
            name = escape(name)
        folder = "*" if name == "*" else self._folder(name)
        for word, text in (("OPTION", value), ("FOLDER", folder), ("SET", root.name)):
            pattern = pattern.replace(word, text)
        return pattern.replace("NAME", name)

    def _file(self, location: _Location, pattern: str) -> Path:
        filled = self._filled(pattern, location.root, location.name, location.value)
        return location.root / filled

    def _folder(self, name: str) -> str:
        """Return the folder of the images of a sequence: `bird1` for `bird1_2`."""
        is_part = self._image_range(name) is not None or (
            self._is_shared and not self.layout.image_ranges
        )
        return name.rpartition("_")[0] if is_part else name

    def _image_range(self, name: str) -> tuple[int, int] | None:
        """Return the first and the last image of a part of a folder; None for a whole folder."""
        folder, _, index = name.rpartition("_")
        ranges = self.layout.image_ranges.get(folder, ())
        is_index = index.isascii() and index.isdecimal() and len(index) < 3
        return ranges[int(index) - 1] if is_index and 1 <= int(index) <= len(ranges) else None

    def _images(self, location: _Location, rows: _Rows | None) -> list[Path] | Path:
        """Return the images in order, or the video."""
        layout, folder = self.layout, location.images
        if layout.json_keys.get("images"):
            return self._named_images(location)
        if folder.is_file():
            return folder
        source, span = self._range(location, rows)
        if span is None:
            return numbered_images(folder, *layout.first_image, names=layout.image_names)
        files = image_files(folder)
        check_frame_numbers(files)
        digits = {file: digits_of_name(file, layout.image_names) for file in files}
        by_number = {int(number): file for file, number in digits.items() if number}
        for image_number in range(span[0], span[1] + 1):
            if image_number not in by_number:
                raise SequenceError(
                    f"{source}: there is no image {image_number} in {folder}. Expected: images "
                    f"{span[0]} to {span[1]} of {location.name}. Add the image, "
                    "or correct the range."
                )
        return [by_number[image_number] for image_number in range(span[0], span[1] + 1)]

    def _range(
        self, location: _Location, rows: _Rows | None
    ) -> tuple[Path, tuple[int, int] | None]:
        """Return the first and the last image, or None for all, and the file that states them."""
        if self.layout.range:
            source = self._existing(location.root, self.layout.range, location.name, location.value)
            if source is None:
                raise SequenceError(f"{location.truth}: there is no {self.layout.range}.")
            row = read_rows(source, {2}, "the numbers of the first and the last image", "a range")
            first, last = row[-1]
            if len(row) > 1 or not first <= last:
                raise SequenceError(f"{source}: expected: one line, FIRST,LAST.")
            return source, (int(first), int(last))
        if self._is_shared and rows is not None and "frame" in rows.columns:
            last = rows.columns.get("last", rows.columns["frame"]).max()
            return location.truth, (int(rows.columns["frame"].min()), int(last))
        is_part = location.images.name != location.name
        return location.images, self._image_range(location.name) if is_part else None

    def _named_images(self, location: _Location) -> list[Path]:
        """Return the images that a JSON file names, relative to the folder of the data set."""
        names = self._json_list(location, self.layout.json_keys["images"])
        files = [location.root / str(name) for name in names]
        for file in files:
            is_inside = file.is_relative_to(location.root) and ".." not in file.parts
            if not (is_inside and file.is_file()):
                raise SequenceError(
                    f"{location.truth}: there is no image {quote(str(file))} in this folder, which "
                    f"{location.name} needs. Add it."
                )
        return files

    def _ground_truth(
        self, location: _Location, rows: _Rows, images: list[Path] | Path
    ) -> tuple[GroundTruth, dict[str, NDArray[np.bool_]]]:
        """Return the ground truth and the attributes of all frames up to the last row."""
        layout, source = self.layout, location.truth
        boxes, annotated = self._boxes(rows, source, images)
        attributes = {key: x > 0 for key, x in rows.columns.items() if key not in _NO_ATTRIBUTES}
        if "frame" in rows.columns:
            assign = self._assignment(rows, source, images)
            boxes, annotated = assign(boxes), assign(annotated)
            attributes = {key: assign(flags) for key, flags in attributes.items()}
        elif isinstance(images, list):
            check_row_count(len(boxes), images, source)
        n = frames_with_values(len(boxes), images) if isinstance(images, list) else len(boxes)
        for path, meaning in layout.flags.items():
            for key, flags in read_flags([self._file(location, path)], n).items():
                attributes[key] = flags
                if meaning != "attribute":
                    boxes[(flags == (meaning == "absent"))[: len(boxes)]] = np.nan
        cover, visibility = self._file(location, layout.visibility), None
        if layout.visibility and cover.is_file():
            values = np.array(layout.visibility_values)
            visibility = values[read_integers(cover, n, len(values) - 1)]
        return GroundTruth(boxes, visibility, annotated=annotated), attributes

    def _boxes(
        self, rows: _Rows, source: Path, images: list[Path] | Path
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return boxes from 0, and flags of the rows that state a box or absence."""
        boxes, annotated = rows.boxes, np.ones(len(rows.boxes), np.bool_)
        if self.layout.unit == "image size":
            if isinstance(images, Path):
                raise SequenceError(
                    f"{images}: boxes as shares of the image size need image files."
                )
            boxes = boxes * np.tile(size_of_first(images), 2)
        if self.layout.zero == "not annotated":
            annotated = (boxes != 0.0).any(axis=1)
            boxes = np.where(annotated[:, None], boxes, np.nan)
        is_absence = self.layout.zero != "malformed"
        boxes = as_boxes(boxes, source, self.layout.first_pixel, zero_is_absent=is_absence)
        if "present" in rows.columns:
            is_present = rows.columns["present"] > 0.0
            annotated &= np.isfinite(boxes).all(axis=1) | ~is_present
            boxes[~is_present] = np.nan
        if "absent" in rows.columns:
            boxes[rows.columns["absent"] > 0.0] = np.nan
        return boxes, annotated

    def _assignment(
        self, rows: _Rows, source: Path, images: list[Path] | Path
    ) -> Callable[[NDArray[Any]], NDArray[Any]]:
        """Return the function that converts values of rows to values of frames."""
        names, step = self.layout.image_names, self.layout.rows_per_image
        files = images if isinstance(images, list) else []
        first = int(digits_of_name(files[0], names) or 0) if files else 0
        _check_frames(rows, source, self.layout.frames, first)
        frames, n = (rows.columns["frame"] - first).astype(np.int64), len(rows.lines)
        if self.layout.frames == "sparse":
            return lambda values: _spread(values, frames)
        is_thinned = files and abs(n - step * len(files)) < step
        return lambda values: values[::step][: len(files)] if is_thinned else values

    def _raw_truth(self, source: Path) -> Mapping[str, Any]:
        """Return the content of a JSON file, or the lines of all sequences in a file by name."""
        stamp, names = file_stamp(source), self.layout.columns.split()
        columns = tuple(index for index, name in enumerate(names) if name == "name")
        is_json = bool(self.layout.json_keys)
        raw_truth = _read_json(source, stamp) if is_json else _lines_by_name(source, stamp, columns)
        for name in raw_truth if self._is_shared else ():
            if "\0" in name or Path(name).name != name:
                raise SequenceError(
                    f"{source}: {quote(name)} is not a name of a sequence. Download the file again."
                )
        return raw_truth

    def _json_list(self, location: _Location, key: str) -> list[Any]:
        """Return a list of a JSON file."""
        json_object = self._raw_truth(location.truth)
        json_object = json_object[location.name] if self._is_shared else json_object
        values = json_object.get(key) if isinstance(json_object, dict) else None
        if not isinstance(values, list):
            raise SequenceError(f"{location.truth}: there is no list {key!r} of {location.name}.")
        return values

    def _json_rows(self, location: _Location) -> _Rows:
        """Return the boxes of a JSON file; an empty list is a frame without a box."""
        keys, rows, columns = self.layout.json_keys, list[list[float]](), {}
        for frame, row in enumerate(self._json_list(location, keys["boxes"])):
            values = parse_numbers(
                " ".join(map(str, row or [np.nan] * 4)) if isinstance(row, list) else ""
            )
            if len(values) not in (4, POLYGON):
                raise SequenceError(
                    f"{location.truth}: {keys['boxes']} of frame {frame} is {quote(str(row))}. "
                    "Expected: x, y, width, height, or the four corners of a polygon."
                )
            rows.append(box_of_region(values))
        if "present" in keys:
            flags = self._json_list(location, keys["present"])
            if len(flags) != len(rows) or not {*map(str, flags)} <= {"0", "1"}:
                raise SequenceError(
                    f"{location.truth}: {keys['present']} has {len(flags)} values for {len(rows)} "
                    "boxes. Expected: 0 or 1 for each box."
                )
            columns["present"] = np.array(flags, np.float64)
        return _Rows(np.reshape(rows, (-1, 4)), columns, [])

    def _text_rows(self, location: _Location) -> _Rows:
        """Return the rows of a text file."""
        source, columns = location.truth, self.layout.columns.split()
        is_open = columns[-1] == "..."
        columns = columns[: len(columns) - is_open]
        lines = self._raw_truth(source)[location.name] if self._is_shared else read_lines(source)
        rows: list[list[float]] = []
        for line_number, line in lines:
            row_text = " ".join(line.split()[: len(columns)]) if is_open else line
            check_line(row_text, line_number, source)
            row = _values(split_line(row_text), columns)
            if not row:
                row_name = "box" if columns == [*BOX] else f"row of {self.layout.title}"
                raise SequenceError(
                    f"{source}: line {line_number}: {quote(line.strip())} is not a {row_name}. "
                    f"Expected: {self.layout.columns}."
                )
            rows.append(row)
        names = [name for name in columns if name not in _TEXTS]
        table = dict(zip(names, np.array(rows).T, strict=True))
        return _Rows(_as_rows(table), table, [line_number for line_number, _ in lines])


def _candidates(full: Path, images: str, truth: str, value: str) -> Iterator[tuple[Path, str]]:
    """Yield the folders and names of which a path can be the sequence.

    The path is `ROOT/NAME`, or `images` up to its last NAME or OPTION. If several sequences share a
    folder of images, it can also be the file of the ground truth.
    """
    yield full.parent, full.name
    path_words = images.split("/")
    for n in range(1, len(path_words) + 1):
        pattern = "/".join(path_words[:n])
        if path_words[n - 1] in ("NAME", "FOLDER", "OPTION") and pattern != "NAME":
            yield from _match(pattern.replace("OPTION", value), full)
    if "FOLDER" in images and "NAME" in truth:
        yield from _match(truth, full)


def _match(pattern: str, full: Path) -> Iterator[tuple[Path, str]]:
    """Yield the folder and the name with which a pattern gives a path, if there are any."""
    name_patterns = pattern.replace("FOLDER", "NAME").split("/")
    names = set()
    for name_pattern, actual in zip(name_patterns, full.parts[-len(name_patterns) :], strict=False):
        before, _, after = name_pattern.partition("NAME")
        if "NAME" in name_pattern and actual.startswith(before) and actual.endswith(after):
            names.add(actual[len(before) : len(actual) - len(after)])
        elif "NAME" in name_pattern or not fnmatchcase(actual, name_pattern):
            return
    if len(names) == 1 and "" not in names and len(full.parts) > len(name_patterns):
        yield full.parents[len(name_patterns) - 1], names.pop()


def _spread(values: NDArray[Any], frames: NDArray[np.int64]) -> NDArray[Any]:
    """Return values for all frames up to the last row: NaN or False in frames without a row."""
    fill = np.nan if values.dtype == np.float64 else False
    spread = np.full((frames[-1] + 1, *values.shape[1:]), fill, values.dtype)
    spread[frames] = values
    return spread


def _values(cells: list[str], columns: list[str]) -> list[float]:
    """Return the numbers of a row, without columns of text; empty for an invalid row."""
    if len(cells) != len(columns):
        return []
    row: list[float] = []
    for cell, column in zip(cells, columns, strict=True):
        if column not in _TEXTS:
            value = parse_numbers(cell) if column in _NUMBERS else [_FLAG_WORDS.get(cell, np.nan)]
            if len(value) != 1 or (column not in _NUMBERS and np.isnan(value[0])):
                return []
            row += value
    return row


def _as_rows(table: Mapping[str, Array]) -> Array:
    """Return rows x, y, width, height of columns with boxes, corners or points."""
    if "width" in table:
        return np.column_stack([table[name] for name in BOX])
    if "left" in table:
        left, top, right, bottom = (table[name] for name in CORNERS)
        return np.column_stack([left, top, right - left, bottom - top])
    return enclosing_boxes(np.column_stack([table[name] for name in _POINTS if name in table]))


def _check_frames(rows: _Rows, source: Path, spacing: str, first: int) -> None:
    """Check that the frame numbers increase, and have no gap if they are not sparse.

    Raises `SequenceError` naming the line.
    """
    frames, remedy = rows.columns["frame"], "Add the missing row, or download the file again."
    steps = np.diff(frames)
    usual_step = steps.min(initial=MAX_FRAMES) if spacing == "regular" and len(steps) else 1.0
    for line, frame, step in zip(rows.lines[1:], frames[1:], steps, strict=True):
        if step <= 0.0 or (spacing != "sparse" and step != usual_step):
            raise SequenceError(
                f"{source}: line {line}: frame {frame:g} follows frame {frame - step:g}, but other "
                f"rows are {usual_step:g} apart. {remedy}"
            )
    last_start = {"consecutive": first, "regular": max(usual_step - 1, 1)}.get(spacing, MAX_FRAMES)
    is_number = (frames % 1 == 0).all() and frames[-1] < MAX_FRAMES
    if not (is_number and (0 if spacing == "regular" else first) <= frames[0] <= last_start):
        raise SequenceError(
            f"{source}: line {rows.lines[0]}: frame {frames[0]:g} is the first. Expected: whole "
            f"numbers from {first}. {remedy}"
        )


@lru_cache(maxsize=4)
def _read_json(source: Path, stamp: tuple[int, int]) -> Mapping[str, Any]:
    """Read a JSON object; see `file_stamp`."""
    try:
        json_object = json.loads(truth_file.read_text(source))
    except (json.JSONDecodeError, RecursionError) as error:
        raise SequenceError(f"{source}: {error}. Download the file again.") from None
    if not isinstance(json_object, dict):
        raise SequenceError(f"{source}: this is not a JSON object. Download the file again.")
    return json_object


@lru_cache(maxsize=4)
def _lines_by_name(
    source: Path, stamp: tuple[int, int], columns: tuple[int, ...]
) -> Mapping[str, list[_Line]]:
    """Return the lines of each sequence, whose name is in these columns, joined by `_`."""
    lines: dict[str, list[_Line]] = {}
    for line_number, line in enumerate(truth_file.read_text(source).rstrip().splitlines(), 1):
        cells = split_line(line)
        name = "_".join(cells[column] for column in columns if column < len(cells))
        lines.setdefault(name, []).append((line_number, line))
    return lines
