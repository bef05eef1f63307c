"""Layouts of recorded data: where images and ground truth are, and how a row is read.

`layouts.toml` has a table for each data set, and users add theirs with `--layout FILE`. The first
layout that fits a path reads it. docs/datasets.md explains the fields.
"""

import os
import tomllib
from functools import cache
from pathlib import Path, PurePath
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from trackmark.datasets.interface import SequenceError
from trackmark.datasets.truth_file import read_text

__all__ = ["LAYOUT_VARIABLE", "Layout", "OfficialSet", "layouts"]

LAYOUT_VARIABLE = "TRACKMARK_LAYOUT"
"""Environment variable with the file of the user's layouts, which worker processes inherit."""

Texts = Annotated[
    tuple[str, ...], BeforeValidator(lambda value: [value] if isinstance(value, str) else value)
]
"""List of texts, or one text."""


BOX, CORNERS = ("x", "y", "width", "height"), ("left", "top", "right", "bottom")


class OfficialSet(BaseModel):
    """Published set of sequences, such as a benchmark or its test set."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    size: int  # number of sequences
    # names of the sequences, separated by spaces; or one with a format of a number from 1
    names: str = ""

    def sequence_names(self) -> frozenset[str]:
        """Return the names of the sequences; empty if they are unknown."""
        if "{" in self.names:
            return frozenset(self.names.format(number) for number in range(1, self.size + 1))
        return frozenset(self.names.split())


class Layout(BaseModel):
    """Layout of a data set. In paths, NAME is the name of a sequence; see docs/datasets.md.

    Paths are relative to the folder of the data set. Of several paths, the first that exists is
    used.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str = ""  # name of the data set in messages
    reader: str = ""  # module of `datasets.readers` that reads the layout by code of its own
    expects: str = ""  # layout in words; by default from the paths
    images: Texts = ()  # folders or video files
    image_names: str = "#"  # names without suffix; # is the number, * any text without order
    first_image: tuple[int, ...] = ()  # valid numbers of the first image; by default all
    truth: Texts = ()  # files of the ground truth
    columns: str = "x y width height"
    json_keys: dict[str, str] = {}  # keys of a JSON file: boxes, present, images
    frames: Literal["consecutive", "regular", "sparse"] = "consecutive"  # of a column `frame`
    rows_per_image: int = Field(1, ge=1)  # in some files; only each first of so many rows is used
    unit: Literal["pixels", "image size"] = "pixels"
    first_pixel: Literal[0, 1] = 0  # see `Origin.first_pixel`
    zero: Literal["absent", "malformed", "not annotated"] = "absent"  # meaning of a size of 0
    flags: dict[str, Literal["absent", "present", "attribute"]] = {}  # meaning of 1, by file
    visibility: str = ""  # file with indices of `visibility_values`
    visibility_values: tuple[float, ...] = ()
    range: str = ""  # file with the numbers of the first and the last image
    # image numbers (first, last) of FOLDER_1, FOLDER_2, …, by FOLDER
    image_ranges: dict[str, tuple[tuple[int, int], ...]] = {}
    option: str = ""  # name of an option whose value replaces OPTION in paths
    values: tuple[str, ...] = ()  # values of the option, the default first
    marks: Texts = ()  # of these files, a sequence has at least one
    marked_names: str = ""  # pattern of names that need no such file
    fields: str = ""  # file with lines `key: value`
    fps: str = ""  # key of the frame rate in `fields`, or `option`
    description: str = ""  # keys of the description in `fields`, or a text file
    prefix: str = ""  # text that toolkits write before the names in result files
    sets: tuple[OfficialSet, ...] = ()
    citation: str = ""
    licence: str = ""

    @model_validator(mode="after")
    def _check_fields(self) -> "Layout":
        """Check that the paths are stated and that the columns contain a box."""
        if not (self.reader or (self.truth and (self.images or "images" in self.json_keys))):
            raise ValueError("the paths are missing. Expected: paths of the images and the truth")
        columns = set(self.columns.split())
        if not any(columns.issuperset(names) for names in (BOX, CORNERS, ("x1", "y1", "x2", "y2"))):
            raise ValueError(
                f"columns is {self.columns!r}. Expected: {' '.join(BOX)}, {' '.join(CORNERS)}, or "
                "points x1 y1 x2 y2 …"
            )
        return self

    @property
    def in_words(self) -> str:
        """Layout in words, for messages and metadata."""
        name = f" ({self.title})" if self.title else ""
        if self.expects:
            return f"{self.expects}{name}"
        images, truth = (
            " or ".join(path.removeprefix("NAME/") for path in paths)
            for paths in (self.images, self.truth)
        )
        folder = "a folder of images" if images == "NAME" else f"a folder with {images}/"
        return f"{folder} and {truth}{name}"

    @property
    def all_marks(self) -> list[str]:
        """Patterns of files and folders of a sequence's folder; a folder with one is incomplete.

        Patterns of folders end with `/`.
        """
        if self.reader:
            paths = list(self.marks)
        else:
            paths = [f"{path}/" for path in self.images if not PurePath(path).suffix]
            paths += [*self.marks, *self.truth, self.range, *self.flags]
        inside = [path.removeprefix("NAME/") for path in paths if path.startswith("NAME/")]
        values = self.values or ("",)
        inside = [path.replace("OPTION", value) for path in inside if path for value in values]
        return inside if self.reader else [path.replace("*", "NAME") for path in inside]


def layouts() -> dict[str, Layout]:
    """Return all layouts by name, those of the user first.

    Raises `SequenceError` for a wrong file of the user, naming table and field.
    """
    file = os.environ.get(LAYOUT_VARIABLE, "")
    built_in = _read(Path(__file__).with_name("layouts.toml"), 0)
    return {**_read(Path(file), Path(file).stat().st_mtime_ns), **built_in} if file else built_in


@cache
def _read(path: Path, changed: int) -> dict[str, Layout]:
    """Read a file of layouts; `changed` is its modification time, so that edits are noticed."""
    try:
        tables: dict[str, Any] = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise SequenceError(f"{path}: {error}.") from None
    return {name: _layout(path, name, table) for name, table in tables.items()}


def _layout(path: Path, name: str, table: Any) -> Layout:
    try:
        return Layout.model_validate({"title": name, **table})
    except ValidationError as error:
        first: Any = error.errors(include_url=False)[0]
        field = ".".join(map(str, first["loc"])) or "images, truth"
        message = first["msg"].removeprefix("Value error, ").rstrip(".")
        raise SequenceError(f"{path}: [{name}] {field}: {message}.") from None
    except TypeError:
        raise SequenceError(f"{path}: {name} is not a table. Expected: [{name}].") from None
