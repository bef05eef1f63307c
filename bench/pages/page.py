"""Pages as HTML files: a template with the frames and boxes that its scripts read."""

import json
import os
import re
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import chain
from math import isfinite
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from numpy.typing import NDArray

from trackmark.bench.output_files import write_file
from trackmark.bench.package_version import package_version
from trackmark.bench.pages.content import FrameChunks, Page, PlayerSequence, Shapes, player_link
from trackmark.bench.pages.player_frames import (
    ABSENT,
    compress,
    pack_boxes,
    pack_frames,
    quantise,
)
from trackmark.reports.palette import DARK, DASHES, LIGHT, MARKER_PATHS, colour_index
from trackmark.reports.printable import one_line, with_minus
from trackmark.reports.svg import TOP, at_reference, chart_svg, dash_class
from trackmark.reports.tables import MISSING, text_columns

MAX_INLINE_FRAMES = 10_000_000
"""Size of the frames inside a page [bytes]; further frames are stored in separate files."""

_MIN_WRAPPED = 16
"""Minimum number of characters of a text in a table that is wrapped."""

_MIN_DIVIDED = 12
"""Minimum number of characters of a name that may be wrapped after a separator."""

GLOSSARY: Mapping[str, str] = {
    "overlap": "Overlap (IoU): area shared by the estimated and the ground-truth box, divided by "
    "the area that both cover. 1 is perfect, 0 is a miss.",
    "success": "Share of frames with an overlap of at least 0.5.",
    "centre error": "Distance between the centres of the estimated and the ground-truth box.",
    "ms/frame": "Mean time of an update, without the time in which other processes had the "
    "processor. The first update is not included.",
    "95 % interval": "Range that contains the mean over new sequences in 95 % of cases. It is "
    "drawn from six sequences on.",
    "lost": "The estimated centre is outside the ground-truth box for ten visible frames in a row.",
    "ground-truth box": "Box of the target in the ground truth: annotated, or known from "
    "rendering.",
    "seed": "Number that initialises the random generator of a stochastic tracker.",
}
"""Definitions of the terms of a page, for tooltips and the glossary."""

_SYMBOLS = {"good": "✓", "bad": "✕", "undecided": "?", "none": "–"}
"""Sign of each tone of a verdict, as colour alone does not show a verdict."""

_SUPERFLUOUS = {
    r"\n\s*(?=</?(?:caption|div|li|p|section|summary|svg|tbody|td|th|thead|tr|ul)\b)": "",
    r"\n[ \n]+": "\n",
    r"</(?:td|th|tr|li)>": "",
}
"""Line breaks at the edge of blocks, indentation, and end tags that HTML parsers imply.

Without them a page is a sixth smaller. Each pattern starts with a fixed text, which makes it fast.
"""

_TEMPLATES = Path(__file__).parent / "templates"


def write_page(path: Path, page: Page, room: float | None = None) -> list[Path]:
    """Write a page and the files of frames that do not fit into it; return all files.

    `room`: size of the frames inside the page [bytes], `MAX_INLINE_FRAMES` by default. Raises
    `OSError` if a file cannot be written.
    """
    room = MAX_INLINE_FRAMES if room is None else room
    blocks: dict[str, str] = {}
    written: list[Path] = []
    sequences = []
    for index, sequence in enumerate(page.sequences):
        rows = _rows(sequence)
        blocks[f"boxes-{index}"] = pack_boxes(np.stack([quantise(boxes) for boxes, _ in rows]))
        if shapes := {row: outlines for row, (_, outlines) in enumerate(rows) if outlines}:
            blocks[f"shapes-{index}"] = compress(json.dumps(shapes).encode())
        chunk_lengths: dict[str, Sequence[int]] = {"full": sequence.full}
        for layer, chunks in _frames_by_kind(sequence):
            needed = sum(map(len, chain(*chunks)))
            fits = needed <= room
            room -= needed if fits else 0
            for chunk_index, frames in enumerate(chunks):
                name = f"{layer}-{index}-{chunk_index}"
                if fits:
                    blocks[name] = pack_frames(frames)
                else:
                    written.append(write_chunk(path, name, frames))
            chunk_lengths[layer] = [*map(len, chunks)]
        for run_index, run in enumerate(sequence.runs):
            if run.tracker_values:
                name = f"numbers-{index}-{run_index}"
                blocks[name] = compress(json.dumps(run.tracker_values).encode())
        sequences.append(_sequence_data(sequence, chunk_lengths, has_shapes=bool(shapes)))
    player_data = {
        "trackers": [one_line(name) for name in page.trackers],
        "labels": list(page.trackers),
        "dashes": DASHES,
        "markers": MARKER_PATHS,
        "n_looped": TOP,
        "sequences": sequences,
        "folder": quote(os.fsencode(_folder(path).name)),
        "absent": ABSENT,
        "start": page.start.removeprefix("#"),
    }
    template = _environment().get_template("page.html")
    html = template.render(page=page, player_data=player_data, blocks=blocks)
    for pattern, shorter in _SUPERFLUOUS.items():
        html = re.sub(pattern, shorter, html)
    return [write_file(path, html), *written]


def card(name: str, **values: object) -> Markup:
    """Return a card as HTML: the macro of this name in `cards.html`, called with the values."""
    html: Markup = getattr(_environment().get_template("cards.html").module, name)(**values)
    return html


