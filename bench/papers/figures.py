"""Figures of a paper: film strips, series and hooks, from the `[figure]` entries of `paper.toml`.

A hook is a function `(context)` that returns a Matplotlib figure, a strip (a BGR image), a mapping
from file stems to figures and strips, or None.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.claims.row_verdicts import SETTINGS
from trackmark.bench.papers.description import FigureEntry
from trackmark.bench.papers.measures import JudgedRun, find_measure, series
from trackmark.bench.papers.plan import scene_names, tracker_text
from trackmark.bench.papers.runs import Context
from trackmark.reports.figures import write_figure
from trackmark.reports.overlay import (
    DEFAULT_WIDTH,
    MAX_COLUMNS,
    TRUTH,
    film_strip,
    write_film_strip,
)
from trackmark.reports.palette import colours
from trackmark.reports.plots import series_plot

Image = NDArray[np.uint8]
Drawn = Figure | Image
Series = NDArray[np.float64]

TILE_WIDTH = 320  # maximum width of a frame in a strip [px]
QUANTITIES = {"error": "centre error [px]"}


@dataclass(frozen=True)
class Strip:
    """Frames of a scene with the run of each tracker and setting."""

    sequence: datasets.Sequence
    frames: list[int]  # from 0
    rows: list[tuple[str, str, JudgedRun]]  # tracker, setting and run
    alike: list[str]  # by row: scenes whose frames are tracked and lost in the same way


@dataclass(frozen=True)
class Drawing:
    """Drawn figure."""

    name: str  # stem of the file, such as `figure-3`
    label: str  # name in the paper, such as `Fig. 3`
    caption: str  # content of the paper's figure
    words: str  # content of our figure
    path: Path  # PNG file
    entry: FigureEntry
    strip: Strip | None = None


def draw_figures(context: Context) -> list[Drawing]:
    """Write the figures of a paper into the report's folder, in the order of `paper.toml`.

    A quick report contains the strips and the hooks that are marked as quick. Figures without runs
    are omitted.
    """
    drawings = []
    for name, entry in context.description.figure.items():
        if entry.is_drawn(context.effort.quick):
            words, plots, strip = _draw(name, entry, context)
            for stem, plot in plots.items():
                about = stem, figure_label(stem), entry.caption_of(stem), words
                drawings.append(Drawing(*about, _write(stem, plot, context), entry, strip))
    return drawings


def figure_label(name: str) -> str:
    """Return `Fig. 3, recommended` for `figure-3-recommended`; for other names, words."""
    number, _, rest = name.removeprefix("figure-").partition("-")
    if not re.fullmatch(r"figure-\d+\w?(-.*)?", name):
        return name.replace("-", " ").capitalize()
    return ", ".join(filter(None, [f"Fig. {number}", rest.replace("-", " ")]))


def _draw(
    name: str, entry: FigureEntry, context: Context
) -> tuple[str, Mapping[str, Drawn], Strip | None]:
    """Return the text about a figure, its plots by file stem, and the content if it is a strip."""
    if entry.kind == "hook":
        plots = context.function(entry.hook)(context)
        plots = plots if isinstance(plots, Mapping) else {name: plots}
        return entry.words, {stem: plot for stem, plot in plots.items() if plot is not None}, None
    strip = read_strip(entry, context) if entry.kind == "strip" else None
    words, plot = _draw_strip(strip, entry, context) if strip else ("", None)
    if entry.kind == "series":
        words, plot = _series(entry, context)
    return words, {} if plot is None else {name: plot}, strip


def _write(name: str, plot: Drawn, context: Context) -> Path:
    context.folder.mkdir(parents=True, exist_ok=True)
    path = context.folder / f"{name}.png"
    if isinstance(plot, Figure):
        return write_figure(path, plot)
    return write_film_strip(path, plot)


def read_strip(entry: FigureEntry, context: Context) -> Strip | None:
    """Return the content of a strip: the scene with the median error; None without runs."""
    scene = median_scene(entry, context)
    if scene is None:
        return None
    frames = [number - context.description.frames_from for number in entry.frames]
    rows, alike = [], []
    for tracker, setting, text in _rows(entry, context):
        (judged, *_) = context.runs.judged_runs(text, scene)
        stored = [context.runs.judged_runs(text, names[0]) for names in _scenes(entry, context)]
        runs = [judged_runs[0] for judged_runs in stored if judged_runs]
        same = sum(_pattern(run, frames) == _pattern(judged, frames) for run in runs)
        rows.append((tracker, setting, judged))
        alike.append(f"{same} of {len(runs)} scenes")
    return Strip(datasets.load(scene), frames, rows, alike)


def _draw_strip(strip: Strip, entry: FigureEntry, context: Context) -> tuple[str, Drawn]:
    """Draw frames of a scene, one row per tracker and setting."""
    frames = strip.frames
    rows = [
        film_strip(
            strip.sequence.__getitem__,
            frames,
            {TRUTH: judged.truth.boxes, tracker: judged.boxes},
            f"{tracker}, {setting}: the same frames tracked in {alike}",
            min(len(frames), MAX_COLUMNS),
            min(DEFAULT_WIDTH, TILE_WIDTH * len(frames)),
            shape=entry.shape,
            shades=colours(list(entry.trackers)),
            words={i: f"({judged.error[i]:.1f} px)" for i in frames if judged.present[i]},
            count_from=context.description.frames_from,
        )
        for (tracker, setting, judged), alike in zip(strip.rows, strip.alike, strict=True)
    ]
    frame_numbers = ", ".join(map(str, entry.frames))
    words = (
        f"Frames {frame_numbers} of {strip.sequence.name}, with the centre error in brackets. This "
        f"scene has the median error of {entry.trackers[0]} as recommended. The title of each row "
        "counts the scenes with the same result (tracked or lost) in all of these frames."
    )
    return words, np.vstack(rows)


def median_scene(entry: FigureEntry, context: Context) -> str | None:
    """Return the scene with the median error of the first tracker as recommended, or None."""
    text = tracker_text(context.description, entry.trackers[0], "recommended")
    error = find_measure("mean_error", context.description.name)
    values = context.runs.values(text, entry.sequence, error, context.scenes)
    ordered = values.sort_values("value", kind="stable")["scene"]
    return str(ordered.iloc[(len(ordered) - 1) // 2]) if len(ordered) else None


def _pattern(judged: JudgedRun, frames: Iterable[int]) -> list[bool]:
    return [bool(judged.on_target[frame]) for frame in frames]


def _rows(entry: FigureEntry, context: Context) -> Iterator[tuple[str, str, str]]:
    """Yield tracker, setting and specification; only once if both settings are equal."""
    for tracker in entry.trackers:
        texts = [tracker_text(context.description, tracker, setting) for setting in SETTINGS]
        if len(set(texts)) == 1:
            yield tracker, "both settings", texts[0]
        else:
            for setting, text in zip(SETTINGS, texts, strict=True):
                yield tracker, setting.replace("-", " "), text


def _series(entry: FigureEntry, context: Context) -> tuple[str, Figure | None]:
    """Draw a value by frame: one line per tracker, one panel per setting."""
    by_frame = series(entry.of, context.description.name)
    quantity = entry.quantity or QUANTITIES.get(entry.of, entry.of)
    scenes, start = _scenes(entry, context), context.description.frames_from
    panels: dict[str, dict[str, Series]] = {}
    for setting in SETTINGS:
        for tracker in entry.trackers:
            text = tracker_text(context.description, tracker, setting)
            stored = (context.runs.judged_runs(text, name) for names in scenes for name in names)
            means = [np.mean([*map(by_frame, runs)], axis=0) for runs in stored if runs]
            if means:  # shorter scenes are padded with NaN
                rows = pd.DataFrame(means).to_numpy(float)
                panels.setdefault(setting.replace("-", " "), {})[tracker] = rows
    if not panels:
        return "", None
    trackers = list(entry.trackers)
    title = f"{entry.sequence}: {quantity}"
    plot = series_plot(panels, title, quantity, trackers, start)
    words = f"Curves of the {quantity} of {'; '.join(trackers)}: median and quartiles over "
    return f"{words}{len(scenes)} scenes of {entry.sequence}, one panel per setting.", plot


def _scenes(entry: FigureEntry, context: Context) -> list[list[str]]:
    return scene_names(context.description, entry.sequence, context.scenes)
