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

from trackmark.bench.pages.card_types import GLOSSARY, SYMBOLS
from trackmark.bench.pages.content import Film, Page, PlayerScene, Shapes
from trackmark.bench.pages.player_frames import ABSENT, compress, pack_boxes, quantise
from trackmark.reports.files import write_file
from trackmark.reports.package_version import package_version
from trackmark.reports.palette import DARK, DASHES, LIGHT, MARKER_PATHS, colour_index
from trackmark.reports.printable import one_line
from trackmark.reports.svg import TOP, at_reference, chart_svg
from trackmark.reports.tables import MISSING, text_columns

MAX_INLINE_FRAMES = 10_000_000
"""Size of the frames inside a page [bytes]; further frames are stored in separate files."""

_MIN_WRAPPED = 16
"""Minimum number of characters of a text in a table that is wrapped."""

_PARTS = Path(__file__).parent / "templates"


def write_page(path: Path, page: Page, room: float | None = None) -> list[Path]:
    """Write a page and the files of frames that do not fit into it; return all files.

    `room`: size of the frames inside the page [bytes], `MAX_INLINE_FRAMES` by default. Raises
    `OSError` if a file cannot be written.
    """
    room = MAX_INLINE_FRAMES if room is None else room
    inside: dict[str, str] = {}
    written: list[Path] = []
    scenes = []
    for number, scene in enumerate(page.scenes):
        rows = _rows(scene)
        inside[f"boxes-{number}"] = pack_boxes(np.stack([quantise(boxes) for boxes, _ in rows]))
        if shapes := {row: outlines for row, (_, outlines) in enumerate(rows) if outlines}:
            inside[f"shapes-{number}"] = compress(json.dumps(shapes).encode())
        reels: dict[str, Sequence[Sequence[int]]] = {"full": scene.full}
        for kind, film in _films(scene):
            needed = sum(map(len, chain(*film)))
            fits = needed <= room
            room -= needed if fits else 0
            for chunk, frames in enumerate(film):
                name = f"{kind}-{number}-{chunk}"
                if fits:
                    inside[name] = b64encode(b"".join(frames)).decode()
                else:
                    written.append(write_chunk(path, name, frames))
            reels[kind] = [[len(frame) for frame in frames] for frames in film]
        for place, take in enumerate(scene.takes):
            if take.numbers:
                name = f"numbers-{number}-{place}"
                inside[name] = compress(json.dumps(take.numbers).encode())
        scenes.append(_scene_data(scene, reels, shapes=bool(shapes)))
    data = {
        "trackers": [one_line(name) for name in page.trackers],
        "labels": list(page.trackers),
        "dashes": DASHES,
        "markers": MARKER_PATHS,
        "shown": TOP,
        "scenes": scenes,
        "beside": quote(os.fsencode(_folder(path).name)),
        "absent": ABSENT,
        "start": page.start.removeprefix("#"),
    }
    template = _environment().get_template("page.html")
    text = template.render(page=page, data=data, blocks=inside, card_html=card_html)
    text = re.sub(r"\n[ \n]+", "\n", text)  # without indentation a page is a tenth smaller
    write_file(path, lambda file: file.write_text(text, encoding="utf-8"))
    return [path, *written]


def card_html(card: object) -> Markup:
    """Return a card or a list of cards of `bench.pages.card_types`, a chart or a table as HTML."""
    kind = f"{type(card[0]).__name__}s" if isinstance(card, list) else type(card).__name__
    html: Markup = getattr(_environment().get_template("cards.html").module, kind)(card)
    return html


def _films(scene: PlayerScene) -> Iterator[tuple[str, Film]]:
    """Yield name and film of the frames and of the weight maps of all runs."""
    yield "thumbnails", scene.thumbnails
    for number, take in enumerate(scene.takes):
        for place, film in enumerate(take.maps.values()):
            yield f"map{number}.{place}", film


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_PARTS),
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
        "part": lambda name: Markup((_PARTS / name).read_text("utf-8")),  # noqa: S704  # our file
        "long": _MIN_WRAPPED,
        "markers": MARKER_PATHS,
        "version": package_version(),
        "dashes": DASHES,
        "glossary": GLOSSARY,
        "symbols": SYMBOLS,
    }
    environment.filters |= {
        "score": lambda value: f"{value:.2f}" if isfinite(value) else MISSING,
        "at_reference": at_reference,
        "svg": chart_svg,
        "colour_index": colour_index,
        "code": _with_code,
        "divided": _divided,
        "texts": text_columns,
        "address": _address_of,
    }
    environment.tests["finite_number"] = lambda value: value is not None and isfinite(value)
    return environment


def _with_code(text: str) -> Markup:
    """Convert parts of a text between backticks to code elements."""
    escaped = str(escape(one_line(text)))
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", escaped))  # noqa: S704  # escaped


def _divided(text: str) -> Markup:
    """Allow line breaks after the separators in a long name."""
    escaped = escape(one_line(text))
    pieces = re.split(r"(?<=[:=/,])(?=\w)", escaped) if len(text) > _MIN_WRAPPED else [escaped]
    return Markup("<wbr>").join(map(Markup, pieces))


def write_chunk(page: Path, name: str, frames: Sequence[bytes]) -> Path:
    """Write frames as a script next to a page: a page on disk can load only scripts.

    `name`: `full-SCENE-CHUNK`, both numbers. Raises `OSError` if the file cannot be written.
    """
    content = f'trackmark("{name}","{b64encode(b"".join(frames)).decode()}")'
    path = _folder(page) / f"{name}.js"
    return write_file(path, lambda file: file.write_text(content, encoding="ascii"))


def _folder(page: Path) -> Path:
    """Return the folder of the frames that do not fit into a page."""
    return page.with_name(f"{page.stem}-frames")


def _address_of(picture: bytes) -> str:
    """Return a data URL with the content of a picture."""
    kind = "webp" if picture.startswith(b"RIFF") else "png"
    return f"data:image/{kind};base64,{b64encode(picture).decode()}"


def _rows(scene: PlayerScene) -> list[tuple[NDArray[np.float64], Shapes]]:
    """Return boxes and shapes of a sequence: the ground truth first, then the runs."""
    rows = [(scene.boxes, scene.shapes)]
    for take in scene.takes:
        rows.append((take.boxes, take.shapes))
        rows += [] if take.revised is None else [(take.revised, {})]
    return rows


def _scene_data(scene: PlayerScene, reels: Mapping[str, Any], *, shapes: bool) -> dict[str, Any]:
    """Return the data of a sequence for the player's script."""
    takes = []
    for take in scene.takes:
        failure = one_line(take.failure.partition("\n")[0])
        run = take.tracker, take.repetition, take.revised is not None, failure, take.round
        segment = take.start, take.start_label, take.judged, take.marks
        takes.append([*run, [*take.maps], bool(take.numbers), *segment])
    return {
        "name": scene.name,
        "title": one_line(scene.name),
        "frames": scene.frames,
        "size": scene.size,
        "first": scene.first,
        "fps": scene.fps,
        "why": one_line(scene.why),
        "kept": None if scene.frame_numbers is None else list(scene.frame_numbers),
        "shapes": shapes,
        "reels": {kind: sizes for kind, sizes in reels.items() if sizes},
        "takes": takes,
    }