def _frames_by_kind(sequence: PlayerSequence) -> Iterator[tuple[str, FrameChunks]]:
    """Yield the frames of a sequence, and the weight maps of its runs, with their names."""
    yield "thumbnails", sequence.thumbnails
    for run_index, run in enumerate(sequence.runs):
        for map_index, chunks in enumerate(run.maps.values()):
            yield f"map{run_index}.{map_index}", chunks


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=lambda value: one_line(value) if type(value) is str else value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    for name, shades in (("light", LIGHT), ("dark", DARK)):
        environment.globals[name] = " ".join(f"--c{n}: {shade};" for n, shade in enumerate(shades))
    environment.globals |= {
        "template_source": _source,
        "font_face": _font_face(),
        "long": _MIN_WRAPPED,
        "markers": MARKER_PATHS,
        "version": package_version(),
        "dashes": DASHES,
        "glossary": GLOSSARY,
        "missing": MISSING,
        "symbols": _SYMBOLS,
    }
    environment.filters |= {
        "score": lambda value: f"{value:.2f}" if isfinite(value) else MISSING,
        "at_reference": at_reference,
        "svg": chart_svg,
        "colour_index": colour_index,
        "dash_class": dash_class,
        "code": _with_code,
        "one_line": one_line,
        "divided": _divided,
        "minus": with_minus,
        # A line does not end between a name and its value.
        "with_values": lambda message: re.sub(r"(?<=\w) (?=\d+\.\d)", "\u00a0", message),
        "texts": text_columns,
        "address": _address_of,
        "player_link": player_link,
    }
    environment.tests |= {
        "finite_number": lambda value: value is not None and isfinite(value),
        "all_finite": lambda values: bool(np.isfinite(values).all()),
    }
    return environment


def _source(name: str) -> Markup:
    """Return a script or style sheet without comments and spaces that browsers do not need."""
    source = (_TEMPLATES / name).read_text("utf-8")
    if name.endswith(".css"):
        source = re.sub(r"/\*.*?\*/", "", source)
        source = re.sub(r"\s*([{};,>])\s*|(?<=:)\s+", r"\1", source).replace(";}", "}")
    else:
        source = re.sub(r"(?m)^ *(//|/\*\*).*\n|  //.*$", "", source)
    return Markup(source)  # noqa: S704  # our file


def _with_code(prose: str) -> Markup:
    """Convert parts of a text between backticks to code elements."""
    escaped = str(escape(one_line(prose)))
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", escaped))  # noqa: S704  # escaped


def _divided(name: str) -> Markup:
    """Allow line breaks after the separators in a long name."""
    escaped = escape(one_line(name))
    pieces = re.split(r"(?<=[:=/,])(?=\w)", escaped) if len(name) > _MIN_DIVIDED else [escaped]
    return Markup("<wbr>").join(map(Markup, pieces))


def _font_face() -> Markup:
    """Return the rule of the page's font: a Latin subset of Inter, see `inter-OFL.txt`.

    It is the file `inter-latin-wght-normal.woff2` of the npm package @fontsource-variable/inter,
    version 5.3.0, limited by fonttools to weights of 400 to 700, ASCII, some signs and the
    features kern and tnum.
    """
    font = b64encode((_TEMPLATES / "inter.woff2").read_bytes()).decode()
    rule = "@font-face { font-family: Inter; font-weight: 400 700; src: url(data:font/woff2;base64,"
    return Markup(f"{rule}{font}); }}")  # noqa: S704  # our file


def write_chunk(page: Path, name: str, frames: Sequence[bytes]) -> Path:
    """Write frames as a script next to a page: a page on disk can load only scripts.

    `name`: `full-SEQUENCE-CHUNK`, both indices. Raises `OSError` if the file cannot be written.
    """
    content = f'trackmark("{name}","{pack_frames(frames)}")'
    path = _folder(page) / f"{name}.js"
    return write_file(path, content)


def _folder(page: Path) -> Path:
    """Return the folder of the frames that do not fit into a page."""
    return page.with_name(f"{page.stem}-frames")


def _address_of(picture: bytes) -> str:
    """Return a data URL with the content of a picture."""
    kind = "webp" if picture.startswith(b"RIFF") else "png"
    return f"data:image/{kind};base64,{b64encode(picture).decode()}"


def _rows(sequence: PlayerSequence) -> list[tuple[NDArray[np.float64], Shapes]]:
    """Return boxes and shapes of a sequence: the ground truth first, then the runs."""
    rows = [(sequence.boxes, sequence.shapes)]
    for run in sequence.runs:
        rows.append((run.boxes, run.shapes))
        rows += [] if run.revised is None else [(run.revised, {})]
    return rows


def _sequence_data(
    sequence: PlayerSequence, chunk_lengths: Mapping[str, Sequence[int]], *, has_shapes: bool
) -> dict[str, Any]:
    """Return the data of a sequence for the player's script."""
    frame_numbers = sequence.frame_numbers
    return {
        "name": sequence.name,
        "title": one_line(sequence.name),
        "n_frames": sequence.n_frames,
        "size": sequence.size,
        "first": sequence.first,
        "fps": sequence.fps,
        "reason": one_line(sequence.reason),
        "frame_numbers": None if frame_numbers is None else list(frame_numbers),
        "shapes": has_shapes,
        "chunk_lengths": _nonempty(**chunk_lengths),
        "runs": [
            {"tracker": run.tracker}
            | _nonempty(
                repetition=run.repetition,
                has_revised=run.revised is not None,
                failure=one_line(run.failure.partition("\n")[0]),
                is_ellipse=run.is_ellipse,
                maps=[*run.maps],
                numbers=bool(run.tracker_values),
                start=run.start,
                start_label=run.start_label,
                scored=run.scored,
                restarts=run.restarts,
            )
            for run in sequence.runs
        ],
    }


def _nonempty(**values: Any) -> dict[str, Any]:
    """Return the values that are not empty, zero or false: `DEFAULTS` in `sequence.js`."""
    return {name: value for name, value in values.items() if value}
